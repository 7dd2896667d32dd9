#!/usr/bin/env python3
"""Makes the ground (ground.obj) and the table of places (plants.csv) of grove.json: 300 shrubs of ../plant on rolling ground."""
import math
import os
import random

HERE = os.path.dirname(os.path.abspath(__file__))
SIDE, CELLS, BOTTOM = 14.0, 40, -1.4  # metres


def height(x, y):
    return 0.55 * math.sin(0.55 * x + 0.4) * math.cos(0.45 * y) + 0.25 * math.sin(1.1 * y - 0.7 * x)


def ground():
    """A slab, closed: the rolling top, four walls and the bottom."""
    n = CELLS + 1
    at = [SIDE * (i / CELLS - 0.5) for i in range(n)]
    lines = ["# made by make.py"]
    lines += ["v %.4f %.4f %.4f" % (x, y, height(x, y)) for y in at for x in at]
    lines += ["v %.4f %.4f %.4f" % (x, y, BOTTOM) for y in at for x in at]
    top = lambda i, j: 1 + j * n + i
    low = lambda i, j: n * n + top(i, j)
    for j in range(CELLS):
        for i in range(CELLS):
            lines.append("f %d %d %d %d" % (top(i, j), top(i + 1, j), top(i + 1, j + 1), top(i, j + 1)))
            lines.append("f %d %d %d %d" % (low(i, j), low(i, j + 1), low(i + 1, j + 1), low(i + 1, j)))
    rim = [(i, 0) for i in range(CELLS)] + [(CELLS, j) for j in range(CELLS)] + [(i, CELLS) for i in range(CELLS, 0, -1)] + [(0, j) for j in range(CELLS, 0, -1)]
    for (i, j), (k, m) in zip(rim, rim[1:] + rim[:1]):
        lines.append("f %d %d %d %d" % (low(i, j), low(k, m), top(k, m), top(i, j)))
    return "\n".join(lines) + "\n"


def places(count):
    """Rows of x, y, z, scale and turns; no two nearer than 0.55 m."""
    draw = random.Random(7)
    found = []
    while len(found) < count:
        x, y = draw.uniform(-6.5, 6.5), draw.uniform(-6.5, 6.5)
        if all((x - a) ** 2 + (y - b) ** 2 > 0.55 ** 2 for a, b in found):
            found.append((x, y))
    rows = ["x,y,z,scale,rx,ry,rz"]
    for x, y in found:
        rows.append("%.3f,%.3f,%.3f,%.3f,%.1f,%.1f,%.1f" % (x, y, height(x, y) - 0.01, draw.uniform(0.6, 1.3), draw.uniform(-6, 6), draw.uniform(-6, 6), draw.uniform(0, 360)))
    return "\n".join(rows) + "\n"


def main():
    with open(os.path.join(HERE, "ground.obj"), "w", encoding="utf-8") as file:
        file.write(ground())
    with open(os.path.join(HERE, "plants.csv"), "w", encoding="utf-8") as file:
        file.write(places(300))


if __name__ == "__main__":
    main()
