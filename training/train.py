"""Command line: `python -m training.train {autoencoder|generator|mask} --data DIR --out DIR --minutes M`.

Each command stops after the given minutes (or `--steps`), writes `checkpoint.pt` every two minutes and goes on from
it when started again with the same folder. One thread by default, bfloat16 autocast (`--threads`, `--f32`).
"""

import argparse
import copy
import json
import os
import time
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

from . import data, diffusion, models


class Run:
    """Progress, learning rate, log and checkpoints of one training run."""

    def __init__(self, args, kind, nets, rate):
        self.args, self.kind, self.nets, self.rate = args, kind, nets, rate
        self.out = Path(args.out)
        self.out.mkdir(parents=True, exist_ok=True)
        self.optimiser = torch.optim.AdamW([p for n in nets.values() for p in n.parameters() if p.requires_grad],
                                           lr=rate, betas=(0.9, 0.99), weight_decay=0.01)
        self.step, self.samples, self.spent, self.means, self.extra = 0, 0, 0.0, {}, {}
        self.checkpoint = self.out / f"{kind}.pt"
        if self.checkpoint.exists():
            state = torch.load(self.checkpoint, weights_only=True)
            for name, net in nets.items():
                net.load_state_dict(state["nets"][name])
            self.optimiser.load_state_dict(state["optimiser"])
            self.step, self.samples, self.spent = state["step"], state["samples"], state["minutes"]
            self.extra = state["extra"]
        self.started = self.saved = self.logged = time.monotonic()

    def minutes(self):
        return self.spent + (time.monotonic() - self.started) / 60

    def progress(self):
        if self.args.steps:
            return self.step / self.args.steps
        return self.minutes() / self.args.minutes

    def descend(self, loss, count, figures):
        """One optimiser step; warm-up, then constant, then a cosine fall over the last 60 percent."""
        p = self.progress()
        fall = min(max((p - 0.4) / 0.6, 0), 1)
        lr = float(self.rate * min(1, (self.step + 1) / 100) * (0.02 + 0.98 * (1 + np.cos(np.pi * fall)) / 2))
        for group in self.optimiser.param_groups:
            group["lr"] = lr
        self.optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.optimiser.param_groups[0]["params"], 1.0)
        self.optimiser.step()
        self.step += 1
        self.samples += count
        for key, value in ((k, float(v.detach())) for k, v in figures.items()):
            self.means[key] = 0.98 * self.means.get(key, value) + 0.02 * value
        now = time.monotonic()
        if now - self.logged > 20:
            self.logged = now
            text = " ".join(f"{k} {v:.5f}" for k, v in self.means.items())
            with (self.out / f"{self.kind}.log").open("a") as log:
                log.write(f"{self.minutes():.2f} min step {self.step} samples {self.samples} lr {lr:.2e} {text}\n")
        if now - self.saved > 120:
            self.save()

    def save(self):
        self.saved = time.monotonic()
        state = {"nets": {k: n.state_dict() for k, n in self.nets.items()}, "optimiser": self.optimiser.state_dict(),
                 "step": self.step, "samples": self.samples, "minutes": self.minutes(), "extra": self.extra,
                 "losses": self.means, "seed": self.args.seed}
        partial = self.checkpoint.with_suffix(".partial")
        torch.save(state, partial)
        os.replace(partial, self.checkpoint)
        facts = {k: state[k] for k in ("step", "samples", "minutes", "losses", "seed")}
        (self.out / f"{self.kind}.json").write_text(json.dumps(facts, indent=1))


def indices(shards, rng, batch):
    """Endless batches of sample numbers; looks for new shards after each pass."""
    while True:
        order = rng.permutation(len(shards))
        for i in range(0, len(order) - batch + 1, batch):
            yield np.sort(order[i:i + batch])
        shards.refresh()


def edges(x, y):
    """Mean absolute difference of the two images' gradients."""
    d = x - y
    return d.diff(dim=2).abs().mean() + d.diff(dim=3).abs().mean()


