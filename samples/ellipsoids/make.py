#!/usr/bin/env python3
"""Makes thin ellipsoids that stand on a square, 360 triangles each: after the series of Ratib's thesis (1997, table 5.2).

usage: make.py [COUNT FILE]    COUNT is 25, 100, 900 or 3600; without, 100 are written to ellipsoids.obj beside this script
"""
import math
import os
import random
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
AROUND, ROWS = 12, 16  # 2 · 12 · 15 triangles


def main():
    if len(sys.argv) not in (1, 3) or not (len(sys.argv) == 1 or sys.argv[1].isdigit()):
        sys.exit(__doc__.strip())
    count, name = (int(sys.argv[1]), sys.argv[2]) if len(sys.argv) == 3 else (100, os.path.join(HERE, "ellipsoids.obj"))
    draw = random.Random(count)
    side = math.isqrt(count)
    width = 0.12 / side
    with open(name, "w") as f:
        f.write("mtllib %s\nusemtl stalk\n" % ("ellipsoids.mtl"))
        for i in range(count):
            x, y = (i % side + draw.uniform(0.2, 0.8)) / side, (i // side + draw.uniform(0.2, 0.8)) / side
            lean, turn, half = draw.uniform(0, 0.35), draw.uniform(0, 2 * math.pi), draw.uniform(0.3, 0.5)
            axis = (math.sin(lean) * math.cos(turn), math.sin(lean) * math.sin(turn), math.cos(lean))
            u = (math.cos(lean) * math.cos(turn), math.cos(lean) * math.sin(turn), -math.sin(lean))
            v = (-math.sin(turn), math.cos(turn), 0)
            centre = (x, y, half)
            first = 182 * i + 1
            put = lambda p: f.write("v %.5f %.5f %.5f\n" % tuple(p))
            put([centre[c] - half * axis[c] for c in range(3)])
            for row in range(1, ROWS):
                a = math.pi * row / ROWS
                for k in range(AROUND):
                    b = 2 * math.pi * k / AROUND
                    put([centre[c] - half * math.cos(a) * axis[c] + width * math.sin(a) * (math.cos(b) * u[c] + math.sin(b) * v[c]) for c in range(3)])
            put([centre[c] + half * axis[c] for c in range(3)])
            at = lambda row, k: first + 1 + (row - 1) * AROUND + k % AROUND
            for k in range(AROUND):
                f.write("f %d %d %d\n" % (first, at(1, k + 1), at(1, k)))
                for row in range(1, ROWS - 1):
                    f.write("f %d %d %d\nf %d %d %d\n" % (at(row, k), at(row, k + 1), at(row + 1, k), at(row, k + 1), at(row + 1, k + 1), at(row + 1, k)))
                f.write("f %d %d %d\n" % (at(ROWS - 1, k), at(ROWS - 1, k + 1), first + 181))


main()
