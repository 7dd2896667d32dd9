#!/usr/bin/env python3
"""Makes meadow.obj: blades of grass and a few flowers on a unit square, which lean over its borders. Baked with --cyclic x,y it tiles."""
import math
import os
import random

HERE = os.path.dirname(os.path.abspath(__file__))
PIECES = 5  # of a blade


def blade(draw, lines, points):
    """A strip of quads that bends over; its middle line is a parabola."""
    x, y = draw.random(), draw.random()
    turn, lean = draw.uniform(0, 2 * math.pi), draw.uniform(0.05, 0.22)
    height, width = draw.uniform(0.12, 0.3), draw.uniform(0.008, 0.016)
    dx, dy = math.cos(turn), math.sin(turn)
    first = len(points) + 1
    for i in range(PIECES + 1):
        t = i / PIECES
        for side in (-1, 1):
            w = side * width * (1 - t) ** 0.7
            points.append((x + dx * lean * t * t - dy * w, y + dy * lean * t * t + dx * w, height * (1.3 * t - 0.3 * t * t)))
    lines.append("usemtl grass%d" % draw.randrange(3))
    for i in range(PIECES):
        a = first + 2 * i
        lines.append("f %d %d %d %d" % (a, a + 1, a + 3, a + 2) if i + 1 < PIECES else "f %d %d %d" % (a, a + 1, a + 2))


def flower(draw, lines, points):
    """Eight petals about a point above the grass."""
    x, y, z, radius = draw.random(), draw.random(), draw.uniform(0.24, 0.32), draw.uniform(0.03, 0.05)
    lines.append("usemtl petal%d" % draw.randrange(2))
    for k in range(8):
        a = 2 * math.pi * k / 8
        first = len(points) + 1
        points.append((x, y, z - 0.01))
        for b in (a - 0.3, a, a + 0.3):
            r = radius if b == a else radius * 0.75
            points.append((x + r * math.cos(b), y + r * math.sin(b), z))
        lines.append("f %d %d %d %d" % (first, first + 1, first + 2, first + 3))


def main():
    draw = random.Random(7)
    points, lines = [], []
    # Ground without walls: solid together with its repetitions.
    for z in (-0.02, 0.0):
        points += [(0, 0, z), (1, 0, z), (1, 1, z), (0, 1, z)]
    lines += ["usemtl soil", "f 4 3 2 1", "f 5 6 7 8"]
    for _ in range(700):
        blade(draw, lines, points)
    for _ in range(14):
        flower(draw, lines, points)
    with open(os.path.join(HERE, "meadow.obj"), "w", encoding="utf-8") as file:
        file.write("# made by make.py\nmtllib meadow.mtl\n")
        file.writelines("v %.6f %.6f %.6f\n" % p for p in points)
        file.writelines(line + "\n" for line in lines)
    colors = {"soil": (0.16, 0.11, 0.07), "grass0": (0.10, 0.32, 0.05), "grass1": (0.18, 0.42, 0.08), "grass2": (0.30, 0.48, 0.12),
              "petal0": (0.85, 0.75, 0.10), "petal1": (0.80, 0.25, 0.45)}
    with open(os.path.join(HERE, "meadow.mtl"), "w", encoding="utf-8") as file:
        for name, color in colors.items():
            file.write("newmtl %s\nKd %.2f %.2f %.2f\n" % ((name,) + color))


if __name__ == "__main__":
    main()
