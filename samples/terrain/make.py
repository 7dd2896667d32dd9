#!/usr/bin/env python3
"""Makes crater_color.png, a colour for every height of crater.png: dust below, bare rock where it is steep, pale rims above."""
import os
import struct
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))


def read_grey16(path):
    """(width, height, rows of values) of a 16-bit grey PNG without interlacing."""
    with open(path, "rb") as file:
        data = file.read()
    at, packed, width, height = 8, b"", 0, 0
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
            assert (depth, color) == (16, 0)
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    raw, rows, before = zlib.decompress(packed), [], bytearray(2 * width)
    for y in range(height):
        rule, line = raw[y * (2 * width + 1)], bytearray(raw[y * (2 * width + 1) + 1:(y + 1) * (2 * width + 1)])
        for i in range(len(line)):  # undo the PNG filters
            left, up, corner = (line[i - 2] if i > 1 else 0), before[i], (before[i - 2] if i > 1 else 0)
            near = min((abs(up - corner), 0, left), (abs(left - corner), 1, up), (abs(left + up - 2 * corner), 2, corner))[2]
            line[i] = (line[i] + (0, left, up, (left + up) // 2, near)[rule]) & 255
        rows.append([line[2 * x] << 8 | line[2 * x + 1] for x in range(width)])
        before = line
    return width, height, rows


def write_rgb(path, width, height, pixels):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    raw = b"".join(b"\0" + bytes(c for pixel in row for c in pixel) for row in pixels)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def mixed(a, b, t):
    t = min(max(t, 0.0), 1.0)
    return tuple(x + (y - x) * t for x, y in zip(a, b))


def main():
    width, height, z = read_grey16(os.path.join(HERE, "crater.png"))
    dust, pale, rock = (150, 104, 66), (226, 200, 160), (92, 70, 62)
    pixels = []
    for y in range(height):
        row = []
        for x in range(width):
            dx = z[y][min(x + 1, width - 1)] - z[y][max(x - 1, 0)]
            dy = z[min(y + 1, height - 1)][x] - z[max(y - 1, 0)][x]
            steep = (dx * dx + dy * dy) ** 0.5 / 5000
            row.append(tuple(round(c) for c in mixed(mixed(dust, pale, (z[y][x] - 8000) / 20000), rock, steep - 0.15)))
        pixels.append(row)
    write_rgb(os.path.join(HERE, "crater_color.png"), width, height, pixels)


if __name__ == "__main__":
    main()
