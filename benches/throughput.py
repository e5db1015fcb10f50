"""Pairs per second of one core: reading, pose of the measured imprint, prediction, all of it; and what the lab's 32,256 pairs cost.

`python -m benches.throughput [--pairs N] [--out DIR] [--program PROGRAM] [--json FILE]` with the package installed; the program
simulates the data set in the lab's format. One thread; a pair is both fingers; nothing is kept between runs. Two cores take half
of what one takes where the work is by pairs; figures of other machines are divisions, and called estimates.
"""

import argparse
import json
import os
import subprocess
import time
from pathlib import Path

os.environ.setdefault("RAYON_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import touch2touch as t2t  # noqa: E402  (threads are chosen before it is loaded)

from .program import machine  # noqa: E402

# Pairs of the lab's data set.
LAB = 32_256


def folder(args):
    """A data set in the lab's format."""
    out = Path(args.out) / f"lab_{args.pairs}"
    if not out.exists():
        tools = "pattern_31_rod,pattern_35,pattern_36,pattern_05_3_lines_angle_2"
        subprocess.run([args.program, "simulate", "--out", out, "--tools", tools, "--grasps", str(args.pairs // 4), "--seed", "3"],
                       check=True, capture_output=True)
    return out


def rates(data):
    """Seconds a pair takes, by what is done with it."""
    names, measured, predicted = data.names, t2t.Recipe(), t2t.Recipe("predicted")
    ways = {
        "reading": lambda pair: None,
        "pose of the measured imprint": lambda pair: t2t.feel(pair, measured),
        "prediction": lambda pair: t2t.feel(pair, predicted, stage="imprint"),
        "prediction, its pose": lambda pair: t2t.feel(pair, predicted),
    }
    found = {}
    for name, way in ways.items():
        way(data[0])
        begun = time.perf_counter()
        for pair in names:
            way(data[pair])
        found[name] = (time.perf_counter() - begun) / len(names)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=48)
    parser.add_argument("--out", default="target/throughput")
    parser.add_argument("--program", default="target/release/touch2touch")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    found = rates(t2t.open(folder(args)))
    answer = {"machine": machine(), "pairs": args.pairs, "seconds_a_pair": found,
              "hours_for_the_lab": {name: {cores: LAB * s / cores / 3600 for cores in (1, 2, 64)} for name, s in found.items()}}
    print(answer["machine"])
    for name, seconds in found.items():
        hours = answer["hours_for_the_lab"][name]
        print(f"{name:30} {1 / seconds:7.1f} pairs/s and core; {LAB} pairs: {hours[2]:6.2f} h on two cores, {60 * hours[64]:6.1f} min on 64 (estimate)")
    if args.json:
        args.json.write_text(json.dumps(answer, indent=1))


if __name__ == "__main__":
    main()
