#!/usr/bin/env python3
"""Whole runs of `texel`: wall and CPU time, peak memory, bytes written, against the targets in docs/performance.md.

  tests/bench/process_bench.py build/bench/bin/texel [--repeat 3] [--only PATTERN] [--quick] [--json FILE]

Prints tables in Markdown. Time on a busy machine: CPU seconds stay meaningful, wall seconds do not.
"""
import argparse
import fnmatch
import json
import math
import os
import platform
import statistics
import struct
import subprocess
import sys
import tempfile
import time
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
SHARED = os.path.join(ROOT, "..", "shared", "data", "models")
EVERYTHING = "slices,density,color,ndf,visibility,material,normal,levels"  # all but the preview


def model(*names):
    """The first of the files that is there, or None."""
    for name in names:
        if os.path.exists(name):
            return name
    return None


def sphere(folder, level):
    """A subdivided icosahedron of radius 1 as OFF: 20·4^level triangles."""
    path = os.path.join(folder, f"sphere_{level}.off")
    if os.path.exists(path):
        return path
    g = (1 + math.sqrt(5)) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
              (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
             (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]

    def unit(p):
        length = math.sqrt(sum(c * c for c in p))
        return tuple(c / length for c in p)

    points = [unit(p) for p in points]
    for _ in range(level):
        middles = {}

        def middle(a, b):
            key = (a, b) if a < b else (b, a)
            if key not in middles:
                middles[key] = len(points)
                points.append(unit([points[a][i] + points[b][i] for i in range(3)]))
            return middles[key]

        finer = []
        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    with open(path, "w", encoding="ascii") as out:
        out.write(f"OFF\n{len(points)} {len(faces)} 0\n")
        out.writelines(f"{x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in points)
        out.writelines(f"3 {a} {b} {c}\n" for a, b, c in faces)
    return path


def terrain(folder, side):
    """A 16-bit grey PNG of side² rolling heights with a little noise: every square has some twist."""
    path = os.path.join(folder, f"terrain_{side}.png")
    if os.path.exists(path):
        return path
    waves = [[math.sin(2 * math.pi * f * i / side + f) / f for i in range(side)] for f in (1, 2, 5, 13, 31)]
    state, rows = 1, []
    for y in range(side):
        row = bytearray(b"\0")
        for x in range(side):
            state = (state * 1664525 + 1013904223) & 0xffffffff
            z = sum(w[x] * w[y] for w in waves) / 4 + (state >> 16) / 65536 * 0.004
            value = int(min(max(0.5 + z, 0), 1) * 65535)
            row += bytes((value >> 8, value & 255))
        rows.append(bytes(row))

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 16, 0, 0, 0, 0)) +
                  chunk(b"IDAT", zlib.compress(b"".join(rows), 1)) + chunk(b"IEND", b""))
    return path


def folder_bytes(folder):
    return sum(os.path.getsize(os.path.join(place, f)) for place, _, files in os.walk(folder) for f in files)


def run(command):
    """(wall, cpu, peak MB) of one process."""
    start = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    errors = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    wall = time.perf_counter() - start
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        sys.exit(f"{' '.join(command)}: exit status {child.returncode}\n{errors.decode(errors='replace')}")
    return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


class Bench:
    def __init__(self, options, work):
        self.options, self.work, self.rows = options, work, []

    def wanted(self, name):
        return fnmatch.fnmatch(name, self.options.only)

    def command(self, name, command, target):
        runs = [run(command) for _ in range(max(self.options.repeat, 5))]
        return self.add(name, runs, 0, {}, target)

    def bake(self, name, source, resolution, want, target=None, memory_target=None):
        if source is None:
            return None
        report = os.path.join(self.work, "report.json")
        runs = []
        for i in range(self.options.repeat):
            # A new place each time, nothing removed before the end: ext4 is slow at making files just after many were deleted.
            pack = os.path.join(self.work, f"{len(self.rows)}_{i}.texel")
            command = [self.options.texel, "bake", source, "-o", pack, "-r", str(resolution), "--want", want, "--report", report]
            if self.options.threads:
                command += ["--threads", str(self.options.threads)]
            runs.append(run(command))
        size = folder_bytes(pack)
        with open(report, encoding="utf-8") as file:
            details = json.load(file)
        return self.add(name, runs, size, details, target, memory_target)

    def add(self, name, runs, size, details, target, memory_target=None):
        counts = details.get("counts", {})
        row = {"name": name, "wall": statistics.median(r[0] for r in runs), "wall_min": min(r[0] for r in runs),
               "cpu": statistics.median(r[1] for r in runs), "memory": max(r[2] for r in runs), "bytes": size,
               "voxels": counts.get("border voxels", 0), "target": target, "memory_target": memory_target,
               "stages": {t["stage"]: t["cpu_seconds"] for t in details.get("times", [])}}
        self.rows.append(row)
        met = ""
        if target:
            met = f"{target:g} s" + (f", {memory_target} MB" if memory_target else "")
            met += " yes" if row["wall"] <= target and (not memory_target or row["memory"] <= memory_target) else " NO"
        print(f"| {name} | {row['wall']:.3f} | {row['wall_min']:.3f} | {row['cpu']:.3f} | {row['memory']:.0f} | {size / 1e6:.2f} | {met} |", flush=True)
        return row


