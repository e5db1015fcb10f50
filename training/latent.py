"""Training of the latent diffusion: the KL autoencoder, then condition encoder and denoiser."""

import copy
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

from . import data, diffusion, models
from .run import Run, batches, condition, edges, start, symmetries, target


def imprints(shards, batch, args, rng):
    """Imprints to be drawn, and those to be drawn from: the same, or as measured."""
    k = rng.integers(8, size=len(batch))
    clean = target(shards, "clean", batch, k, args)
    return {"clean": clean, "image": target(shards, "imprint", batch, k, args) if rng.random() < 0.5 else clean}


def autoencoder(args):
    shards, net = data.Shards(args.data), models.Autoencoder()
    start(net.decoder, args, "decoder", "decoder.")
    net = net.to(memory_format=torch.channels_last)
    run = Run(args, "autoencoder", {"autoencoder": net}, 1.5e-3)
    for batch in batches(shards, run, 8, imprints):
        # A bundle has no encoder: a new one first learns the latents that the bundle's decoder knows.
        frozen = bool(args.start) and run.progress() < 0.4
        net.decoder.requires_grad_(not frozen)
        clean = batch["clean"]
        with run.place.autocast():
            mean, log_var = net.encode(batch["image"])
            drawn = net.decode(mean + torch.exp(0.5 * log_var) * torch.randn_like(mean)).float()
        l1, edge = (drawn - clean).abs().mean(), edges(drawn, clean)
        kl = 0.5 * (mean**2 + log_var.exp() - 1 - log_var).mean()
        run.descend(10 * l1 + 20 * edge + 4e-4 * kl, len(clean), {"l1": l1, "edge": edge, "kl": kl})
    run.end()


class Latents:
    """The clean imprints' latents, whitened per cell, computed once per sample and symmetry.

    `known`: mean and deviation, where they were taken before.
    """

    def __init__(self, net, shards, args, device, known=None):
        self.net, self.shards, self.args, self.device, self.store = net.eval().to(device), shards, args, device, {}
        self.mean, self.std = (x.to(device) for x in known or self._statistics())

    def _statistics(self):
        shards = self.shards
        chosen = np.random.default_rng(1).choice(len(shards), min(1024, len(shards)), replace=False)
        parts = [np.sort(chosen[i:i + 32]) for i in range(0, len(chosen), 32)]
        z, log_var = (torch.cat(x) for x in zip(*(self._raw(p, np.zeros(len(p), int)) for p in parts)))
        mean = z.mean(dim=0, keepdim=True)
        # The posterior's own spread counts too: a channel that carries little must not be blown up to full size.
        spread = (z - mean) ** 2 + log_var.exp()
        return mean, spread.mean(dim=(0, 2, 3), keepdim=True).sqrt()

    @torch.no_grad()
    def _raw(self, batch, k):
        """Mean and log variance for samples `batch`, each turned by its own symmetry."""
        return self.net.encode(target(self.shards, "clean", batch, k, self.args).to(self.device))

    def take(self, batch, k):
        pairs = list(zip(batch.tolist(), k.tolist()))
        # One by one: the last bits of a batch depend on its size, which depends on what is in the store.
        for i, pair in enumerate(pairs):
            if pair not in self.store:
                self.store[pair] = self._raw(batch[i:i + 1], k[i:i + 1])[0][0].half()
        return (torch.stack([self.store[pair] for pair in pairs]).float() - self.mean) / self.std


def generator(args):
    shards, ae = data.Shards(args.data), models.Autoencoder()
    ae.load_state_dict(torch.load(Path(args.out) / "autoencoder.pt", weights_only=True)["nets"]["autoencoder"])
    encoder, denoiser = models.ConditionEncoder(geometry=args.geometry), models.Denoiser()
    start(encoder, args, "condition_encoder")
    start(denoiser, args, "denoiser")
    encoder, denoiser = (n.to(memory_format=torch.channels_last) for n in (encoder, denoiser))
    averages = {"encoder_ema": copy.deepcopy(encoder), "denoiser_ema": copy.deepcopy(denoiser)}
    for net in averages.values():
        net.requires_grad_(False)
    run = Run(args, "generator", {"encoder": encoder, "denoiser": denoiser, **averages}, 7e-4)
    known = None
    if "latent_mean" in run.extra:
        known = run.extra["latent_mean"], run.extra["latent_std"]
    elif args.start:
        whitening = start(models.Autoencoder().decoder, args, "decoder", "decoder.")
        known = whitening["mean"], whitening["std"]
    place = run.place
    latents = Latents(ae, shards, args, place.device, known)
    run.extra = {"latent_mean": latents.mean, "latent_std": latents.std}
    bars = torch.from_numpy(diffusion.alpha_bar()).float().to(place.device)
    for batch in batches(shards, run, 16, turned_pairs):
        z, gelslim = latents.take(batch["numbers"], batch["turned"]), batch["gelslim"]
        # Stratified steps: the batch covers the whole schedule.
        t = ((torch.arange(len(z)) + torch.rand(len(z))) / len(z) * diffusion.STEPS).long()
        t = t[torch.randperm(len(z))].to(place.device)
        x, v = diffusion.noised(z, torch.randn_like(z), t, bars)
        with place.autocast():
            seen = encoder(gelslim)
            guess = denoiser(x, t, seen).float()
        loss = F.mse_loss(guess, v)
        direct = F.mse_loss(seen[:, :models.LATENT].float(), z)
        if not run.descend(loss + 0.5 * direct, len(z), {"v": loss, "direct": direct}):
            continue
        decay = min(0.998, (1 + run.step) / (20 + run.step))
        for average, net in ((averages["encoder_ema"], encoder), (averages["denoiser_ema"], denoiser)):
            for a, p in zip(average.parameters(), net.parameters()):
                a.lerp_(p.detach(), 1 - decay)
    run.end()


def turned_pairs(shards, batch, args, rng):
    """Numbers of the samples, how each is turned, and GelSlim images that are: the latents are kept by number and turn.

    Pairs are turned and mirrored together, as the lab's own augmentation does: the colours tell which way up.
    """
    k = symmetries(args, rng, len(batch))
    return {"numbers": batch, "turned": k, "gelslim": condition(shards, batch, k, args, rng)}
