"""What every training run shares: progress, learning rate, log, checkpoints, and the batches."""

import itertools
import json
import os
import time
from functools import lru_cache
from pathlib import Path

import numpy as np
import torch

from . import data, weights
from .place import Place


class Run:
    """Progress, learning rate, log and checkpoints of one training run."""

    def __init__(self, args, kind, nets, rate, others=None):
        """`others`: further optimisers by name, to be kept with the checkpoint. Moves the networks to the device."""
        self.args, self.kind, self.nets, self.rate = args, kind, nets, getattr(args, "rate", None) or rate
        self.place = Place(args)
        for net in nets.values():
            net.to(self.place.device)
        self.out = Path(args.out)
        self.out.mkdir(parents=True, exist_ok=True)
        self.optimiser = torch.optim.AdamW([p for n in nets.values() for p in n.parameters() if p.requires_grad],
                                           lr=rate, betas=(0.9, 0.99), weight_decay=0.01)
        self.others = others or {}
        self.step, self.samples, self.spent, self.means, self.extra = 0, 0, 0.0, {}, {}
        self.worked = -time.process_time()
        self.checkpoint = self.out / f"{kind}.pt"
        if self.checkpoint.exists():
            # Loading copies what it finds to where the networks are: a run goes on wherever it is taken.
            state = torch.load(self.checkpoint, weights_only=True, map_location="cpu")
            for name, net in nets.items():
                net.load_state_dict(state["nets"][name])
            self.optimiser.load_state_dict(state["optimiser"])
            for name, optimiser in self.others.items():
                if name in state.get("others", {}):
                    optimiser.load_state_dict(state["others"][name])
            self.step, self.samples, self.spent = state["step"], state["samples"], state["minutes"]
            self.worked += 60 * state.get("processor_minutes", 0.0)
            self.means, self.extra = state["losses"], state["extra"]
        self.started = self.saved = self.logged = time.monotonic()
        self.begun_at, self.taken = self.samples, 0
        self.at = self.place.same(self.minutes())

    def minutes(self):
        return self.spent + (time.monotonic() - self.started) / 60

    def progress(self):
        """Share of the budget that was spent when the step began."""
        return self.step / self.args.steps if self.args.steps else self.at / self.args.minutes

    def over(self):
        return self.progress() >= 1

    def fallen(self):
        """How far the rate has fallen, 0..1: it does over the last `fall` of the budget, and never where that is 0."""
        share = self.args.fall
        return min(max((self.progress() - 1 + share) / share, 0), 1) if share else 0.0

    def learning_rate(self):
        """Warm-up, then constant, then a cosine fall."""
        fall = self.fallen()
        return float(self.rate * min(1, (self.step + 1) / 100) * (0.02 + 0.98 * (1 + np.cos(np.pi * fall)) / 2))

    def descend(self, loss, count, figures):
        """The gradient of one part's loss; with that of the last part, a step. True where there was one."""
        parameters = self.optimiser.param_groups[0]["params"]
        if self.taken == 0:
            self.optimiser.zero_grad()
        (loss / len(self.place.own) if len(self.place.own) > 1 else loss).backward()
        if not self.part_is_done(count):
            return False
        rate = self.learning_rate()
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        self.place.average(parameters)
        torch.nn.utils.clip_grad_norm_(parameters, 1.0)
        self.optimiser.step()
        self.step_is_done()
        for key, value in ((k, float(v.detach())) for k, v in figures.items()):
            self.means[key] = 0.98 * self.means.get(key, value) + 0.02 * value
        now = time.monotonic()
        if now - self.logged > 20:
            self.logged = now
            text = " ".join(f"{k} {v:.5f}" for k, v in self.means.items())
            line = f"{self.minutes():.2f} min step {self.step} samples {self.samples} lr {rate:.2e} {text} {self.pace()}"
            if self.place.first():
                with (self.out / f"{self.kind}.log").open("a") as log:
                    log.write(f"{line}\n")
        if now - self.saved > 120:
            self.save()
        return True

    def part_is_done(self, count):
        """Counts a part's samples; true where it was the step's last of this process."""
        self.taken += 1
        self.samples += count * self.place.processes
        return self.taken == len(self.place.own)

    def step_is_done(self):
        self.taken, self.step = 0, self.step + 1
        self.at = self.place.same(self.minutes())

    def pass_over(self):
        """A part without a sample that can be learnt from."""
        if self.place.parts > 1:
            raise SystemExit(f"step {self.step} has a part without a sample to learn from: train without --parts and torchrun")
        self.step_is_done()

    def pace(self):
        seconds = time.monotonic() - self.started
        return f"{(self.samples - self.begun_at) / max(seconds, 1e-9):.1f} samples/s"

    def end(self):
        """Keeps the last state and says how fast it went."""
        self.save()
        if self.place.first():
            print(f"{self.kind}: {self.samples} samples, {self.pace()} on {self.place}", flush=True)

    def save(self):
        self.saved = time.monotonic()
        if not self.place.first():
            return
        state = {"nets": {k: n.state_dict() for k, n in self.nets.items()}, "optimiser": self.optimiser.state_dict(),
                 "others": {k: o.state_dict() for k, o in self.others.items()},
                 "step": self.step, "samples": self.samples, "minutes": self.minutes(),
                 "processor_minutes": (self.worked + time.process_time()) / 60, "extra": on_the_processor(self.extra),
                 "losses": self.means, "seed": self.args.seed, "options": options(self.args)}
        partial = self.checkpoint.with_suffix(".partial")
        torch.save(state, partial)
        os.replace(partial, self.checkpoint)
        facts = {k: state[k] for k in ("step", "samples", "minutes", "processor_minutes", "losses", "seed", "options")}
        (self.out / f"{self.kind}.json").write_text(json.dumps(facts, indent=1))