def exponent(rows, key):
    """Slope of log(key) against log(n), least squares."""
    x = [math.log(n) for n, _ in rows]
    y = [math.log(row[key]) for _, row in rows]
    mx, my = statistics.fmean(x), statistics.fmean(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)


def machine(options):
    name = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            name = next(line.split(":", 1)[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    commit = subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"], capture_output=True, text=True, check=False).stdout.strip()
    load = os.getloadavg()[0]
    return f"{name}, {os.cpu_count()} threads ({options.threads or 'all'} used), load {load:.1f} at the start; commit {commit or 'unknown'}; median of {options.repeat}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("texel", help="the program")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--only", default="*", help="what to run, with * and ?: --version, bunny, bonsai, hedge, lily, height, sphere")
    parser.add_argument("--quick", action="store_true", help="nothing above 256 voxels")
    parser.add_argument("--json", help="figures into this file")
    options = parser.parse_args()
    options.texel = os.path.abspath(options.texel)
    bunny = model(os.path.join(SHARED, "bunny_closed.off"), os.path.join(ROOT, "samples", "bunny", "bunny_closed.off"))
    bonsai = model(os.path.join(SHARED, "bonsai", "bonsai-tree.obj"), os.path.join(ROOT, "samples", "bonsai", "bonsai-tree.obj"))
    hedge = model(os.path.join(SHARED, "hedge", "hedgeTextured.obj"))
    lily = model(os.path.join(SHARED, "lily_vase", "calla_lily_with_roses.obj"))

    print(machine(options))
    print("\n| run | wall s | least | CPU s | peak MB | pack MB | target |\n|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="texel_bench_") as work:
        bench = Bench(options, work)
        if bench.wanted("--version"):
            bench.command("--version", [options.texel, "--version"], 0.02)
        reference, plants = None, []
        if bench.wanted("bunny"):
            bench.bake("bunny 256 density,color", bunny, 256, "density,color", 0.35)
            reference = bench.bake("bunny 256 all", bunny, 256, EVERYTHING, 1.5, 300)
        for name, source in (("bonsai", bonsai), ("hedge", hedge), ("lily", lily)):
            if bench.wanted(name):
                plants.append(bench.bake(f"{name} 256 all", source, 256, EVERYTHING))
        if bench.wanted("height"):
            bench.bake("height 1024² 256 density,color", terrain(work, 1024), 256, "density,color")
            bench.bake("height 1024² 256 all", terrain(work, 1024), 256, EVERYTHING)
            if not options.quick:
                bench.bake("height 4096² 256 density,color", terrain(work, 4096), 256, "density,color")
        if bench.wanted("bunny") and not options.quick:
            bench.bake("bunny 512 density,color", bunny, 512, "density,color")
            bench.bake("bunny 512 all", bunny, 512, EVERYTHING, 6)
        spheres = []
        if bench.wanted("sphere"):  # all of them: an exponent needs no less
            source = sphere(work, 6)  # 81 920 triangles: little next to the voxels from 128 up
            for n in (64, 128, 256) if options.quick else (64, 128, 256, 512, 1024):
                spheres.append((n, bench.bake(f"sphere {n}", source, n, "density,color")))

        if reference:
            print("\n| plant against the bunny | border voxels | CPU s | CPU µs a border voxel | bunny's | times |\n|---|---|---|---|---|---|")
            own = reference["cpu"] / max(reference["voxels"], 1) * 1e6
            for row in filter(None, plants):
                per = row["cpu"] / max(row["voxels"], 1) * 1e6
                print(f"| {row['name']} | {row['voxels']:.0f} | {row['cpu']:.2f} | {per:.2f} | {own:.2f} | {per / own:.2f} |")
        if spheres:
            fixed = spheres[0][1]
            print(f"\nsphere {spheres[0][0]} to {spheres[-1][0]}: time ~ n^{exponent(spheres, 'cpu'):.2f} (CPU), bytes ~ n^{exponent(spheres, 'bytes'):.2f}, "
                  f"memory ~ n^{exponent(spheres, 'memory'):.2f}; the last doubling: time x {spheres[-1][1]['cpu'] / spheres[-2][1]['cpu']:.2f}, "
                  f"bytes x {spheres[-1][1]['bytes'] / spheres[-2][1]['bytes']:.2f} (n^2 is x 4; start-up and reading are {fixed['cpu']:.2f} s at {spheres[0][0]})")
        staged = [row for row in bench.rows if row["stages"]]
        if staged:
            names = list(dict.fromkeys(s for row in staged for s in row["stages"]))
            print("\nCPU seconds by stage\n\n| run | " + " | ".join(names) + " |\n|---|" + "---|" * len(names))
            for row in staged:
                print(f"| {row['name']} | " + " | ".join(f"{row['stages'].get(n, 0):.3f}" for n in names) + " |")
        if options.json:
            with open(options.json, "w", encoding="utf-8") as file:
                json.dump(bench.rows, file, indent=1)


if __name__ == "__main__":
    main()
