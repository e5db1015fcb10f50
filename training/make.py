"""Command line: `python -m training.make --minutes M | --hours H [--device cuda] [--from BUNDLES] [--out DIR]`.

Writes shards, trains autoencoder, generator (then as it is used), mask model and tool classifier, exports their bundles to
OUT/bundles and scores them on held-out grasps, all within the given time. On a GPU the shards are written beside the training by
the other cores; on a processor first. Stopped, the same command goes on from its checkpoints.
"""

import argparse
import json
import os
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import torch

from . import data, evaluate, export, train
from .place import device_called, keep_freed_memory

# Shares of the time by stage; what is left is for exports and scores. Writing takes time of its own on a processor alone.
SHARES = {"autoencoder": 0.15, "generator": 0.45, "sampler": 0.2, "mask": 0.11, "classifier": 0.03}
WRITING = 0.06
# Minutes that exports and scores take, however little there is.
AFTER = 0.5
# Shards by folder: mix, seed, and how many there are at most. They are begun in proportion.
MIXES = {"train": ("train", 1, 800), "depths": ("depths", 1, 200), "tools": ("seen", 500, 60), "tools_unseen": ("unseen", 501, 20)}
HELD_OUT = {"seen": ("seen", 900, 1), "unseen": ("unseen", 901, 1)}
# Grasps of a shard, and touches to wait for before the first stage begins.
PER_SHARD, ENOUGH = 50, 600
# What a stage learns from, and the bundles: name, a graph of it, and how it is exported.
FOLDERS = {"mask": ("train", "depths"), "classifier": ("tools", "tools_unseen")}
BUNDLES = {"generator": ("generator_ldm", "condition_encoder.onnx", "--steps", 2, "--sampler", "ddpm"),
           "mask": ("mask_unet", "mask_unet.onnx"), "classifier": ("tool_classifier", "tool_classifier.onnx")}


