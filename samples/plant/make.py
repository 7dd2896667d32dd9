#!/usr/bin/env python3
"""Grows plant.opf: a shrub of three orders of axes in the Open Plant Format: two shapes, and organs that are those shapes, tapered and placed."""
import math
import os
import random

HERE = os.path.dirname(os.path.abspath(__file__))
GOLDEN = math.radians(137.508)  # from one node to the next
SIDES = 6


def add(a, b, k=1.0):
    return tuple(x + k * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(sum(x * x for x in a))
    return tuple(x / length for x in a)


def frame(along, up=(0.0, 0.0, 1.0)):
    """Two unit vectors across `along`; the second is as near to `up` as can be."""
    side = cross(up, along)
    side = (1.0, 0.0, 0.0) if sum(x * x for x in side) < 1e-12 else unit(side)
    return side, cross(along, side)


def grow(draw):
    """Axes, each a list of internodes (start, direction, length, laterals, has leaf), the trunk first. Laterals are axes' numbers."""
    axes = []
    buds = [((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0, 15)]
    while buds:
        place, along, order, nodes = buds.pop(0)
        axis = []
        axes.append(axis)
        turn = draw.uniform(0, 2 * math.pi)
        for i in range(nodes):
            length = (6.5, 4.6, 3.4)[order] * draw.uniform(0.8, 1.15) * (1 - 0.3 * i / nodes)
            # Axes wander a little; laterals bend up towards the light.
            along = unit(add(along, (draw.gauss(0, 0.05), draw.gauss(0, 0.05), draw.gauss(0, 0.04) + (0, 0.09, 0.05)[order])))
            internode = {"start": place, "along": along, "length": length, "laterals": [], "leaf": order > 0 or i > 9, "turn": turn}
            axis.append(internode)
            place = add(place, along, length)
            if (order == 0 and 2 <= i < nodes - 1) or (order == 1 and i >= 1 and i < nodes - 1):
                side, other = frame(along)
                angle = math.radians(draw.uniform(48, 66))
                across = add(tuple(math.cos(turn) * x for x in side), other, math.sin(turn))
                lateral = unit(add(tuple(math.cos(angle) * x for x in along), across, math.sin(angle)))
                size = max(2, 10 - (2 * i) // 3) if order == 0 else max(2, 5 - i // 2)
                internode["laterals"].append(len(axes) + len(buds))
                buds.append((place, lateral, order + 1, size))
            turn += GOLDEN
    return axes


def thicken(axes):
    """Diameters after da Vinci: the cross-section of an internode is that of all it bears."""
    for axis in reversed(axes):  # laterals come after what bears them
        borne = 1.0
        for internode in reversed(axis):
            borne += internode["leaf"] + sum(axes[k][0]["borne"] for k in internode["laterals"])
            internode["borne"] = borne
    for axis in axes:
        for internode, after in zip(axis, axis[1:] + [None]):
            internode["base"] = 0.19 * math.sqrt(internode["borne"])
            internode["tip"] = 0.19 * math.sqrt(after["borne"] if after else 1.0)


class Writer:
    def __init__(self):
        self.lines, self.ids = [], 0

    def open(self, tag, kind):
        self.ids += 1
        self.lines.append('<%s class="%s" id="%d">' % (tag, kind, self.ids))

    def geometry(self, shape, start, along, length, base, tip, across):
        third = cross(along, across)
        rows = ("%.5g %.5g %.5g %.5g" % (along[r] * length, across[r], third[r], start[r]) for r in range(3))
        self.lines.append('<geometry class="Mesh"><shapeIndex>%d</shapeIndex><mat>\n%s\n</mat><dUp>%.4g</dUp><dDwn>%.4g</dDwn></geometry>'
                          % (shape, "\n".join(rows), tip, base))


def write_axis(axes, number, draw, out):
    """The axis and, inside its nodes, its laterals."""
    work = [(number, 0)]
    while work:
        axis, i = work.pop()
        if i < 0:
            out.lines.append("</branch>")
            continue
        if i == len(axes[axis]):
            continue
        node = axes[axis][i]
        work.append((axis, i + 1))
        out.open("follow" if i else "decomp", "Internode")
        side, _ = frame(node["along"])
        out.geometry(0, node["start"], node["along"], node["length"], node["base"], node["tip"], side)
        if node["leaf"]:
            end = add(node["start"], node["along"], node["length"])
            side, other = frame(node["along"])
            across = add(tuple(math.cos(node["turn"] + math.pi) * x for x in side), other, math.sin(node["turn"] + math.pi))
            along = unit(add(add(node["along"], across, 1.3), (0, 0, draw.uniform(-0.35, 0.1))))
            width = draw.uniform(2.6, 3.8)
            out.open("branch", "Leaf")
            out.geometry(1, end, along, 2.1 * width, width, width, frame(along)[0])
            out.lines.append("</branch>")
        out.lines.append("</%s>" % ("follow" if i else "decomp"))
        for lateral in node["laterals"]:
            out.open("branch", "Axis")
            work.append((lateral, -1))
            work.append((lateral, 0))
    return out


def tube():
    ring = [(0.5 * math.cos(2 * math.pi * k / SIDES), 0.5 * math.sin(2 * math.pi * k / SIDES)) for k in range(SIDES)]
    points = [(x, c, s) for x in (0, 1) for c, s in ring]
    faces = [(k, (k + 1) % SIDES, SIDES + (k + 1) % SIDES, SIDES + k) for k in range(SIDES)]
    return points, faces


def leaf():
    """A blade folded along its middle, as wide as 1 and as long as 1, drooping towards the tip."""
    points = [(x, y, z) for x, w, z in ((0.08, 0.02, 0), (0.35, 0.5, 0.03), (0.65, 0.4, 0.01), (1.0, 0.0, -0.12))
              for y, z in ((-w, z + 0.25 * w), (0, z), (w, z + 0.25 * w))][:-2]
    return points, [(3, 4, 1, 0), (4, 5, 2, 1), (6, 7, 4, 3), (7, 8, 5, 4), (9, 7, 6), (9, 8, 7)]


def mesh(number, shape):
    points, faces = shape
    return ('<mesh Id="%d" enableScale="true">\n<points>%s</points>\n<faces>%s</faces>\n</mesh>'
            % (number, " ".join("%.5g %.5g %.5g" % p for p in points),
               "".join('<face Id="%d">%s</face>' % (i, " ".join(map(str, f))) for i, f in enumerate(faces))))


def main():
    draw = random.Random(11)
    axes = grow(draw)
    thicken(axes)
    out = Writer()
    out.open("topology", "Plant")
    write_axis(axes, 0, draw, out)
    out.lines.append("</topology>")
    materials = "".join('<material Id="%d"><diffuse>%s 1</diffuse></material>' % (i, rgb) for i, rgb in enumerate(("0.43 0.33 0.24", "0.36 0.55 0.20")))
    shapes = "".join('<shape Id="%d"><name>%s</name><meshIndex>%d</meshIndex><materialIndex>%d</materialIndex></shape>' % (i, name, i, i)
                     for i, name in enumerate(("internode", "leaf")))
    with open(os.path.join(HERE, "plant.opf"), "w", encoding="utf-8") as file:
        file.write('<?xml version="1.0" encoding="UTF-8"?>\n<!-- made by make.py -->\n<opf version="2.0" editable="true">\n<meshBDD>\n%s\n%s\n</meshBDD>\n'
                   '<materialBDD>%s</materialBDD>\n<shapeBDD>%s</shapeBDD>\n' % (mesh(0, tube()), mesh(1, leaf()), materials, shapes))
        file.write("\n".join(out.lines) + "\n</opf>\n")


if __name__ == "__main__":
    main()
