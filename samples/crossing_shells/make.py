#!/usr/bin/env python3
"""Makes crossing_shells.obj, .mtl and leaf.png beside this script: the cases a baker can get wrong, small.

A sphere within a sphere (a hollow ball), two touching spheres, two crossing spheres, two polygons in one place that face
opposite ways, and a leaf card cut out by its texture's alpha. `make.py FOLDER` writes there instead."""
import math
import os
import struct
import sys
import zlib

RINGS, SECTORS = 16, 32


class Obj:
    def __init__(self):
        self.lines, self.points, self.uvs = ["mtllib crossing_shells.mtl"], 0, 0

    def sphere(self, name, material, centre, radius, outwards=True):
        first = self.points + 1
        self.lines += [f"o {name}", f"usemtl {material}"]
        ring = []
        self.point(centre[0], centre[1], centre[2] - radius)
        for i in range(1, RINGS):
            polar = math.pi * i / RINGS
            ring.append(self.points + 1)
            for j in range(SECTORS):
                around = 2 * math.pi * j / SECTORS
                self.point(centre[0] + radius * math.sin(polar) * math.cos(around),
                           centre[1] + radius * math.sin(polar) * math.sin(around),
                           centre[2] - radius * math.cos(polar))
        self.point(centre[0], centre[1], centre[2] + radius)
        last = self.points
        for j in range(SECTORS):
            k = (j + 1) % SECTORS
            self.face([first, ring[0] + k, ring[0] + j], outwards)
            for a, b in zip(ring, ring[1:]):
                self.face([a + j, a + k, b + k, b + j], outwards)
            self.face([last, ring[-1] + j, ring[-1] + k], outwards)

    def card(self, name, material, corners, uv=False, outwards=True):
        self.lines += [f"o {name}", f"usemtl {material}"]
        first = self.points + 1
        for corner in corners:
            self.point(*corner)
        if not uv:
            return self.face([first, first + 1, first + 2, first + 3], outwards)
        self.lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
        self.lines.append("f " + " ".join(f"{first + i}/{self.uvs + 1 + i}" for i in range(4)))
        self.uvs += 4

    def point(self, x, y, z):
        # Adding zero turns -0 into 0, so that the text does not depend on the mathematics library's signs.
        self.lines.append("v " + " ".join(f"{round(c, 5) + 0.0:.5f}" for c in (x, y, z)))
        self.points += 1

    def face(self, corners, outwards):
        self.lines.append("f " + " ".join(str(c) for c in (corners if outwards else reversed(corners))))


def scene():
    obj = Obj()
    obj.sphere("ball", "red", (0, 0, 0), 1)
    obj.sphere("cavity", "red", (0, 0, 0), 0.6, outwards=False)
    obj.sphere("touching_left", "green", (2, 0, 0), 0.5)
    obj.sphere("touching_right", "green", (3, 0, 0), 0.5)
    obj.sphere("crossing_low", "blue", (0, 2.2, -0.3), 0.7)
    obj.sphere("crossing_high", "yellow", (0, 2.2, 0.3), 0.7)
    square = [(1.6, 1.6, 0), (2.6, 1.6, 0), (2.6, 2.6, 0), (1.6, 2.6, 0)]
    obj.card("facing_up", "red", square)
    obj.card("facing_down", "blue", square, outwards=False)
    obj.card("leaf_card", "leaf", [(2.7, 2.1, -0.5), (3.5, 2.5, -0.5), (3.5, 2.5, 0.7), (2.7, 2.1, 0.7)], uv=True)
    return "\n".join(obj.lines) + "\n"


def materials():
    colors = {"red": "0.8 0.15 0.1", "green": "0.2 0.6 0.15", "blue": "0.1 0.2 0.7", "yellow": "0.85 0.7 0.1"}
    text = "".join(f"newmtl {name}\nKd {kd}\nKs 0 0 0\n\n" for name, kd in colors.items())
    return text + "newmtl leaf\nKd 1 1 1\nKs 0 0 0\nmap_Kd leaf.png\n"


def leaf(size=64):
    """A pointed leaf with a lighter rib, opaque inside and cut out outside."""
    rows = bytearray()
    for y in range(size):
        rows.append(0)  # PNG: this row is stored without prediction
        v = 1 - (y + 0.5) / size
        half = 0.42 * math.sin(math.pi * v) ** 0.8
        for x in range(size):
            u = abs((x + 0.5) / size - 0.5)
            inside = 255 if u < half else 0
            rows += bytes((120, 170, 70, inside) if u < 0.03 else (50, 120, 40, inside))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", size, size, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(rows), 9)) + chunk(b"IEND", b"")


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else os.path.dirname(os.path.abspath(__file__))
    for name, data in (("crossing_shells.obj", scene().encode()), ("crossing_shells.mtl", materials().encode()), ("leaf.png", leaf())):
        with open(os.path.join(folder, name), "wb") as file:
            file.write(data)


if __name__ == "__main__":
    main()