class Writers:
    """Threads that each have the program write one shard after the other; those that are there are not written again."""

    def __init__(self, program, folder, count):
        self.program, self.folder = program, folder
        self.running, self.failed, self.stopped = set(), "", False
        shards = [(k / total, name, mix, seed, f"{k + 1}/{total}") for name, (mix, seed, total) in (HELD_OUT | MIXES).items()
                  for k in range(total)]
        self.shards, self.lock = iter(sorted(shards)), threading.Lock()
        for _ in range(count):
            threading.Thread(target=self._write, daemon=True).start()

    def _write(self):
        while True:
            with self.lock:
                _, name, mix, seed, share = shard = next(self.shards, (None,) * 5)
                if self.stopped or self.failed or shard[0] is None:
                    return
                grasps = PER_SHARD * int(share.partition("/")[2])
                words = ["training-data", "simulator", "--mix", mix, "--seed", seed, "--grasps", grasps, "--per-shard", PER_SHARD,
                         "--shard", share, "--out", self.folder / name]
                process = subprocess.Popen([self.program, *map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                           text=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
                self.running.add(process)
            said = process.communicate()[1]
            self.running.discard(process)
            if process.returncode and not self.stopped:
                self.failed = said.strip()[-600:] or f"{self.program} ended with {process.returncode}"

    def touches(self, name):
        return sum(json.loads(done.read_text())["samples"] for done in (self.folder / name).glob("*/done.json"))

    def wait(self, until):
        """Waits for the first touches of every kind, and until a time."""
        while time.monotonic() < until or self.touches("train") < ENOUGH or not all(map(self.touches, HELD_OUT | MIXES)):
            if self.failed:
                raise SystemExit(f"no shards can be written: {self.failed}")
            if time.monotonic() < until and not self.running and self.touches("train") >= ENOUGH:
                return
            time.sleep(0.2)

    def stop(self):
        with self.lock:
            self.stopped = True
        for process in list(self.running):
            process.terminate()


def facts(run, stage):
    path = run / f"{stage}.json"
    return json.loads(path.read_text()) if path.exists() else {"minutes": 0.0, "samples": 0, "losses": {}}


def begun_from(args, what):
    """The options that begin a stage from the bundle of `--from`, where there is one for it."""
    name, graph = BUNDLES[what][:2]
    found = [folder for folder in (args.start, args.start / name) if (folder / graph).exists()] if args.start else []
    return ["--from", found[0]] if found else []


def made(args, stage, minutes):
    """Trains a stage until `minutes` were spent on it, earlier starts counted in; exports the bundle that it ends."""
    run, bundles = args.out / "runs", args.out / "bundles"
    folders = [args.out / "data" / name for name in FOLDERS.get(stage, ("train",))]
    what = stage if stage in BUNDLES else "generator"
    words = [stage, "--data", *folders, "--out", run, "--minutes", minutes, "--device", args.device, "--seed", args.seed]
    words += begun_from(args, what) if stage != "sampler" else []
    words += ["--turned", 0.2] if stage in ("generator", "sampler") else []
    if stage == "mask":
        # Predicting takes a processor a fifth of the stage's time at most.
        count = min(2000, int(240 * minutes) + 8) if args.device == "cpu" else 2000
        words += ["--predicted-by", bundles / "generator_ldm", "--predicted", count]
    if facts(run, stage)["minutes"] < minutes:
        train.run(words)
    if stage in ("sampler", "mask", "classifier"):
        name, _, *options = BUNDLES[what]
        export.bundle(export.parser().parse_args([str(word) for word in (
            what, "--run", run, "--data", *folders, "--fp16", "--out", bundles / name, *options)]))


def scores(out):
    """Figures of the bundles on the held-out shards, in lines."""
    bundles = {name: evaluate.Bundle(out / "bundles" / name) for name, *_ in BUNDLES.values()}
    for name in HELD_OUT:
        shards, place = data.Shards(out / "data" / name), out / "scores"
        place.mkdir(exist_ok=True)
        found = evaluate.shards_figures(name, bundles["generator_ldm"], bundles["mask_unet"], shards, 48, place)
        chosen = np.arange(0, len(shards), max(1, len(shards) // 48))
        image = data.to_model(shards.metres("imprint", chosen))
        named = bundles["tool_classifier"].run("tool_classifier", image).argmax(dim=1).numpy() == shards.meta[chosen, 5]
        yield (f"{name} tools, held out: {found['clean']['psnr_db']:.1f} dB to the noise-free imprint ({found['clean']['l1_mm']:.2f} mm), "
               f"mask IoU {found['mask_iou']['measured']:.3f} measured, {found['mask_iou']['predicted']:.3f} predicted, "
               f"{named.mean():.0%} of the tools named")


def parser():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    time_given = parser.add_mutually_exclusive_group(required=True)
    time_given.add_argument("--minutes", type=float, help="all that it may take")
    time_given.add_argument("--hours", type=float)
    parser.add_argument("--device", choices=("auto", "cpu", "cuda", "mps"), default="auto")
    parser.add_argument("--from", dest="start", type=Path,
                        help="generator bundle, or a folder of bundles such as assets/models, to begin with")
    parser.add_argument("--out", type=Path, default=Path("training/runs/made"))
    parser.add_argument("--bench", default="target/release/touch2touch-bench", help="the program that writes the shards")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="threads of a training on the processor")
    parser.add_argument("--seed", type=int, default=1)
    return parser


def main():
    begun, args = time.monotonic(), parser().parse_args()
    minutes, args.device = args.minutes or 60 * args.hours, device_called(args.device)
    cores, on_processor = os.cpu_count(), args.device == "cpu"
    keep_freed_memory()
    torch.set_num_threads(args.threads if on_processor else 1)
    kept = args.out / "make.json"
    spent = json.loads(kept.read_text()) if kept.exists() else {"writing": 0.0}
    writers = Writers(args.bench, args.out / "data", cores if on_processor else max(1, cores - 1))
    try:
        writers.wait(begun + 60 * (WRITING * minutes - spent["writing"]) if on_processor else begun)
        if on_processor:
            writers.stop()
        spent["writing"] += (time.monotonic() - begun) / 60
        kept.write_text(json.dumps(spent))
        for stage, share in SHARES.items():
            made(args, stage, share * max(minutes - spent["writing"] - AFTER, 0.1))
    finally:
        writers.stop()
    lines = list(scores(args.out))
    print(f"{'':12} {'minutes':>8} {'share':>6} {'samples':>10}  last losses")
    print(f"{'writing':12} {spent['writing']:8.1f} {spent['writing'] / minutes:6.0%} {writers.touches('train'):10}  (touches of train)")
    for stage in SHARES:
        f = facts(args.out / "runs", stage)
        losses = ", ".join(f"{name} {value:.4g}" for name, value in f["losses"].items())
        print(f"{stage:12} {f['minutes']:8.1f} {f['minutes'] / minutes:6.0%} {f['samples']:10}  {losses}")
    print(*lines, f"bundles: {args.out / 'bundles'}; this start took {(time.monotonic() - begun) / 60:.1f} minutes", sep="\n")


if __name__ == "__main__":
    main()
