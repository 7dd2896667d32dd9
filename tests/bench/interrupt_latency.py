#!/usr/bin/env python3
"""Interrupts bakes at random moments and prints how long each took to end: status 4, no pack, nothing left beside it.

  interrupt_latency.py --texel PROGRAM [--moments 30] [--seed 1] -- INPUT [options of texel bake]

Prints a line per moment, then the longest. Time, not a test: a busy machine stretches everything."""
import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time


def bake(program, arguments, folder, wait):
    """(seconds from the signal to the end, status); without a signal, as `wait` is None or the bake was done by then, (seconds in all, 0)."""
    command = [program, "bake", *arguments, "-o", os.path.join(folder, "out", "x.texel"), "--progress", "never"]
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    if wait is not None:
        try:
            process.wait(wait)
        except subprocess.TimeoutExpired:
            start = time.monotonic()
            process.send_signal(signal.SIGINT)
    status = process.wait()
    return time.monotonic() - start, status


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--texel", required=True)
    parser.add_argument("--moments", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("bake", nargs="+")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        whole, status = bake(options.texel, options.bake, folder, None)
        if status != 0:
            sys.exit(f"the bake itself ends with status {status}")
        print(f"whole bake {whole:.2f} s")
    rng = random.Random(options.seed)
    longest = (0, 0)
    for _ in range(options.moments):
        moment = rng.uniform(0.02, whole)
        with tempfile.TemporaryDirectory() as folder:
            seconds, status = bake(options.texel, options.bake, folder, moment)
            left = os.listdir(folder)
            ended_before = status == 0 and left == ["out"] and os.listdir(os.path.join(folder, "out")) == ["x.texel"]
            if not ended_before and (status != 4 or left):
                sys.exit(f"interrupted after {moment:.2f} s: status {status}, left {left}")
        if ended_before:
            print(f"after {moment:6.2f} s: the bake was done")
            continue
        print(f"after {moment:6.2f} s: {seconds:.3f} s", flush=True)
        longest = max(longest, (seconds, moment))
    print(f"longest {longest[0]:.3f} s, interrupted after {longest[1]:.2f} s")


if __name__ == "__main__":
    main()