def autoencoder(args):
    shards, rng = data.Shards(args.data), np.random.default_rng(args.seed)
    net = models.Autoencoder()
    run = Run(args, "autoencoder", {"autoencoder": net}, 1.5e-3)
    for batch in indices(shards, rng, 8):
        if run.progress() >= 1:
            break
        k = int(rng.integers(8))
        clean = data.dihedral(data.to_model(shards.metres("clean", batch)), k)
        image = clean
        if rng.random() < 0.5:
            image = data.dihedral(data.to_model(shards.metres("imprint", batch)), k)
        with torch.autocast("cpu", torch.bfloat16, enabled=not args.f32):
            mean, log_var = net.encode(image)
            drawn = net.decode(mean + torch.exp(0.5 * log_var) * torch.randn_like(mean)).float()
        l1, edge = (drawn - clean).abs().mean(), edges(drawn, clean)
        kl = 0.5 * (mean**2 + log_var.exp() - 1 - log_var).mean()
        run.descend(10 * l1 + 20 * edge + 4e-4 * kl, len(batch), {"l1": l1, "edge": edge, "kl": kl})
    run.save()


class Latents:
    """The clean imprints' latents, whitened per cell, computed once per sample and symmetry."""

    def __init__(self, net, shards):
        self.net, self.shards, self.store = net.eval(), shards, {}
        chosen = np.random.default_rng(1).choice(len(shards), min(1024, len(shards)), replace=False)
        z, log_var = (torch.cat(x) for x in zip(*(self._raw(np.sort(chosen[i:i + 32]), 0) for i in range(0, len(chosen), 32))))
        self.mean = z.mean(dim=0, keepdim=True)
        # The posterior's own spread counts too: a channel that carries little must not be blown up to full size.
        spread = (z - self.mean) ** 2 + log_var.exp()
        self.std = spread.mean(dim=(0, 2, 3), keepdim=True).sqrt()

    @torch.no_grad()
    def _raw(self, batch, k):
        return self.net.encode(data.dihedral(data.to_model(self.shards.metres("clean", batch)), k))

    def take(self, batch, k):
        missing = [i for i in batch if (i, k) not in self.store]
        if missing:
            for i, z in zip(missing, self._raw(np.array(missing), k)[0].half()):
                self.store[i, k] = z
        return (torch.stack([self.store[i, k] for i in batch]).float() - self.mean) / self.std


def generator(args):
    shards, rng = data.Shards(args.data), np.random.default_rng(args.seed)
    torch.manual_seed(args.seed)
    ae = models.Autoencoder()
    ae.load_state_dict(torch.load(Path(args.out) / "autoencoder.pt", weights_only=True)["nets"]["autoencoder"])
    encoder, denoiser = models.ConditionEncoder(), models.Denoiser()
    averages = {"encoder_ema": copy.deepcopy(encoder), "denoiser_ema": copy.deepcopy(denoiser)}
    for net in averages.values():
        net.requires_grad_(False)
    run = Run(args, "generator", {"encoder": encoder, "denoiser": denoiser, **averages}, 7e-4)
    latents = Latents(ae, shards)
    if "latent_mean" in run.extra:
        latents.mean, latents.std = run.extra["latent_mean"], run.extra["latent_std"]
    run.extra = {"latent_mean": latents.mean, "latent_std": latents.std}
    bars = torch.from_numpy(diffusion.alpha_bar()).float()
    for batch in indices(shards, rng, 16):
        if run.progress() >= 1:
            break
        randomised = torch.from_numpy(shards.meta[batch, 6] == 0)
        # A turned or mirrored pair is a sensor with its lights elsewhere: only for the randomised ones. The symmetry
        # changes from batch to batch, so that most passes meet most samples in the plain orientation.
        k = int(rng.integers(1, 8)) if rng.random() < 0.15 else 0
        gelslim = shards.gelslim(batch)
        z = latents.take(batch, 0)
        if k and randomised.any():
            chosen = randomised.nonzero()[:, 0]
            gelslim[chosen] = data.dihedral(gelslim[chosen], k)
            z[chosen] = latents.take(batch[chosen.numpy()], k)
        gelslim = data.augment_gelslim(gelslim, randomised, rng)
        # Stratified steps: the batch covers the whole schedule.
        t = ((torch.arange(len(batch)) + torch.rand(len(batch))) / len(batch) * diffusion.STEPS).long()
        x, v = diffusion.noised(z, torch.randn_like(z), t, bars)
        with torch.autocast("cpu", torch.bfloat16, enabled=not args.f32):
            condition = encoder(gelslim)
            guess = denoiser(x, t, condition).float()
        loss = F.mse_loss(guess, v)
        direct = F.mse_loss(condition[:, :models.LATENT].float(), z)
        run.descend(loss + 0.5 * direct, len(batch), {"v": loss, "direct": direct})
        decay = min(0.998, (1 + run.step) / (20 + run.step))
        for average, net in ((averages["encoder_ema"], encoder), (averages["denoiser_ema"], denoiser)):
            for a, p in zip(average.parameters(), net.parameters()):
                a.lerp_(p.detach(), 1 - decay)
    run.save()


