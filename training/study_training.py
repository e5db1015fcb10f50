"""The networks of the study: trained to a number of samples, then exported.

Budgets share their training. The learning rate stays (warm-up, then constant) along one run, and falls over the last
fifth of each budget on a branch of it: for N samples the first 0.8 N are the run's and the rest the branch's. A checkpoint
is the same to the last bit whether or not its run was stopped, and whatever else branches off.
"""

import json
import os
import shutil
from pathlib import Path

from . import export, train
from .study_runs import AUTOENCODER, METHODS

BATCH, AUTOENCODER_BATCH = 16, 8
# Last share of a budget, over which the learning rate falls.
FALL = 0.2
# Share of the pairs turned or mirrored: the program lays pairs upright before it predicts.
TURNED = 0.2


def step_of(folder, kind):
    facts = folder / f"{kind}.json"
    return json.loads(facts.read_text())["step"] if facts.exists() else 0


def train_to(kind, training, shards, folder, steps, fall, seed):
    """Trains, or goes on, until `steps` steps are done."""
    if step_of(folder, kind) >= steps:
        return
    words = [kind, "--data", str(shards), "--out", str(folder), "--steps", str(steps), "--fall", str(fall), "--seed", str(seed),
             "--turned", str(TURNED), "--geometry", training.geometry,
             "--batch", str(AUTOENCODER_BATCH if kind == "autoencoder" else BATCH)]
    words += ([] if training.rotation else ["--no-rotation"]) + ([] if training.flip else ["--no-flip"])
    train.run(words)


def branch_off(kind, trunk, branch):
    """Copies the run's checkpoint; whole, or not at all."""
    branch.mkdir(parents=True, exist_ok=True)
    for name in (f"{kind}.pt", f"{kind}.json"):
        partial = branch / f"{name}.partial"
        shutil.copyfile(trunk / name, partial)
        os.replace(partial, branch / name)


def trained(training, samples, shards, runs, seed):
    """The folder of the checkpoints of a training after `samples` samples."""
    kind, trunk = METHODS[training.method], runs / training.name()
    branch = trunk / str(samples)
    branch.mkdir(parents=True, exist_ok=True)
    if kind == "generator":
        # Turns and mirrorings are none of its switches: it always draws from all eight.
        known = runs / f"autoencoder_{training.condition}_{training.geometry}"
        train_to("autoencoder", training, shards, known, AUTOENCODER // AUTOENCODER_BATCH, FALL, seed)
        for folder in (branch, trunk / "held"):
            folder.mkdir(exist_ok=True)
            for name in ("autoencoder.pt", "autoencoder.json"):
                if not (folder / name).exists():
                    (folder / name).symlink_to(Path("../..") / known.name / name)
        samples -= AUTOENCODER
    steps = samples // BATCH
    held = round((1 - FALL) * steps)
    if step_of(branch, kind) < held:
        # A run that is past this branch is no use to it: the branch then begins at the start, with the same outcome.
        past = step_of(trunk / "held", kind) > held
        train_to(kind, training, shards, branch if past else trunk / "held", held, 0.0, seed)
        if not past:
            branch_off(kind, trunk / "held", branch)
    train_to(kind, training, shards, branch, steps, FALL, seed)
    return branch


def exported(training, samples, shards, runs, seed):
    """The bundle of a training after `samples` samples, and what it cost."""
    folder = trained(training, samples, shards, runs, seed)
    kind, bundle = METHODS[training.method], folder / "bundle"
    if not (bundle / "manifest.json").exists():
        words = [kind, "--run", str(folder), "--data", str(shards), "--out", str(bundle), "--note", "a run of the study"]
        export.bundle(export.parser().parse_args(words + (["--steps", "2", "--sampler", "ddpm"] if kind == "generator" else [])))
    return bundle, cost(folder, bundle, kind)


def cost(folder, bundle, kind):
    """Samples and seconds of each network, on the run and on the branch, and the last losses."""
    found = {}
    for name in ("autoencoder", kind) if kind == "generator" else (kind,):
        facts = json.loads((folder / f"{name}.json").read_text())
        found[name] = {"samples": facts["samples"], "seconds": round(60 * facts["minutes"]),
                       "processor_seconds": round(60 * facts["processor_minutes"]),
                       "losses": {k: round(v, 5) for k, v in facts["losses"].items()}}
    size = sum(f.stat().st_size for f in bundle.glob("*.onnx"))
    return {"networks": found, "samples": sum(n["samples"] for n in found.values()), "bundle_bytes": size}