def on_the_processor(extra):
    return {k: v.cpu() if isinstance(v, torch.Tensor) else v for k, v in extra.items()}


def options(args):
    """The switches that make one run differ from another, for the checkpoint and the provenance."""
    keys = ("turned", "rotation", "flip", "geometry", "frame", "condition_noise", "rate", "fall")
    return {k: getattr(args, k) for k in keys} | {"begun_from_a_bundle": bool(args.start)}


@lru_cache(maxsize=2)
def order(seed, turn, total):
    """The samples in the order of pass `turn`."""
    return np.random.default_rng((seed, turn)).permutation(total)


def numbers(seed, first, count, total):
    """Samples `first` to `first + count` of the endless list of passes that `seed` draws from `total` samples."""
    return np.array([order(seed, at // total, total)[at % total] for at in range(first, first + count)])


class Parts(torch.utils.data.Dataset):
    """What is learnt from in each part of each step, as a list without an end: part `i % parts` of step `i // parts`.

    All of it is a function of seed, step and part alone: every method is given the same samples in the same order, and a run
    that was stopped goes on as if it had not been.
    """

    def __init__(self, shards, args, size, parts, prepare):
        self.shards, self.args, self.size, self.parts, self.prepare = shards, args, size, parts, prepare

    def __getitem__(self, index):
        shards, size, seed = self.shards, self.size, self.args.seed
        if len(shards) < size:
            raise SystemExit(f"{shards.folder} holds {len(shards)} samples, fewer than one batch of {size}")
        step, part = divmod(index, self.parts)
        batch = np.sort(numbers(seed, index * size, size, len(shards)))
        rng = np.random.default_rng((seed, step, size, part) if part else (seed, step, size))
        # What the network itself draws begins at the same place too.
        return index, seed * 1_000_003 + step + part * 500_009, self.prepare(shards, batch, self.args, rng)

    def ends_a_pass(self, index):
        return (index + 1) * self.size % len(self.shards) < self.size


def batches(shards, run, size, prepare):
    """What `prepare(shards, numbers, args, rng)` makes of each of this process's parts, on the device, until the budget is
    spent. New shards are looked for after each pass, unless workers prepare the batches."""
    parts, own = Parts(shards, run.args, size, run.place.parts, prepare), run.place.own
    order_of_parts = (step * len(own) * run.place.processes + part for step in itertools.count(run.step) for part in own)
    if run.args.workers:
        ready = iter(torch.utils.data.DataLoader(parts, batch_size=None, sampler=order_of_parts, num_workers=run.args.workers,
                                                 collate_fn=lambda part: part, pin_memory=run.place.device.type == "cuda"))
    else:
        ready = (parts[index] for index in order_of_parts)
    while not run.over():
        index, seed, batch = next(ready)
        torch.manual_seed(seed)
        yield run.place.moved(batch)
        if not run.args.workers and parts.ends_a_pass(index):
            shards.refresh()


def symmetries(args, rng, count):
    """A symmetry for each of `count` pairs: plain, or one of the turns and mirrorings that the switches allow."""
    allowed = [k for k in range(1, 8) if (args.rotation or k % 4 == 0) and (args.flip or k < 4)]
    if not allowed:
        return np.zeros(count, int)
    return np.where(rng.random(count) < args.turned, rng.choice(allowed, size=count), 0)


def condition(shards, batch, k, args, rng):
    """Augmented, standardised GelSlim images (N,3,128,128), channels last, turned by `k`."""
    gelslim = shards.gelslim(batch)
    if args.geometry == "padding":
        gelslim = data.padded(gelslim)
    gelslim = data.augment_gelslim(data.each_dihedral(gelslim, k), torch.from_numpy(shards.meta[batch, 6] == 0), rng)
    if args.condition_noise:
        gelslim = gelslim + args.condition_noise * torch.from_numpy(rng.standard_normal(gelslim.shape, dtype=np.float32))
    return gelslim.contiguous(memory_format=torch.channels_last)


# Real imprints lie this far (deviation, pixels of the raw bubble image: a millimetre) from where the GelSlim image says: the
# two sensors touch the tool in two grasps. Whoever draws a sharp edge in a place that is not sure pays for it twice.
PLACEMENT_PX = 2.3


def offsets(shards, batch, args):
    """How far the imprints are moved into the frame of the generator's picture; `None` where they stay.

    Those of drawn sensors are also misplaced, each sample always by the same; the nominal sensors are exact.
    """
    if args.frame != "window":
        return None
    drawn = np.stack([np.random.default_rng((args.seed, int(i))).standard_normal(2) for i in batch]).astype(np.float32)
    drawn[shards.meta[batch, 6] == 1] = 0
    return shards.offsets(batch) + PLACEMENT_PX * torch.from_numpy(drawn)


def target(shards, key, batch, k, args):
    """Imprints (N,1,128,128) in [-1,1], turned by `k`."""
    image = data.to_model(shards.metres(key, batch), offsets(shards, batch, args))
    if args.geometry == "cropping":
        image = data.cropped(image)
    return data.each_dihedral(image, k).contiguous(memory_format=torch.channels_last)


def start(net, args, role, prefix=""):
    """Fills `net` from the bundle of `--from`, if one was given; returns what else that graph holds."""
    return weights.load(net, Path(args.start) / f"{role}.onnx", prefix) if args.start else {}


def edges(x, y):
    """Mean absolute difference of the two images' gradients."""
    d = x - y
    return d.diff(dim=2).abs().mean() + d.diff(dim=3).abs().mean()
