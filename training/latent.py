"""Training of the latent diffusion: the KL autoencoder, then condition encoder and denoiser."""

from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

from . import diffusion, models
from .run import Run, edges, start
from .touches import CHUNK, PAIR, Touches, batches, pair, picture


def imprints(touches, places, args):
    """Imprints to be drawn, and those to be drawn from: the same, or as measured."""
    batch = touches.get(places)
    k = torch.randint(8, (len(places),), device=touches.place.device)
    clean = picture(batch, "clean", k, args)
    return {"clean": clean, "image": picture(batch, "imprint", k, args) if torch.rand(1) < 0.5 else clean}


def autoencoder(args):
    net = models.Autoencoder()
    start(net.decoder, args, "decoder", "decoder.")
    run = Run(args, "autoencoder", {"autoencoder": net}, (8, 1.5e-3), (256, 1.5e-3))
    touches = Touches(args, run.place, ("clean_picture", "imprint_picture"))
    for batch in batches(run, touches, imprints):
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


@torch.no_grad()
def whitening(net, touches, args):
    """Mean of the latents per cell and deviation per channel, over some samples."""
    chosen = np.random.default_rng(1).choice(len(touches), min(1024, len(touches)), replace=False)
    parts = [touches.get(chosen[at:at + CHUNK]) for at in range(0, len(chosen), CHUNK)]
    plain = torch.zeros(CHUNK, dtype=torch.int64, device=touches.place.device)
    z, log_var = (torch.cat(x) for x in zip(*(net.encode(picture(p, "clean", plain[:len(p["drawn"])], args)) for p in parts)))
    mean = z.mean(dim=0, keepdim=True)
    # The posterior's own spread counts too: a channel that carries little must not be blown up to full size.
    spread = (z - mean) ** 2 + log_var.exp()
    return {"latent_mean": mean, "latent_std": spread.mean(dim=(0, 2, 3), keepdim=True).sqrt()}


def generator(args):
    ae, known = models.Autoencoder(), Path(args.out) / "autoencoder.pt"
    if not known.exists():
        raise SystemExit(f"{known} is not there: train the autoencoder first")
    ae.load_state_dict(torch.load(known, weights_only=True, map_location="cpu")["nets"]["autoencoder"])
    encoder, denoiser = models.ConditionEncoder(geometry=args.geometry), models.Denoiser()
    start(encoder, args, "condition_encoder")
    start(denoiser, args, "denoiser")
    run = Run(args, "generator", {"encoder": encoder, "denoiser": denoiser}, (16, 2e-4 if args.start else 7e-4), (512, 1e-3),
              averaged=("encoder", "denoiser"))
    device, touches = run.place.device, Touches(args, run.place, PAIR)
    ae = ae.requires_grad_(False).to(device, memory_format=torch.channels_last)
    if args.start and not run.extra:
        of_bundle = start(models.Autoencoder().decoder, args, "decoder", "decoder.")
        run.extra = {"latent_mean": of_bundle["mean"], "latent_std": of_bundle["std"]}
    run.extra = run.extra or whitening(ae, touches, args)
    mean, std = (run.extra[name].to(device) for name in ("latent_mean", "latent_std"))
    bars = torch.from_numpy(diffusion.alpha_bar()).float().to(device)
    for batch in batches(run, touches, pair):
        z = (ae.encode(batch["clean"])[0] - mean) / std
        # Stratified steps: the batch covers the whole schedule.
        n = len(z)
        t = ((torch.arange(n, device=device) + torch.rand(n, device=device)) / n * diffusion.STEPS).long().clamp(max=diffusion.STEPS - 1)
        x, v = diffusion.noised(z, torch.randn_like(z), t, bars)
        with run.place.autocast():
            seen = encoder(batch["gelslim"])
            guess = denoiser(x, t, seen).float()
        loss, direct = F.mse_loss(guess, v), F.mse_loss(seen[:, :models.LATENT].float(), z)
        run.descend(loss + 0.5 * direct, n, {"v": loss, "direct": direct})
    run.end()