def dice_loss(probability, truth):
    overlap = (probability * truth).sum(dim=(1, 2))
    return 1 - ((2 * overlap + 1) / (probability.sum(dim=(1, 2)) + truth.sum(dim=(1, 2)) + 1)).mean()


def mask(args):
    shards, rng = data.Shards(args.data), np.random.default_rng(args.seed)
    torch.manual_seed(args.seed)
    net = models.MaskUNet().to(memory_format=torch.channels_last)
    run = Run(args, "mask", {"mask": net}, 3e-3)
    net.train()
    for batch in indices(shards, rng, 8):
        if run.progress() >= 1:
            break
        noisy, clean = shards.metres("imprint", batch), shards.metres("clean", batch)
        # From measured to generated: the grain fades, and the shape passes through the generator's raster.
        kind = torch.from_numpy(rng.choice(3, len(batch), p=(0.6, 0.2, 0.2)))[:, None, None, None]
        smooth = data.from_model(data.to_model(clean))
        if rng.random() < 0.5:
            smooth = F.avg_pool2d(F.pad(smooth, (1, 1, 1, 1), mode="replicate"), 3, stride=1)
        x = torch.where(kind == 0, noisy, torch.where(kind == 1, torch.lerp(clean, noisy, 0.4), smooth))
        x = x * torch.from_numpy(rng.uniform(0.9, 1.1, (len(batch), 1, 1, 1)).astype(np.float32))
        x = x + torch.from_numpy(rng.normal(0, 4e-4, (len(batch), 1, 1, 1)).astype(np.float32))
        truth = shards.contact(batch)
        flips = [d for d in (1, 2) if rng.random() < 0.5]
        x, truth = torch.flip(x, [d + 1 for d in flips]), torch.flip(truth, flips)
        with torch.autocast("cpu", torch.bfloat16, enabled=not args.f32):
            logits = net(data.to_mask_input(x).contiguous(memory_format=torch.channels_last)).float()
        cross = F.cross_entropy(logits, truth)
        dice = dice_loss(logits.softmax(dim=1)[:, 1], truth.float())
        with torch.no_grad():
            on, there = logits[:, 1] > logits[:, 0], truth == 1
            iou = (on & there).sum() / (on | there).sum().clamp(min=1)
        run.descend(cross + dice, len(batch), {"cross": cross, "dice": dice, "iou": iou})
    run.save()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("autoencoder", "generator", "mask"))
    parser.add_argument("--data", default="training/data/train", help="folder of shards")
    parser.add_argument("--out", default="training/runs/demo", help="folder for checkpoints and logs")
    parser.add_argument("--minutes", type=float, default=10.0, help="wall-clock budget, earlier starts counted in")
    parser.add_argument("--steps", type=int, default=0, help="number of steps instead of the minutes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--f32", action="store_true", help="no bfloat16 (CPUs without AVX-512 BF16 or AMX)")
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    torch.manual_seed(args.seed)
    {"autoencoder": autoencoder, "generator": generator, "mask": mask}[args.what](args)


if __name__ == "__main__":
    main()
