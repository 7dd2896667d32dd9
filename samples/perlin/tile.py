#!/usr/bin/env python3
"""Lays copies of a pack's z stack side by side and looks at them from above: tile.py PACK PICTURE.png [COPIES].

Only Python's own library. The stack is composited from the top slice down, then repeated; a seam would show as a line."""
import json
import os
import struct
import sys
import zlib


def read_rgba(path):
    """(width, height, bytes) of an 8-bit RGBA PNG without interlacing."""
    with open(path, "rb") as file:
        data = file.read()
    at, packed, width, height = 8, b"", 0, 0
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
            assert (depth, color) == (8, 6), "slices are 8-bit RGBA"
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    raw, out, before, step = zlib.decompress(packed), bytearray(), bytearray(4 * width), 4 * width + 1
    for y in range(height):
        rule, line = raw[y * step], bytearray(raw[y * step + 1:(y + 1) * step])
        if rule:
            for i, value in enumerate(line):  # undo the PNG filters
                left, up, corner = (line[i - 4] if i > 3 else 0), before[i], (before[i - 4] if i > 3 else 0)
                near = min((abs(up - corner), 0, left), (abs(left - corner), 1, up), (abs(left + up - 2 * corner), 2, corner))[2]
                line[i] = (value + (0, left, up, (left + up) // 2, near)[rule]) & 255
        out += line
        before = line
    return width, height, out


def write_rgb(path, width, height, rows):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows), 9)) + chunk(b"IEND", b""))


def main():
    pack, picture, copies = sys.argv[1], sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 3
    with open(os.path.join(pack, "manifest.json"), encoding="utf-8") as file:
        stack = json.load(file)["slices"]["z"]
    width, height = stack["width"], stack["height"]
    linear = [c / 255 / 12.92 if c <= 10 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in range(256)]
    color, left = [0.0] * (3 * width * height), [1.0] * (width * height)
    for k in reversed(range(stack["count"])):
        _, _, pixels = read_rgba(os.path.join(pack, stack["pattern"] % k))
        for i, alpha in enumerate(pixels[3::4]):
            if alpha and left[i] > 1e-4:
                weight = left[i] * alpha / 255
                for c in range(3):
                    color[3 * i + c] += weight * linear[pixels[4 * i + c]]
                left[i] *= 1 - alpha / 255
    encoded = bytearray()
    for value in color:
        encoded.append(round(255 * (12.92 * value if value <= 0.0031308 else 1.055 * min(value, 1) ** (1 / 2.4) - 0.055)))
    rows = [bytes(encoded[3 * width * y:3 * width * (y + 1)]) * copies for y in range(height)] * copies
    write_rgb(picture, width * copies, height * copies, rows)


if __name__ == "__main__":
    main()
