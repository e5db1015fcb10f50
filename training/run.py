"""What every training run shares: progress, learning rate, averages of weights, log and checkpoints."""

import copy
import json
import math
import os
import time
from pathlib import Path

import torch

from . import weights
from .place import Place

# Averages of weights forget with this share in a step; less at first.
DECAY = 0.998


class Run:
    """Progress, learning rate, averages, log and checkpoints of one training run."""

    def __init__(self, args, kind, nets, small, large, averaged=(), others=None):
        """Moves the networks to the device. `small`, `large`: batch and learning rate of a processor and of a GPU.

        `averaged`: networks whose weights are also averaged, as NAME_ema. `others`: further optimisers by name, to be kept with
        the checkpoint.
        """
        self.args, self.kind, self.nets, self.averaged, self.others = args, kind, nets, averaged, others or {}
        self.place = Place(args)
        self.batch = args.batch or (small if self.place.device.type == "cpu" else large)[0]
        self.rate = args.rate or rate_for(self.batch, small, large)
        for net in nets.values():
            net.to(self.place.device, memory_format=torch.channels_last)
        for name in averaged:
            nets[f"{name}_ema"] = copy.deepcopy(nets[name]).requires_grad_(False)
        self.out = Path(args.out)
        self.out.mkdir(parents=True, exist_ok=True)
        self.optimiser = torch.optim.AdamW([p for n in nets.values() for p in n.parameters() if p.requires_grad],
                                           lr=self.rate, betas=(0.9, 0.99), weight_decay=0.01, fused=True)
        self.step, self.samples, self.spent, self.names, self.means, self.extra = 0, 0, 0.0, [], None, {}
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
            self.names, self.extra = list(state["losses"]), state["extra"]
            self.means = torch.tensor(list(state["losses"].values()), device=self.place.device)
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
        return self.rate * min(1, (self.step + 1) / 100) * (0.02 + 0.98 * (1 + math.cos(math.pi * self.fallen())) / 2)

    def descend(self, loss, count, figures):
        """The gradient of one part's loss; with that of the last part, a step. True where there was one."""
        parameters = self.optimiser.param_groups[0]["params"]
        if self.taken == 0:
            self.optimiser.zero_grad()
        (loss / len(self.place.own)).backward()
        self.taken += 1
        self.samples += count * self.place.processes
        if self.taken < len(self.place.own):
            return False
        rate = self.optimiser.param_groups[0]["lr"] = self.learning_rate()
        self.place.average(parameters)
        torch.nn.utils.clip_grad_norm_(parameters, 1.0)
        self.optimiser.step()
        self.taken, self.step = 0, self.step + 1
        decay = min(DECAY, (1 + self.step) / (20 + self.step))
        for name in self.averaged:
            torch._foreach_lerp_(*(list(self.nets[n].parameters()) for n in (f"{name}_ema", name)), 1 - decay)
        # They stay on the device: to ask for a figure is to wait for the step.
        self.names, figures = list(figures), torch.stack([v.detach().float() for v in figures.values()])
        self.means = figures if self.means is None else torch.lerp(self.means, figures, 0.02)
        now = time.monotonic()
        if now - self.logged > 20:
            self.logged = now
            text = " ".join(f"{k} {v:.5f}" for k, v in self.losses().items())
            line = f"{self.minutes():.2f} min step {self.step} samples {self.samples} lr {rate:.2e} {text} {self.pace()}"
            if self.place.first():
                with (self.out / f"{self.kind}.log").open("a") as log:
                    log.write(f"{line}\n")
        if now - self.saved > 120:
            self.save()
        self.at = self.place.same(self.minutes())
        return True

    def losses(self):
        """Running means of the figures."""
        found = dict(zip(self.names, self.means.tolist())) if self.names else {}
        if not all(map(math.isfinite, found.values())):
            raise SystemExit(f"{self.kind}: step {self.step} is no number any more: {found}; lower --rate, and go on from {self.checkpoint}")
        return found

    def pace(self):
        seconds = time.monotonic() - self.started
        return f"{(self.samples - self.begun_at) / max(seconds, 1e-9):.1f} samples/s"

    def end(self):
        """Keeps the last state and says how fast it went."""
        self.save()
        if self.place.first():
            print(f"{self.kind}: {self.samples} samples, {self.pace()} on {self.place}", flush=True)

    def save(self):
        losses = self.losses()
        self.saved = time.monotonic()
        if not self.place.first():
            return
        extra = {k: v.cpu() if isinstance(v, torch.Tensor) else v for k, v in self.extra.items()}
        state = {"nets": {k: n.state_dict() for k, n in self.nets.items()}, "optimiser": self.optimiser.state_dict(),
                 "others": {k: o.state_dict() for k, o in self.others.items()},
                 "step": self.step, "samples": self.samples, "minutes": self.minutes(),
                 "processor_minutes": (self.worked + time.process_time()) / 60, "extra": extra,
                 "losses": losses, "seed": self.args.seed, "options": options(self)}
        partial = self.checkpoint.with_suffix(".partial")
        torch.save(state, partial)
        os.replace(partial, self.checkpoint)
        facts = {k: state[k] for k in ("step", "samples", "minutes", "processor_minutes", "losses", "seed", "options")}
        (self.out / f"{self.kind}.json").write_text(json.dumps(facts, indent=1))


def rate_for(batch, small, large):
    """The learning rate of a batch between a small and a large one, or beyond them, whose rates are known."""
    share = math.log(batch / small[0]) / math.log(large[0] / small[0])
    return small[1] * (large[1] / small[1]) ** min(max(share, 0), 1)


def options(run):
    """The switches that make one run differ from another, for the checkpoint and the provenance."""
    keys = ("turned", "rotation", "flip", "geometry", "frame", "condition_noise", "fall")
    return {k: getattr(run.args, k) for k in keys} | {
        "batch": run.batch, "rate": run.rate, "begun_from_a_bundle": bool(run.args.start)}


def start(net, args, role, prefix=""):
    """Fills `net` from the bundle of `--from`, if one was given; returns what else that graph holds."""
    return weights.load(net, Path(args.start) / f"{role}.onnx", prefix) if args.start else {}


def edges(x, y):
    """Mean absolute difference of the two images' gradients."""
    d = x - y
    return d.diff(dim=2).abs().mean() + d.diff(dim=3).abs().mean()
