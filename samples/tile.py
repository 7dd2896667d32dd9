#!/usr/bin/env python3
"""Lays copies of a pack's z stack side by side and looks at them from above: tile.py PACK PICTURE.png [COPIES].

Needs Pillow (Debian package python3-pil). The stack is composited from the top slice down, then repeated; a seam would show as a line."""
import json
import os
import sys

from PIL import Image


def main():
    pack, picture, copies = sys.argv[1], sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 3
    with open(os.path.join(pack, "manifest.json"), encoding="utf-8") as file:
        stack = json.load(file)["slices"]["z"]
    width, height = stack["width"], stack["height"]
    linear = [c / 255 / 12.92 if c <= 10 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in range(256)]
    color, left = [0.0] * (3 * width * height), [1.0] * (width * height)
    for k in reversed(range(stack["count"])):
        pixels = Image.open(os.path.join(pack, stack["pattern"] % k)).convert("RGBA").tobytes()
        for i, alpha in enumerate(pixels[3::4]):
            if alpha and left[i] > 1e-4:
                weight = left[i] * alpha / 255
                for c in range(3):
                    color[3 * i + c] += weight * linear[pixels[4 * i + c]]
                left[i] *= 1 - alpha / 255
    encoded = bytearray()
    for value in color:
        encoded.append(round(255 * (12.92 * value if value <= 0.0031308 else 1.055 * min(value, 1) ** (1 / 2.4) - 0.055)))
    tile, out = Image.frombytes("RGB", (width, height), bytes(encoded)), Image.new("RGB", (width * copies, height * copies))
    for i in range(copies * copies):
        out.paste(tile, (i % copies * width, i // copies * height))
    out.save(picture, optimize=True)


if __name__ == "__main__":
    main()
