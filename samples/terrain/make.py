#!/usr/bin/env python3
"""Makes crater_color.png, a colour for every height of crater.png: dust below, bare rock where it is steep, pale rims above."""
import os

from PIL import Image  # Debian package python3-pil

HERE = os.path.dirname(os.path.abspath(__file__))


def mixed(a, b, t):
    t = min(max(t, 0.0), 1.0)
    return tuple(x + (y - x) * t for x, y in zip(a, b))


def main():
    picture = Image.open(os.path.join(HERE, "crater.png"))
    width, height = picture.size
    values = list(picture.getdata())
    z = [values[width * y:width * (y + 1)] for y in range(height)]
    dust, pale, rock = (150, 104, 66), (226, 200, 160), (92, 70, 62)
    pixels = []
    for y in range(height):
        for x in range(width):
            dx = z[y][min(x + 1, width - 1)] - z[y][max(x - 1, 0)]
            dy = z[min(y + 1, height - 1)][x] - z[max(y - 1, 0)][x]
            steep = (dx * dx + dy * dy) ** 0.5 / 5000
            pixels.append(tuple(round(c) for c in mixed(mixed(dust, pale, (z[y][x] - 8000) / 20000), rock, steep - 0.15)))
    out = Image.new("RGB", (width, height))
    out.putdata(pixels)
    out.save(os.path.join(HERE, "crater_color.png"), optimize=True)


if __name__ == "__main__":
    main()
