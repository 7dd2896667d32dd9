#!/usr/bin/env python3
"""Makes tuft.hair: 3600 curved hairs on a ball, in Cem Yuksel's HAIR format (points, thickness, one colour)."""
import math
import os
import random
import struct

HERE = os.path.dirname(os.path.abspath(__file__))
HAIRS, POINTS = 3600, 12
ROOT, TIP = 0.0024, 0.0005  # thickness


def hair(draw, i):
    """From a place of Fibonacci's lattice on a ball outwards, then bent down and aside, with a curl of its own."""
    z = 1 - (2 * i + 1) / HAIRS
    turn = i * math.pi * (3 - math.sqrt(5))
    r = math.sqrt(1 - z * z)
    out = (r * math.cos(turn), r * math.sin(turn), z)
    side = (-math.sin(turn), math.cos(turn), 0)
    length = draw.uniform(0.35, 0.55)
    droop, aside, curl, phase = draw.uniform(0.15, 0.35), draw.uniform(0.05, 0.2), draw.uniform(0.0, 0.02), draw.uniform(0, 2 * math.pi)
    for k in range(POINTS):
        t = k / (POINTS - 1)
        a = phase + 9 * t
        x = [0.4 * out[c] + length * t * out[c] + side[c] * aside * t * t for c in range(3)]
        x[0] += curl * t * math.cos(a)
        x[1] += curl * t * math.sin(a)
        x[2] -= droop * t * t
        yield x, ROOT + (TIP - ROOT) * t


def main():
    draw = random.Random(3600)
    points, thickness = [], []
    for i in range(HAIRS):
        for at, width in hair(draw, i):
            points += [round(c, 5) for c in at]
            thickness.append(round(width, 6))
    head = b"HAIR" + struct.pack("<4I", HAIRS, HAIRS * POINTS, 2 | 4, POINTS - 1) + struct.pack("<5f", ROOT, 0, 0.72, 0.5, 0.3)
    with open(os.path.join(HERE, "tuft.hair"), "wb") as f:
        f.write(head.ljust(128, b"\0"))
        f.write(struct.pack("<%df" % len(points), *points))
        f.write(struct.pack("<%df" % len(thickness), *thickness))


main()
