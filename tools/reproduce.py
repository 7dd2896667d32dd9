#!/usr/bin/env python3
"""Remakes the scenes and figures of docs/reproduction.md: what the source documents report, and what texel gets. Python's standard library only.

usage: reproduce.py TEXEL [--work FOLDER] [--images FOLDER] [--threads N] [--quick] [ROW...]
ROW: sphere hairs polygons plant levels angles spheres over; all of them without. Prints the tables as Markdown; pictures go to --images. --quick: small sizes.
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
THREADS = []


def run(texel, *words):
    """Runs texel; CPU seconds of it and what it said."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([texel, *map(str, words), "--threads", *THREADS, "--progress", "never"], capture_output=True, text=True)
    if done.returncode:
        sys.exit("texel %s: exit status %d: %s" % (" ".join(map(str, words)), done.returncode, done.stderr))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout + done.stderr


def paeth(a, b, c):
    """What PNG's fourth filter guesses from the bytes to the left, above, and above to the left."""
    pa, pb, pc = abs(b - c), abs(a - c), abs(a + b - 2 * c)
    return a if pa <= pb and pa <= pc else b if pb <= pc else c


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
                row[i] = row[i] + paeth(a, b, c) & 255
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


def read_exr(path):
    """Width, height and rows of (A, B, G, R) of an OpenEXR picture of half floats, as the program writes them: scan lines, ZIP, one part, premultiplied."""
    with open(path, "rb") as file:
        data = file.read()
    at, head = 8, {}
    while data[at]:
        name, kind = data[at:].split(b"\0", 2)[:2]
        at += len(name) + len(kind) + 2
        size = struct.unpack_from("<I", data, at)[0]
        head[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    left, top, right, bottom = struct.unpack("<4i", head[b"dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    if head[b"compression"] != b"\3" or len(head[b"channels"]) != 4 * 18 + 1 or any(head[b"channels"][18 * i + 2] != 1 for i in range(4)):
        sys.exit("%s: not four half channels and ZIP" % path)
    rows = []
    for block in struct.unpack_from("<%dQ" % ((height + 15) // 16), data, at + 1):
        y, size = struct.unpack_from("<iI", data, block)
        lines = min(16, height - (y - top))
        whole = lines * width * 8
        raw = data[block + 8:block + 8 + size]
        if size < whole:  # blocks that don't get smaller are stored as they are
            raw = bytearray(zlib.decompress(raw))
            for i in range(1, whole):
                raw[i] = raw[i - 1] + raw[i] - 128 & 255
            half = (whole + 1) // 2
            raw = bytes(b for pair in zip(raw[:half], raw[half:]) for b in pair)
        for line in range(lines):
            values = struct.unpack_from("<%de" % (4 * width), raw, line * width * 8)
            rows.append(list(zip(*(values[c * width:(c + 1) * width] for c in range(4)))))
    return width, height, rows


def sums(path):
    """Sum over an EXR's pixels of premultiplied brightness, and of alpha."""
    rows = read_exr(path)[2]
    return sum(p[1] + p[2] + p[3] for row in rows for p in row) / 3, sum(p[0] for row in rows for p in row)


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


def repeated(work, pack, mesh, side):
    """A scene of the mesh itself, side × side times as `--over plane` lays the pack's box: its path. Two specks give it the box of the texels, and so the same camera."""
    with open(os.path.join(pack, "manifest.json")) as file:
        box = json.load(file)["box"]
    low, high = box["min"], box["max"]
    wide, deep = high[0] - low[0], high[1] - low[1]
    end, speck = (low[0] + side * wide, low[1] + side * deep, high[2]), 1e-4
    with open(os.path.join(work, "corners.obj"), "w") as file:
        for corner, sign in ((low, 1), (end, -1)):
            for d in ((0, 0, 0), (speck, 0, 0), (0, speck, speck)):
                file.write("v %.9f %.9f %.9f\n" % tuple(corner[c] + sign * d[c] for c in range(3)))
        file.write("f 1 2 3\nf 4 5 6\n")
    path = os.path.join(work, "field.json")
    with open(path, "w") as file:
        json.dump({"format": "texel-scene", "version": 1, "inputs": {"texel": os.path.basename(mesh), "corners": "corners.obj"}, "objects": [
            {"input": "corners"}, {"input": "texel", "instances": [{"translate": [i * wide, j * deep, 0]} for i in range(side) for j in range(side)]}]}, file)
    return path


EXPONENTS, KS = (200, 70, 25, 9, 3), (0.5, 0.3, 0.1)


def write_spheres(work):
    """15 spheres side by side before the eye: exponents from left to right, ks from top to bottom. No blue in kd: what is blue is highlight. Their path."""
    rings, around, radius, at = 96, 192, 0.46, 1
    with open(os.path.join(work, "spheres.mtl"), "w") as file:
        for i, exponent in enumerate(EXPONENTS):
            for j, ks in enumerate(KS):
                file.write("newmtl s%d%d\nKd 0.5 0.2 0\nKs %g %g %g\nNs %g\nillum 2\n" % (i, j, ks, ks, ks, exponent))
    path = os.path.join(work, "spheres.obj")
    with open(path, "w") as file:
        file.write("mtllib spheres.mtl\n")
        for i in range(len(EXPONENTS)):
            for j in range(len(KS)):
                file.write("usemtl s%d%d\n" % (i, j))
                for r in range(rings + 1):
                    for k in range(around if 0 < r < rings else 1):
                        t, p = math.pi * r / rings, 2 * math.pi * k / around
                        n = (math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t))
                        file.write("v %.7f %.7f %.7f\nvn %.7f %.7f %.7f\n" % (i + radius * n[0], radius * n[1], -j + radius * n[2], *n))
                count = 2 + (rings - 1) * around
                point = lambda r, k: at if r == 0 else at + count - 1 if r == rings else at + 1 + (r - 1) * around + k % around
                for r in range(rings):
                    for k in range(around):
                        corners = [point(r, k), point(r + 1, k), point(r + 1, k + 1), point(r, k + 1)]
                        corners = [c for n, c in enumerate(corners) if c not in corners[:n]]
                        file.write("f %s\n" % " ".join("%d//%d" % (c, c) for c in corners))
                at += count
    return path, radius


def lobe(rows, x0, y0, radius):
    """The blue highlight of the sphere round a pixel, its radius in pixels: width at half its height along a line across, in degrees of the normal; place; peak.

    The peak is the mean of the brightest half per cent of the disc; its place their centre of mass. The width is cut off at the outline, where it has one.
    """
    inside = [(rows[y][x][1], x, y) for y in range(int(y0 - radius), int(y0 + radius) + 1) for x in range(int(x0 - radius), int(x0 + radius) + 1)
              if (x + 0.5 - x0) ** 2 + (y + 0.5 - y0) ** 2 < (0.97 * radius) ** 2]
    best = sorted(inside, reverse=True)[:max(4, len(inside) // 200)]
    weight = sum(p[0] for p in best)
    peak = weight / len(best)
    cx, cy = (sum(p[0] * (p[k] + 0.5) for p in best) / weight for k in (1, 2))

    def normal(x, y):
        u, v = (x - x0) / radius, (y - y0) / radius
        return u, v, math.sqrt(max(0.0, 1 - u * u - v * v))

    def value(x):  # linear along the line, mean of three lines against noise
        i = math.floor(x - 0.5)
        f = x - 0.5 - i
        return sum((1 - f) * rows[y][i][1] + f * rows[y][i + 1][1] for y in (int(cy) - 1, int(cy), int(cy) + 1)) / 3

    ends = []
    for step in (-0.25, 0.25):
        x = cx
        while value(x) > peak / 2 and (x + step - x0) ** 2 + (cy - y0) ** 2 < (0.97 * radius) ** 2:
            x += step
        ends.append(normal(x, cy))
    degrees = lambda a, b: math.degrees(math.acos(min(1, sum(p * q for p, q in zip(a, b)))))
    return degrees(*ends), normal(cx, cy), peak


def spheres(texel, work, images, quick):
    """15 spheres over ks and exponent: highlights of packs against truth's."""
    mesh, radius = write_spheres(work)
    n = 64 if quick else 128
    kinds = [("symmetric", ["--want", "density,color,ndf,visibility,material,levels"]), ("signed", ["--want", "renderer"]), ("visible", ["--want", "renderer", "--normals", "visible"])]
    camera = ["--azimuth", -90, "--elevation", 0, "--up", "z", "--fov", 1, "--size", "800x500", "--light", "sun:0.35,1,-0.35,1,1,1"]
    packs = []
    for name, words in kinds:
        packs.append(os.path.join(work, "spheres_%s.texel" % name))
        run(texel, "bake", mesh, "-o", packs[-1], "-r", n, "--up", "z", "--force", *words)
    pictures = []
    for name, words in [("truth", [packs[1], mesh, "--truth"])] + [(kind[0], [pack]) for kind, pack in zip(kinds, packs)]:
        picture = os.path.join(work, "spheres_%s.exr" % name)
        run(texel, "view", *words, *camera, "--samples", 16, "-o", picture)
        pictures.append((name, read_exr(picture)[2]))
        if name in ("truth", "signed"):
            run(texel, "view", *words, *camera, "--samples", 16, "--size", "216x135", "--background", SKY, "-o", os.path.join(images, "repro_spheres_%s.png" % name))
    alpha = [[p[0] for p in row] for row in pictures[0][1]]
    lines = [y for y, row in enumerate(alpha) if max(row) > 0.5]
    columns = [x for x in range(len(alpha[0])) if max(row[x] for row in alpha) > 0.5]
    unit = (columns[-1] + 1 - columns[0]) / (len(EXPONENTS) - 1 + 2 * radius)  # pixels
    print("### 15 spheres, %d³ (Ratib, figure 5.5)\n" % n)
    print("| exponent | truth: width | " + " | ".join("%s: width | off | peak" % name for name, _ in kinds) + " |\n|" + (2 + 3 * len(kinds)) * "---|")
    for i, exponent in enumerate(EXPONENTS):
        found = [[lobe(rows, columns[0] + (radius + i) * unit, lines[0] + (radius + j) * unit, radius * unit) for j in range(len(KS))] for _, rows in pictures]
        mean = lambda values: sum(values) / len(values)
        cells = ["%.1f°" % mean([f[0] for f in found[0]])]
        for ours in found[1:]:
            off = [math.degrees(math.acos(min(1, sum(p * q for p, q in zip(a[1], b[1]))))) for a, b in zip(ours, found[0])]
            cells += ["%.1f°" % mean([f[0] for f in ours]), "%.1f°" % mean(off), "%.2f" % mean([a[2] / b[2] for a, b in zip(ours, found[0])])]
        print("| %d | %s |" % (exponent, " | ".join(cells)))
    print("\nMeans over ks %s. Width: full, at half of the peak, of the highlight in degrees of the normal. Off: from its place in truth. Peak: over truth's.\n" % ", ".join(map(str, KS)))


def alphas(path):
    width, height, channels, rows = read_png(path)
    return [[row[channels * x + channels - 1] / 255 if channels in (2, 4) else 1.0 for x in range(width)] for row in rows]


def within(mask, border):
    """Pixels of the mask with the mask all around, `border` pixels up, down and to both sides."""
    for _ in range(border):
        mask = [[mask[y][x] and 0 < x < len(mask[0]) - 1 and 0 < y < len(mask) - 1 and mask[y][x - 1] and mask[y][x + 1] and mask[y - 1][x] and mask[y + 1][x]
                 for x in range(len(mask[0]))] for y in range(len(mask))]
    return mask


def write_sheet(path, grid, top=0.0, bottom=1.0):
    """One 8-bit RGB PNG of a grid of pictures of the same size, of each what lies between two shares of its height."""
    lines, above = [], None
    for names in grid:
        pictures = [read_png(name) for name in names]
        for y in range(int(top * pictures[0][1]), int(bottom * pictures[0][1])):
            line = b"".join(bytes(v for x in range(width) for v in rows[y][channels * x:channels * x + 3]) for width, _, channels, rows in pictures)
            above = above or bytes(len(line))
            lines.append(b"\4" + bytes(v - paeth(line[i - 3] if i > 2 else 0, above[i], above[i - 3] if i > 2 else 0) & 255 for i, v in enumerate(line)))
            above = line
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", (len(lines[0]) - 1) // 3, len(lines), 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(b"".join(lines), 9)) + chunk(b"IEND", b""))


def angles(texel, work, images, quick):
    """The pear's slices from angles off their axis: what of the truth's silhouette they leave open."""
    mesh, packs = os.path.join(ROOT, "samples/pear/pear.obj"), []
    print("### The pear's slices, 64³, by the angle off their axis (Meyer & Neyret, figure 9)\n")
    for name, words in (("64", []), ("55", ["--slice-count", "auto"]), ("30", ["--slice-count", "auto", "--max-angle", 30])):
        pack = os.path.join(work, "pear_slices_%s.texel" % name)
        run(texel, "bake", mesh, "-r", 64, "--up", "z", "--want", "slices", "--force", "-o", pack, *words)
        with open(os.path.join(pack, "manifest.json")) as file:
            stacks = json.load(file)["slices"]
        packs.append((name, pack, {axis: stack["max_angle"] for axis, stack in stacks.items()}))
        print("- `%s`: %s" % (" ".join(map(str, words)) or "-r 64", "; ".join("%s %d slices, stated %.1f°" % (axis, stack["count"], stack["max_angle"]) for axis, stack in stacks.items())))
    heads = [(name, axis) for name, _, _ in packs for axis in ("x", "z")]
    print("\n| angle | %s |\n|%s" % (" | ".join("%s %s: open | inside" % head for head in heads), (1 + 2 * len(heads)) * "---|"))
    truth, slices = os.path.join(work, "angle_truth.png"), os.path.join(work, "angle.png")
    for a in sorted({0, 31, 55, 62} | set(range(0, 90, 20 if quick else 5))):
        cells = {}
        for axis, azimuth, elevation in (("x", a, 0), ("z", -90, 90 - a)):
            camera = ["--azimuth", azimuth, "--elevation", elevation, "--fov", 1, "--size", "256x256", "--samples", 16]  # nearly parallel: one angle all over the picture
            run(texel, "view", packs[0][1], mesh, "--truth", *camera, "-o", truth)
            mask = [[v > 0.5 for v in row] for row in alphas(truth)]
            inner = within(mask, 8)
            for name, pack, stated in packs:
                run(texel, "view", pack, "--mode", "slices", "--axis", axis, *camera, "-o", slices)
                seen, shares = alphas(slices), []
                for inside, least in ((mask, 0.5), (inner, 0.98)):
                    shares.append(100 * sum(m and v < least for line, values in zip(inside, seen) for m, v in zip(line, values)) / sum(map(sum, inside)))
                cells[name, axis] = ("%.2f | %.2f" if a <= stated[axis] else "*%.2f* | *%.2f*") % tuple(shares)
        print("| %g° | %s |" % (a, " | ".join(cells[head] for head in heads)), flush=True)
    print("\nPer cent of truth's silhouette; *beyond the stated angle*. Open: alpha below one half. Inside: below 0.98, without the outermost 8 of 256 pixels (two voxels).\n")
    grid = []
    for name, pack, _ in (packs[0], packs[2]):
        grid.append([])
        for a in (0, 31, 62, 80):
            grid[-1].append(os.path.join(work, "pear_%s_%d.png" % (name, a)))
            run(texel, "view", pack, "--mode", "slices", "--axis", "x", "--azimuth", a, "--elevation", 0, "--fov", 1, "--size", "104x104", "--background", SKY, "-o", grid[-1][-1])
    write_sheet(os.path.join(images, "repro_pear_angles.png"), grid)


def levels(texel, work, images, quick):
    """Hair texels from near to far: mean light and cover of pack and truth, and how much they change from step to step."""
    pack, mesh = os.path.join(work, "hairs_100.texel"), os.path.join(work, "hairs_100.obj")
    if not os.path.isdir(pack):
        hairs(texel, work, images, True)
    field, picture = repeated(work, pack, mesh, 25), os.path.join(work, "step.exr")
    camera = ["--elevation", 60, "--up", "z"]
    scenes = [("625 texels of 100 hairs, `--over plane`", [pack, "--over", "plane", "--repeat", "25,25", "--samples", 16, *camera], [field, "--truth", "--samples", 64, *camera]),
              ("One texel, plain view", [pack, "--samples", 64, *camera], [pack, "--truth", "--samples", 64, *camera])]
    first, ratio, least = (160, 0.8, 16) if quick else (320, 0.93, 12)
    print("### Hair texels from near to far (Ratib, figures 5.11 and 5.12)\n")
    for name, ours, truths in scenes:
        print("%s:\n\n| pixels a side | truth: light | cover | pack: light | cover | change of light: truth | pack | of cover: truth | pack |\n|---|---|---|---|---|---|---|---|---|" % name)
        size, start, before, worst, drift = first, None, None, [0.0] * 4, None
        while size >= least:  # fewer pixels stand for more distance: perspective stays as it is
            now = []
            for words in (truths, ours):
                run(texel, "view", *words, "--size", "%dx%d" % (size, size), "-o", picture)
                now += [v / size / size for v in sums(picture)]
            start = start or now
            change = [now[i] / (before or now)[i] - 1 for i in (0, 2, 1, 3)]
            drift = [now[i] / start[i] - 1 for i in (0, 2, 1, 3)]
            worst = [max(w, abs(c)) for w, c in zip(worst, change)]
            print(("| %d | %.4f | %.4f | %.4f | %.4f |" + 4 * " %+.1f %% |") % (size, *now, *(100 * c for c in change)), flush=True)
            before, size = now, int(size * ratio)
        for what, i in (("light", 0), ("cover", 2)):
            print("\nOf %s: largest step %.1f %% of truth, %.1f %% of the pack; drift from first to last %+.1f %% and %+.1f %%." % (
                what, *(100 * v for v in (worst[i], worst[i + 1], drift[i], drift[i + 1]))))
        print()
    print("Each level alone, at 160 pixels a side; cover of the pack over truth's:\n\n| level | voxel, of the texel's side | 625 texels | one, plain view |\n|---|---|---|---|")
    with open(os.path.join(pack, "manifest.json")) as file:
        sides = [max(level["resolution"]) for level in json.load(file)["levels"]]
    true = []
    for level in [None, *range(len(sides))]:
        cover = []
        for _, ours, truths in scenes:
            run(texel, "view", *(truths if level is None else [*ours, "--level", level]), "--size", "160x160", "-o", picture)
            cover.append(sums(picture)[1])
        if level is None:
            true = cover
        else:
            print("| %d | 1/%d | %.3f | %.3f |" % (level, sides[level], cover[0] / true[0], cover[1] / true[1]), flush=True)
    # One picture from near to far: rows of the pack against those of truth, of bands that lie within the texels.
    field, rows = repeated(work, pack, mesh, 60), []
    camera, sheet = ["--elevation", 30, "--azimuth", -90, "--up", "z", "--fov", 110], []
    for name, words in (("truth", [field, "--truth", "--samples", 64]), ("pack", [pack, "--over", "plane", "--repeat", "60,60", "--samples", 16])):
        run(texel, "view", *words, *camera, "--size", "384x384", "-o", picture)
        rows.append([(sum(p[1] + p[2] + p[3] for p in row) / 3, sum(p[0] for p in row)) for row in read_exr(picture)[2]])
        sheet.append(os.path.join(work, "far_%s.png" % name))
        run(texel, "view", *words, *camera, "--size", "256x256", "--background", SKY, "-o", sheet[-1])
    bands = [[[sum(line[i] for line in picture_rows[y:y + 4]) for i in (0, 1)] for y in range(0, 384, 4)] for picture_rows in rows]
    held = [y for y, band in enumerate(bands[0]) if band[1] > 0.01]
    ratios = [[bands[1][y][i] / bands[0][y][i] for i in (0, 1)] for y in held[1:-1]]
    steps = [max(abs(b[i] / a[i] - 1) for a, b in zip(ratios, ratios[1:])) for i in (0, 1)]
    print("\nOne picture of 3600 texels from near to far, %d bands of 4 rows without the first and last: pack over truth %.3f to %.3f in light, %.3f to %.3f in cover; largest step from band to band %.2f %% and %.2f %%.\n" % (
        len(ratios), *(f(r[i] for r in ratios) for i in (0, 1) for f in (min, max)), *(100 * v for v in steps)))
    write_sheet(os.path.join(images, "repro_hairs_far.png"), [sheet], 0.3, 0.55)


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


ROWS = {"sphere": sphere, "hairs": hairs, "polygons": polygons, "plant": plant, "levels": levels, "angles": angles, "spheres": spheres, "over": over}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("texel")
    parser.add_argument("rows", nargs="*", choices=[*ROWS, []], default=[])
    parser.add_argument("--work", default="reproduction")
    parser.add_argument("--images")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--threads", default="all")
    options = parser.parse_intermixed_args()  # rows may stand before and after options
    images = options.images or options.work
    THREADS.append(options.threads)
    for folder in (options.work, images):
        os.makedirs(folder, exist_ok=True)
    for row in options.rows or ROWS:
        ROWS[row](os.path.abspath(options.texel), options.work, images, options.quick)
        sys.stdout.flush()


main()
