#!/usr/bin/env python3
"""Files with numbers that are hard on a program, through the program: each becomes a pack that `texel check` finds whole, or is refused in one line.

Usage: files.py --texel PROGRAM --work FOLDER [--count N] [--seed N]. TEXEL_STRESS multiplies the count. Every case that fails is named and its file kept.
Documented statuses of an item: baked, or status 1, 2 or 3 (docs/cli.md). Issues must be listed in docs/issues.md."""
import argparse
import json
import os
import random
import re
import shutil
import struct
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))

# Written as they stand in a text file. None of them may crash, hang or end in a value that is not finite.
NUMBERS = ["0", "-0", "1", "0.5", "1e-20", "1e-45", "1e-310", "4.9e-324", "1e20", "1e38", "1e99", "1e150", "1e200", "1e308", "1e309", "-1e400", "nan", "NaN", "-nan", "inf", "-Infinity",
           "1e9", "1000000000.5", "0.1", "0.30000000000000004", "9007199254740993", "1e-9", "2147483648", "-1", "1.", ".5", "1e", "0x1p3", "1,5", ""]


def cube(scale, offset):
    points = [[(x - 0.5) * scale + offset[0], (y - 0.5) * scale + offset[1], (z - 0.5) * scale + offset[2]] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    return points, [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def solid(rng):
    """Points as texts, faces: a cube somewhere, of some size, with a few numbers replaced."""
    scale = 10.0 ** rng.uniform(-20, 20)
    offset = [rng.uniform(-1, 1) * scale * 10.0 ** rng.uniform(-3, 9) for _ in range(3)]
    points, faces = cube(scale, offset)
    texts = [[repr(v) for v in p] for p in points]
    kind = rng.randrange(5)
    if kind == 1:  # some numbers are others
        for _ in range(rng.randrange(1, 4)):
            rng.choice(texts)[rng.randrange(3)] = rng.choice(NUMBERS)
    elif kind == 2:  # flat
        axis = rng.randrange(3)
        for p in texts:
            p[axis] = texts[0][axis]
    elif kind == 3:  # all coordinates are odd ones
        texts = [[rng.choice(NUMBERS[:12] + NUMBERS[22:]) for _ in range(3)] for _ in texts]
    elif kind == 4:  # a second one far away
        more, other = cube(1, [10.0 ** rng.uniform(0, 15)] * 3)
        faces = faces + [[i + 8 for i in f] for f in other]
        texts += [[repr(v) for v in p] for p in more]
    if rng.randrange(3) == 0:
        faces = faces[:-1]
    if rng.randrange(4) == 0:
        faces.append(rng.choice([[0, 0, 0], [0, 1, 99999], [0, 1, -5], [0, 1], [7, 7, 1, 1]]))
    return texts, faces


def write_obj(path, rng):
    points, faces = solid(rng)
    with open(path, "w", encoding="utf-8") as out:
        if rng.randrange(2):
            out.write("mtllib %s.mtl\nusemtl m\n" % os.path.basename(path))
            with open(path + ".mtl", "w", encoding="utf-8") as mtl:
                mtl.write("newmtl m\n")
                for word, count in (("Kd", 3), ("Ks", 3), ("Ke", 3), ("Ns", 1), ("d", 1), ("Tr", 1), ("Ni", 1), ("illum", 1)):
                    if rng.randrange(2):
                        mtl.write(word + " " + " ".join(rng.choice(NUMBERS + ["7", "-3", "1e30"]) for _ in range(count)) + "\n")
        for p in points:
            out.write("v " + " ".join(p) + ((" " + " ".join(rng.choice(NUMBERS) for _ in range(3))) if rng.randrange(6) == 0 else "") + "\n")
        if rng.randrange(3) == 0:
            out.write("vt " + rng.choice(NUMBERS) + " " + rng.choice(NUMBERS) + "\n")
        for f in faces:
            out.write("f " + " ".join(str(i + 1) for i in f) + "\n")
        if rng.randrange(5) == 0:
            out.write("l 1 2 3\n")


def write_off(path, rng):
    points, faces = solid(rng)
    with open(path, "w", encoding="utf-8") as out:
        out.write("OFF\n%s %s 0\n" % (rng.choice([len(points)] * 6 + [0, -1, 10**12]), len(faces)))
        for p in points:
            out.write(" ".join(p) + "\n")
        for f in faces:
            out.write(str(len(f)) + " " + " ".join(str(i) for i in f) + "\n")


def write_ply(path, rng):
    points, faces = solid(rng)
    binary = rng.randrange(2) == 0
    kind = rng.choice(["float", "double"])
    with open(path, "wb") as out:
        out.write(("ply\nformat %s 1.0\nelement vertex %d\nproperty %s x\nproperty %s y\nproperty %s z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n"
                   % ("binary_little_endian" if binary else "ascii", len(points), kind, kind, kind, len(faces))).encode())
        if not binary:
            for p in points:
                out.write((" ".join(p) + "\n").encode())
            for f in faces:
                out.write((str(len(f)) + " " + " ".join(map(str, f)) + "\n").encode())
            return
        for p in points:
            for text in p:
                try:
                    value = float(text)
                except ValueError:
                    value = 0.0
                if kind == "float" and abs(value) > 3e38 and value == value and abs(value) != float("inf"):
                    value = float("inf")
                out.write(struct.pack("<f" if kind == "float" else "<d", value))
        for f in faces:
            out.write(struct.pack("<B", len(f)) + struct.pack("<%di" % len(f), *f))


def write_stl(path, rng):
    points, faces = solid(rng)
    values = []
    for p in points:
        row = []
        for text in p:
            try:
                row.append(float(text))
            except ValueError:
                row.append(0.0)
        values.append([v if abs(v) < 3e38 or v != v else float("inf") for v in row])
    triangles = [[f[0], f[i], f[i + 1]] for f in faces for i in range(1, len(f) - 1) if all(0 <= k < len(points) for k in f)]
    with open(path, "wb") as out:
        out.write(b"stress".ljust(80) + struct.pack("<I", rng.choice([len(triangles)] * 6 + [len(triangles) + 1, 0xffffffff])))
        for t in triangles:
            out.write(struct.pack("<3f", 0, 0, 0))
            for i in t:
                out.write(struct.pack("<3f", *values[i]))
            out.write(struct.pack("<H", 0))


def run(arguments, timeout=300):
    done = subprocess.run(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=timeout, check=False)
    return done.returncode, done.stdout.decode("utf-8", "replace"), done.stderr.decode("utf-8", "replace")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--texel", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--count", type=int, default=80)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    count = max(1, round(options.count * float(os.environ.get("TEXEL_STRESS") or 1)))
    folder = os.path.join(options.work, "files")
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(os.path.join(folder, "in"))
    writers = [("obj", write_obj), ("obj", write_obj), ("ply", write_ply), ("stl", write_stl), ("off", write_off)]
    for i in range(count):
        rng = random.Random(options.seed * 1000003 + i)
        extension, write = writers[i % len(writers)]
        write(os.path.join(folder, "in", "%05d.%s" % (i, extension)), rng)

    faults = []
    packs = os.path.join(folder, "packs")
    status, out, err = run([options.texel, "batch", os.path.join(folder, "in"), "-o", packs, "-r", "9", "--want", "slices,density,color,ndf,visibility,material,normal,levels"], 3000)
    if status not in (0, 6):
        faults.append("batch ended with status %d: %s" % (status, err.strip()[-500:]))
    with open(os.path.join(packs, "batch-report.json"), encoding="utf-8") as file:
        report = json.load(file)
    with open(os.path.join(HERE, "..", "..", "docs", "issues.md"), encoding="utf-8") as file:
        known = set(re.findall(r"`([a-z0-9-]+)`", file.read()))
    items = report["items"]
    if len(items) != count:
        faults.append("%d files, but %d items in the report" % (count, len(items)))
    baked = refused = warned = 0
    for item in items:
        name = item["input"]
        if item["status"] == "failed":
            refused += 1
            text = item.get("message") or ""
            if not text or "\n" in text or os.path.basename(name) not in text:
                faults.append("%s: refused without a line that names it: %r" % (name, text))
            continue
        baked += 1
    for root, _, files in os.walk(packs):
        if "manifest.json" not in files:
            continue
        with open(os.path.join(root, "manifest.json"), encoding="utf-8") as file:
            text = file.read()
        manifest = json.loads(text, parse_constant=lambda word: faults.append("%s: the manifest holds %s" % (root, word)))
        for issue in manifest.get("issues", []):
            warned += 1
            if issue["id"] not in known:
                faults.append("%s: issue %s is not in docs/issues.md" % (root, issue["id"]))
        code, checked, problem = run([options.texel, "check", root])
        if code != 0:
            faults.append("%s: check: %s" % (root, (checked + problem).strip()[:600]))
    print("stress files: %d files, %d baked and found whole, %d refused in one line, %d issues reported" % (count, baked, refused, warned))
    for fault in faults[:20]:
        print("FAULT " + fault)
    if not faults:
        shutil.rmtree(folder, ignore_errors=True)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
