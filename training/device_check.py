"""Command line: `python -m training.device_check`.

Trains on a few random samples: two processes must do the steps of one that takes both parts, data read for each batch must change
nothing, and a run must go on to the same weights in another number of processes. Says what it found; an AssertionError is a failure.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import torch

from .study_check import random_shards


def train(kind, data, out, steps, *options, processes=1):
    """Trains and returns the weights of all networks, flat."""
    begin = [sys.executable, "-m"]
    if processes > 1:
        begin += ["torch.distributed.run", "--standalone", f"--nproc-per-node={processes}", "-m"]
    words = ["training.train", kind, "--data", data, "--out", out, "--steps", steps, "--device", "cpu", *options]
    subprocess.run([*begin, *map(str, words)], check=True, cwd=Path(__file__).parent.parent)
    nets = torch.load(out / f"{kind}.pt", weights_only=True)["nets"]
    return torch.cat([v.flatten().float() for net in nets.values() for v in net.values()])


def apart(a, b):
    return float((a - b).norm() / a.norm())


def main():
    with tempfile.TemporaryDirectory() as place:
        place = Path(place)
        data = place / "data"
        random_shards(data)
        start = train("l1unet", data, place / "start", 1, "--parts", 2)
        alone = train("l1unet", data, place / "alone", 4, "--parts", 2)
        moved = apart(start, alone)
        assert moved > 1e-4, f"three steps changed next to nothing: {moved:.1e}"
        for name, difference in {
            "two processes": apart(alone, train("l1unet", data, place / "two", 4, processes=2)),
            "data not kept": apart(alone, train("l1unet", data, place / "read", 4, "--parts", 2, "--resident", "no")),
            "two processes from there": apart(alone, train("l1unet", data, place / "start", 4, processes=2)),
        }.items():
            print(f"{name}: weights differ by {difference:.1e} of their size, where three steps change them by {moved:.1e}")
            assert difference < 1e-3 * moved, name
        half = train("l1unet", data, place / "half", 4, "--parts", 2, "--precision", "bfloat16")
        print(f"bfloat16: {apart(alone, half):.1e}")
        assert apart(alone, half) < moved, "bfloat16"


if __name__ == "__main__":
    main()
