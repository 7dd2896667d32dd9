#!/usr/bin/env python3
"""What `--max-error E` costs against the best fixed number of rays, known only afterwards.

  tests/bench/max_error.py build/release/bin/texel [--resolution 128] [--models bunny,lily | FILE …] [--errors 0.02,0.01,0.005] [--json FILE]

Of each model and E: the fewest fixed --samples whose rms error of alpha is at most E on level 0 alone, and on every level, which is what --max-error
promises; CPU seconds (user + system of the process, the least of --repeat runs) of those bakes and of the bake that is asked for E; what that one says
and what it is. Errors are against a pack of --truth-samples rays along a voxel's edge, every voxel; where textures cut holes, against the geometry
itself, in --voxels voxels of each level (`texel compare`). --json keeps the figures; errors of fixed bakes found in it are not measured again.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
SHARED = os.path.join(ROOT, "..", "shared", "data", "models")
MODELS = {"bunny": "bunny_closed.off", "armadillo": "armadillo.off", "hedge": "hedge/hedgeTextured.obj", "fruit bowl": "fruit_bowl/bowlWithFruits.obj",
          "bonsai": "bonsai/bonsai-tree.obj", "lily": "lily_vase/calla_lily_with_roses.obj", "bicycle": "bicycle/bicycle.obj"}
USUAL = "bunny,armadillo,hedge,fruit bowl,bonsai,lily"
SAMPLES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)


def find_model(name):
    """(name, file) of a file, or of one of MODELS in the shared data or the samples; the file is None where it is not there."""
    if os.path.exists(name):
        return os.path.splitext(os.path.basename(name))[0], name
    for folder in (SHARED, os.path.join(ROOT, "samples", name)):
        path = os.path.join(folder, MODELS.get(name, name))
        if os.path.exists(path):
            return name, path
    return name, None


class Model:
    def __init__(self, options, name, path, work, known):
        self.options, self.name, self.path, self.work, self.known = options, name, path, work, known
        self.cpu = {}
        self.truth = None
        self.cut_outs = False

    def bake(self, words, pack=None):
        """CPU seconds, the report."""
        pack = pack or os.path.join(self.work, "run.texel")
        report = os.path.join(self.work, "report.json")
        command = [self.options.texel, "bake", self.path, "-o", pack, "-r", str(self.options.resolution), "--want", "density,visibility,levels", "--force", "--report", report] + words
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        said = child.stderr.read()
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode != 0:
            sys.exit(f"{' '.join(command)}: exit status {child.returncode}\n{said.decode(errors='replace')}")
        with open(report, encoding="utf-8") as file:
            return usage.ru_utime + usage.ru_stime, json.load(file)

    def least(self, words):
        """The quickest of some runs: CPU seconds, its report. Short ones are repeated more often, for other work on the machine blurs those."""
        runs = []
        while len(runs) < self.options.repeat or (len(runs) < 4 * self.options.repeat and sum(r[0] for r in runs) < 2):
            runs.append(self.bake(words))
        return min(runs, key=lambda run: run[0])

    def prepare(self):
        """What errors are measured against."""
        pack = os.path.join(self.work, "truth.texel")
        _, report = self.bake(["--samples", "1"], pack)
        info = subprocess.run([self.options.texel, "info", pack, "--json"], capture_output=True, text=True, check=True).stdout
        self.cut_outs = '"coverage"' in info
        if not self.cut_outs:
            self.bake(["--samples", str(self.options.truth_samples)], pack)
        self.truth = self.path if self.cut_outs else pack

    def errors(self):
        """(level 0, the worst of all levels): rms of alpha of the pack just baked, the worst axis."""
        if self.truth is None:
            self.prepare()
        command = [self.options.texel, "compare", os.path.join(self.work, "run.texel"), self.truth, "--json"]
        if self.cut_outs:
            command += ["--voxels", str(self.options.voxels), "--columns", "1"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"{' '.join(command)}: exit status {done.returncode}\n{done.stderr}")
        measures = json.loads(done.stdout)["measures"]
        # Packs are compared without the voxels that are opaque in both; the error asked for is over all border voxels, which is where crossings are known.
        border = {m["level"]: m["of"] for m in measures if m["name"] == "crossings_rms"}
        figures = [(m["level"], m["value"] * (1 if self.cut_outs else (m["of"] / border[m["level"]]) ** 0.5)) for m in measures if m["name"] == "alpha_rms"]
        return max(v for level, v in figures if level == 0), max(v for _, v in figures)

    def fixed_errors(self, samples):
        key = f"{self.name} {self.options.resolution} {samples}"
        if key not in self.known:
            self.bake(["--samples", str(samples)])
            self.known[key] = self.errors()
        return self.known[key]

    def fixed(self, error, which):
        """The fewest rays along a voxel's edge that are right, and their CPU seconds; (None, None) where none are."""
        for samples in SAMPLES:
            if self.fixed_errors(samples)[which] <= error:
                if samples not in self.cpu:
                    self.cpu[samples] = self.least(["--samples", str(samples)])[0]
                return samples, self.cpu[samples]
        return None, None

    def row(self, error):
        row = {"model": self.name, "resolution": self.options.resolution, "asked": error}
        for which, name in ((0, "level_0"), (1, "all_levels")):
            row[name + "_samples"], row[name + "_cpu"] = self.fixed(error, which)
        row["cpu"], report = self.least(["--max-error", str(error)])
        if self.options.check:
            row["is"], row["is_all_levels"] = self.errors()
        counts = report.get("counts", {})
        row["says"] = max(v for k, v in counts.items() if k.startswith("alpha rms error"))
        rays = [v for k, v in counts.items() if k.startswith("rays a column")]
        row["rays"] = sum(rays) / len(rays)
        row["kept"] = not any(i["id"] == "max-error" for i in report.get("issues", []))
        row["stages"] = {t["stage"]: t["cpu_seconds"] for t in report.get("times", [])}
        for name in ("level_0", "all_levels"):
            row[name + "_ratio"] = row["cpu"] / row[name + "_cpu"] if row[name + "_cpu"] else None
        return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("texel", help="the program")
    parser.add_argument("--resolution", type=int, default=128)
    parser.add_argument("--models", default=USUAL, help=f"names or files, by commas; names: {', '.join(MODELS)}")
    parser.add_argument("--errors", default="0.02,0.01,0.005")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each bake; short ones up to four times as many")
    parser.add_argument("--truth-samples", type=int, default=64)
    parser.add_argument("--voxels", type=int, default=3000, help="of each level, where textures cut holes")
    parser.add_argument("--no-check", dest="check", action="store_false", help="times alone: what the asked bake's error is stays unknown")
    parser.add_argument("--json", help="figures into this file, and the fixed bakes' errors from it")
    options = parser.parse_args()
    options.texel = os.path.abspath(options.texel)
    known, rows = {}, []
    if options.json and os.path.exists(options.json):
        with open(options.json, encoding="utf-8") as file:
            known = json.load(file)["fixed_errors"]

    def shown(value, digits="{:.4f}"):
        return "-" if value is None else digits.format(value)

    print("| model | E | says | is | all levels | rays | CPU s | level 0: rays | CPU s | times | all levels: rays | CPU s | times |\n|" + "---|" * 13)
    for name in options.models.split(","):
        name, path = find_model(name)
        if path is None:
            print(f"| {name} | no such file |")
            continue
        with tempfile.TemporaryDirectory(prefix="texel_max_error_") as work:
            model = Model(options, name, path, work, known)
            for error in map(float, options.errors.split(",")):
                r = model.row(error)
                rows.append(r)
                fixed = " | ".join(f"{r[k + '_samples'] or '-'} | {shown(r[k + '_cpu'], '{:.2f}')} | {shown(r[k + '_ratio'], '{:.2f}')}" for k in ("level_0", "all_levels"))
                print(f"| {name} | {error} | {r['says']:.4f}{'' if r['kept'] else ' !'} | {shown(r.get('is'))} | {shown(r.get('is_all_levels'))} | {r['rays']:.1f} | {r['cpu']:.2f} | {fixed} |", flush=True)
        if options.json:
            with open(options.json, "w", encoding="utf-8") as file:
                json.dump({"fixed_errors": known, "rows": rows}, file, indent=1)
    slow = [r for r in rows if r["level_0_ratio"] and r["level_0_ratio"] > 2]
    late = [r for r in rows if r["all_levels_ratio"] and r["all_levels_ratio"] > 2]
    print(f"\nmore than twice the best on level 0: {len(slow)} of {len(rows)}; on all levels: {len(late)}")
    if options.check:
        print(f"beyond E: {sum(max(r['is'], r['is_all_levels']) > r['asked'] for r in rows)}")


if __name__ == "__main__":
    main()
