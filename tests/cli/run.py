#!/usr/bin/env python3
"""Runs the cases of tests/cli: each is a shell script NAME.sh in cases/, run in a clean folder of its own, and beside it what
is expected: NAME.exit (absent: 0), NAME.out and NAME.err (absent: nothing may be printed).

In .out and .err "*" stands for anything within a line and a line "..." for any number of lines.
Scripts find the program as `texel` on the path, the meshes of tests/cli/data in $DATA and the source folder in $ROOT.

  run.py --texel PROGRAM --work FOLDER [--update] [NAME...]

--update rewrites the expectations that do not hold; look at the difference before you commit it."""
import argparse
import os
import re
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
CASES = os.path.join(HERE, "cases")


def line_matches(pattern, line):
    return re.fullmatch(".*".join(re.escape(part) for part in pattern.split("*")), line) is not None


def matches(expected, got):
    """Whether the lines `got` are what `expected` describes."""
    reach = {0}  # how many lines of `got` the expectation up to here may have used
    for pattern in expected:
        if pattern == "...":
            reach = set(range(min(reach), len(got) + 1)) if reach else set()
        else:
            reach = {at + 1 for at in reach if at < len(got) and line_matches(pattern, got[at])}
    return len(got) in reach


def read_lines(path):
    if not os.path.exists(path):
        return []
    with open(path, encoding="utf-8") as file:
        return file.read().splitlines()


def write_or_remove(path, text):
    if text:
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
    elif os.path.exists(path):
        os.remove(path)


def run_case(name, arguments):
    base = os.path.join(CASES, name)
    folder = os.path.join(arguments.work, name)
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("TEXEL_", "NO_COLOR", "LC_", "LANG"))}
    environment.update(DATA=os.path.join(HERE, "data"), ROOT=ROOT, LC_ALL="C.UTF-8",
                       PATH=os.path.dirname(arguments.texel) + os.pathsep + environment["PATH"])
    done = subprocess.run(["sh", "-u", base + ".sh"], cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True,
                          timeout=120)
    got = {"exit": str(done.returncode)}
    for key, data in (("out", done.stdout), ("err", done.stderr)):
        got[key] = data.decode("utf-8", "replace").replace(environment["DATA"], "$DATA").replace(folder, "$PWD")

    faults = []
    expected = (read_lines(base + ".exit") or ["0"])[0]
    if got["exit"] != expected:
        faults.append(("exit", f"exit status {got['exit']}, expected {expected}"))
    for key in ("out", "err"):
        lines = read_lines(f"{base}.{key}")
        if not matches(lines, got[key].splitlines()):
            faults.append((key, f"--- {key} expected\n" + "\n".join(lines) + f"\n--- {key} got\n" + got[key]))
    if faults and arguments.update:
        for key, _ in faults:
            text = re.sub(r", [0-9.]+ s$", ", * s", got[key], flags=re.MULTILINE)  # durations differ
            write_or_remove(f"{base}.{key}", "" if key == "exit" and got[key] == "0" else text + ("\n" if key == "exit" else ""))
        print(f"{name}: rewritten {', '.join(key for key, _ in faults)}")
        return True
    if faults:
        print(f"{name}: FAILED (left in {folder})\n" + "\n".join(text for _, text in faults))
    else:
        shutil.rmtree(folder)
        print(f"{name}: good")
    return not faults


def self_test():
    """The matcher must be able to fail."""
    assert matches(["a*c", "...", "z"], ["abc", "x", "y", "z"]) and matches(["..."], [])
    assert not matches(["a"], ["a", "b"]) and not matches(["a", "..."], ["b"]) and not matches(["[a]"], ["a"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--texel", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--update", action="store_true")
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    arguments.texel, arguments.work = os.path.abspath(arguments.texel), os.path.abspath(arguments.work)
    self_test()
    names = arguments.names or sorted(name[:-3] for name in os.listdir(CASES) if name.endswith(".sh"))
    results = [run_case(name, arguments) for name in names]
    sys.exit(0 if all(results) else 1)


if __name__ == "__main__":
    main()
