#!/usr/bin/env python3
"""Remakes the scenes and figures of docs/reproduction.md: what the source documents report, and what texel gets. Python's standard library only.

usage: reproduce.py TEXEL [--work FOLDER] [--images FOLDER] [--quick] [ROW...]
ROW: sphere hairs polygons plant levels over; all of them without. Prints the tables as Markdown; pictures go to --images. --quick: small sizes.
"""
import argparse
import json
import math
import os
import resource
import struct
import subprocess
import sys
import zlib

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SKY = "0.6,0.7,0.9"


def run(texel, *words):
    """Runs texel; CPU seconds of it and what it said."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([texel, *map(str, words), "--progress", "never"], capture_output=True, text=True)
    if done.returncode:
        sys.exit("texel %s: exit status %d: %s" % (" ".join(map(str, words)), done.returncode, done.stderr))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout + done.stderr


def read_png(path):
    """Width, height, channels and rows of bytes of an 8-bit PNG without interlace."""
    with open(path, "rb") as file:
        data = file.read()
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
        elif kind == b"IDAT":
            packed += body
        at += size + 12
    if depth != 8:
        sys.exit("%s: not 8 bits deep" % path)
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[color]
    raw, stride = zlib.decompress(packed), width * channels
    rows, above = [], bytearray(stride)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            a, b, c = (row[i - channels] if i >= channels else 0), above[i], (above[i - channels] if i >= channels else 0)
            if kind == 1:
                row[i] = row[i] + a & 255
            elif kind == 2:
                row[i] = row[i] + b & 255
            elif kind == 3:
                row[i] = row[i] + (a + b) // 2 & 255
            elif kind == 4:
                pa, pb, pc = abs(b - c), abs(a - c), abs(a + b - 2 * c)
                row[i] = row[i] + (a if pa <= pb and pa <= pc else b if pb <= pc else c) & 255
        rows.append(row)
        above = row
    return width, height, channels, rows


def linear(byte):
    v = byte / 255
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4


def brightness(path, left=0.0, right=1.0):
    """Sum over pixels of premultiplied linear brightness, and of alpha, between two shares of the width."""
    width, height, channels, rows = read_png(path)
    light = cover = 0.0
    for row in rows:
        for x in range(int(left * width), int(right * width)):
            p = row[x * channels:(x + 1) * channels]
            a = p[3] / 255 if channels == 4 else 1.0
            cover += a
            light += a * sum(map(linear, p[:3])) / 3
    return light, cover


def volume_bytes(pack):
    return sum(os.path.getsize(os.path.join(pack, name)) for name in os.listdir(pack) if name.endswith(".vdb"))


def slope(sizes, values):
    x, y = [math.log(v) for v in sizes], [math.log(v) for v in values]
    mx, my = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)


def write_sphere(path, rings=64):
    around = 2 * rings
    at = lambda i, j: 1 + i * around + j % around
    with open(path, "w") as f:
        for i in range(rings + 1):
            for j in range(around):
                t, p = math.pi * i / rings, 2 * math.pi * j / around
                f.write("v %.9f %.9f %.9f\n" % (math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)))
        for i in range(rings):
            for j in range(around):
                if i > 0:
                    f.write("f %d %d %d\n" % (at(i, j), at(i + 1, j), at(i, j + 1)))
                if i + 1 < rings:
                    f.write("f %d %d %d\n" % (at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)))


def sphere(texel, work, images, quick):
    print("### A sphere from 8³ on (Ratib, table 5.1)\n\n| resolution | Ratib: s | MB | texel: CPU s | MB |\n|---|---|---|---|---|")
    theirs = {8: (4, 0.073), 16: (16, 0.344), 32: (70, 1.550), 64: (295, 6.360)}
    mesh = os.path.join(work, "sphere.obj")
    write_sphere(mesh)
    sizes = [8, 16, 32, 64, 128, 256] if quick else [8, 16, 32, 64, 128, 256, 512, 1024]
    times, counts = [], []
    for n in sizes:
        pack = os.path.join(work, "sphere_%d.texel" % n)
        times.append(run(texel, "bake", mesh, "-o", pack, "-r", n, "--want", "renderer", "--force")[0])
        counts.append(volume_bytes(pack))
        s, mb = theirs.get(n, ("", ""))
        print("| %d³ | %s | %s | %.2f | %.3f |" % (n, s, mb, times[-1], counts[-1] / 1e6))
    big = [i for i, n in enumerate(sizes) if n >= 32]
    print("\nExponent from 32³ on: time %.2f, bytes %.2f. Starting the program and loading OpenVDB is in every row.\n" %
          (slope([sizes[i] for i in big], [times[i] for i in big]), slope([sizes[i] for i in big], [counts[i] for i in big])))


def hairs(texel, work, images, quick):
    print("### Thin ellipsoids, 64³ (Ratib, table 5.2)\n\n| ellipsoids | Ratib: s | MB | texel: CPU s | MB |\n|---|---|---|---|---|")
    theirs = {25: (220, 2.78), 100: (751, 10.59), 900: (1874, 29.10), 3600: (3913, 55.23)}
    counts, times, sizes = [25, 100] if quick else [25, 100, 900, 3600], [], []
    for count in counts:
        mesh, pack = os.path.join(work, "hairs_%d.obj" % count), os.path.join(work, "hairs_%d.texel" % count)
        subprocess.run([sys.executable, os.path.join(ROOT, "samples/ellipsoids/make.py"), str(count), mesh], check=True)
        with open(os.path.join(work, "ellipsoids.mtl"), "w") as f, open(os.path.join(ROOT, "samples/ellipsoids/ellipsoids.mtl")) as source:
            f.write(source.read())
        times.append(run(texel, "bake", mesh, "-o", pack, "-r", 64, "--want", "renderer", "--up", "z", "--force")[0])
        sizes.append(volume_bytes(pack))
        print("| %d | %s | %s | %.2f | %.2f |" % ((count,) + theirs[count] + (times[-1], sizes[-1] / 1e6)))
    print("\nExponent against the number: time %.2f, bytes %.2f.\n" % (slope(counts, times), slope(counts, sizes)))


def polygons(texel, work, images, quick):
    print("### Two opposite polygons (Ratib, figure 3.4)\n\n| | the one that faces the light | the one turned from it |\n|---|---|---|")
    mesh, pack = os.path.join(work, "polygons.obj"), os.path.join(work, "polygons.texel")
    with open(mesh, "w") as f:
        f.write("v -1 -0.4 0\nv -0.2 -0.4 0\nv -0.2 0.4 0\nv -1 0.4 0\nv 0.2 -0.4 0\nv 1 -0.4 0\nv 1 0.4 0\nv 0.2 0.4 0\nf 1 2 3 4\nf 5 8 7 6\n")
    run(texel, "bake", mesh, "-o", pack, "-r", 64, "--want", "renderer", "--up", "z", "--force")
    for mode in ("truth", "volume"):
        picture = os.path.join(images, "repro_polygons_%s.png" % mode)
        run(texel, "view", pack, "--mode", mode, "--elevation", 90, "--azimuth", -90, "--up", "z", "--size", "256x128", "--light", "sun:0,0,-1,1,1,1", "-o", picture)
        halves = [brightness(picture, a, b) for a, b in ((0, 0.5), (0.5, 1))]
        print("| %s | %.3f | %.3f |" % ((mode,) + tuple(light / max(cover, 1e-9) for light, cover in halves)))
    print("\nMean linear brightness of what is seen; the albedo is 0.5.\n")


def plant(texel, work, images, quick):
    report = os.path.join(work, "plant.json")
    pack = os.path.join(work, "plant.texel")
    seconds = run(texel, "bake", os.path.join(ROOT, "samples/plant/plant.opf"), "-o", pack, "-r", "128" if quick else "256", "--up", "z", "--want", "renderer", "--force", "--report", report)[0]
    with open(report) as file:
        skipped = json.load(file).get("skipped", [])
    print("### A plant without fill (Meyer & Neyret, figure 10)\n\nBaked in %.1f CPU s. Skipped, as the report says:\n" % seconds)
    for item in skipped:
        print("- " + (", ".join("%s: %s" % pair for pair in sorted(item.items())) if isinstance(item, dict) else str(item)))
    print()


def levels(texel, work, images, quick):
    """Hair texels from near to far: mean brightness from step to step."""
    pack = os.path.join(work, "hairs_100.texel")
    if not os.path.isdir(pack):
        hairs(texel, work, images, True)
    print("### 625 texels of 100 hairs, pixels growing (Ratib, figures 5.11 and 5.12)\n\n| pixels a side | mean light | mean cover | change of light |\n|---|---|---|---|")
    picture, before, worst = os.path.join(work, "step.png"), None, 0.0
    size, least = 160 if quick else 512, 20 if quick else 12
    while size >= least:  # fewer pixels stand for more distance: perspective stays as it is
        run(texel, "view", pack, "--over", "plane", "--repeat", "25,25", "--elevation", 60, "--size", "%dx%d" % (size, size), "--samples", 16, "-o", picture)
        light, cover = (v / size / size for v in brightness(picture))
        change = 0 if before is None else light / before - 1
        worst = max(worst, abs(change))
        print("| %d | %.4f | %.4f | %+.2f %% |" % (size, light, cover, 100 * change))
        before, size = light, int(size * (0.8 if quick else 0.93))
    print("\nLargest step: %.2f %%.\n" % (100 * worst))


def over(texel, work, images, quick):
    """Figures 10, 12 and 13 of Meyer & Neyret, figure 5.11 of Ratib."""
    pixels = "184x184" if quick else "320x320"
    perlin, pear, bush = (os.path.join(work, n + ".texel") for n in ("perlin", "pear", "plant"))
    if not os.path.isdir(perlin):
        run(texel, "bake", "--recipe", os.path.join(ROOT, "samples/perlin/recipe.json"), "--want", "renderer", *(["-r", "64"] if quick else []), "-o", perlin)
    if not os.path.isdir(pear):
        run(texel, "bake", os.path.join(ROOT, "samples/pear/pear.obj"), "-r", 64, "--up", "z", "--want", "renderer", "-o", pear)
    if not os.path.isdir(bush):
        plant(texel, work, images, quick)
    if not os.path.isdir(os.path.join(work, "hairs_100.texel")):
        hairs(texel, work, images, True)
    scenes = [("perlin_plane", perlin, ["plane", "--repeat", "5,5", "--elevation", 30]),
              ("perlin_sphere", perlin, ["sphere", "--repeat", "12,8"]),
              ("pear_sphere", pear, ["sphere", "--repeat", "12,8", "--ground", "0.1,0.15,0.05"]),
              ("plant_plane", bush, ["plane", "--repeat", "4,4", "--ground", "0.2,0.15,0.1", "--elevation", 25]),
              ("hairs_plane", os.path.join(work, "hairs_100.texel"), ["plane", "--repeat", "25,25", "--ground", "0.2,0.15,0.1", "--elevation", 15])]
    print("### Texels over surfaces (Meyer & Neyret, figures 10, 12, 13; Ratib, figure 5.11)\n\n| picture | CPU s |\n|---|---|")
    for name, pack, words in scenes:
        picture = os.path.join(images, "repro_%s.png" % name)
        seconds = run(texel, "view", pack, "--over", *words, "--size", pixels, "--background", SKY, "-o", picture)[0]
        print("| ![%s](images/repro_%s.png) | %.1f |" % (name.replace("_", " on a "), name, seconds), flush=True)
    hair_pack = os.path.join(work, "hairs_100.texel")
    print("\nTime against number of texels (table 5.3), 100 hairs each, 128², one ray a pixel:\n\n| texels | Ratib: geometry, s | texels, s | texel: CPU s |\n|---|---|---|---|")
    for side, theirs in ((1, (142, 294)), (4, (289, 1170)), (10, (883, 1379)), (25, (2576, 1332)), (60, ("", 2497))):
        seconds = run(texel, "view", hair_pack, "--over", "plane", "--repeat", "%d,%d" % (side, side), "--elevation", 25, "--size", "128x128", "-o", os.path.join(work, "count.png"))[0]
        print("| %d | %s | %s | %.1f |" % (side * side, theirs[0], theirs[1], seconds), flush=True)
    print()


ROWS = {"sphere": sphere, "hairs": hairs, "polygons": polygons, "plant": plant, "levels": levels, "over": over}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("texel")
    parser.add_argument("rows", nargs="*", choices=[*ROWS, []], default=[])
    parser.add_argument("--work", default="reproduction")
    parser.add_argument("--images")
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    images = options.images or options.work
    for folder in (options.work, images):
        os.makedirs(folder, exist_ok=True)
    for row in options.rows or ROWS:
        ROWS[row](os.path.abspath(options.texel), options.work, images, options.quick)
        sys.stdout.flush()


main()
