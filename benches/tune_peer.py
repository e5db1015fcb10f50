"""The arithmetic of `touch2touch adapt --tune` in PyTorch, for time and memory: `python -m benches.tune_peer SHARDS [STEPS] [THREADS]`.

SHARDS is what `touch2touch-bench training-data PAIRS --out SHARDS` writes. The same networks from the same bundle, the same unrolled
sampler (zeros or noise; with 30 % a second step), the same losses, optimiser, batch of 12 and running mean of weights; of the
variations of the pairs only gain and noise. Prints seconds per step, peak memory and the loss.
"""

import resource
import sys
import time

import numpy as np
import torch
import torch.nn.functional as F

from training import data, diffusion, export, models, weights

BUNDLE = "assets/models/generator_ldm"
# Assumed meters at 0 and 1 of a picture.
UNIT_M = (-0.0063, 0.0180)
BATCH, SECOND, ANCHOR = 12, 0.3, 30.0


def rates(step, steps):
    """Share of the rates: 10 rising steps, then a cosine down to 2 %."""
    if step < 10:
        return (step + 1) / 10
    return 0.02 + 0.98 * (1 + np.cos(np.pi * (step - 10) / max(steps - 10, 1))) / 2


def distance(drawn, measured):
    difference = drawn - measured
    smooth = F.avg_pool2d(difference[:, None], 3, stride=1)
    slopes = smooth.diff(dim=2).abs().mean() + smooth.diff(dim=3).abs().mean()
    return 20 * (difference**2).mean() + difference.abs().mean() + 0.5 * slopes


def main():
    folder, steps = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 50
    torch.set_num_threads(int(sys.argv[3]) if len(sys.argv) > 3 else 2)
    torch.manual_seed(1)
    shards, rng = data.Shards(folder), np.random.default_rng(1)
    every = range(len(shards))
    pictures, pads = shards.gelslim(every), torch.from_numpy(shards.meta[:, 1]).long()
    metres = (data.to_model(shards.metres("clean", every)) + 1) / 2 * (data.RANGE_M[1] - data.RANGE_M[0]) + data.RANGE_M[0]
    imprints = (metres[:, 0] - UNIT_M[0]) / (UNIT_M[1] - UNIT_M[0])

    encoder, denoiser, autoencoder = models.ConditionEncoder(), models.Denoiser(), models.Autoencoder()
    weights.load(encoder, f"{BUNDLE}/condition_encoder.onnx")
    weights.load(denoiser, f"{BUNDLE}/denoiser.onnx")
    scale = weights.load(autoencoder.decoder, f"{BUNDLE}/decoder.onnx", "decoder.")
    decoder = export.Decoder(autoencoder.decoder, scale["mean"], scale["std"])
    networks = [p for net in (encoder, denoiser, autoencoder.decoder) for p in net.parameters()]
    begin = [p.detach().clone() for p in networks]
    mean = [p.detach().clone() for p in networks]
    line, shift = torch.tensor([1.0, 0.0], requires_grad=True), torch.zeros(2, 2, requires_grad=True)
    field = torch.zeros(2, 128, 128, requires_grad=True)
    groups = [({"params": networks, "weight_decay": 0.01}, 6e-4), ({"params": [line], "weight_decay": 0}, 6e-4),
              ({"params": [shift], "weight_decay": 0}, 0.02), ({"params": [field], "weight_decay": 0}, 2e-3)]
    optimiser = torch.optim.AdamW([group for group, _ in groups], lr=1e-3, betas=(0.9, 0.99))
    bars = torch.from_numpy(diffusion.alpha_bar()).float()

    def clean(x, t, condition):
        v = denoiser(x, torch.full((len(x),), t, dtype=torch.int64), condition)
        return bars[t].sqrt() * x - (1 - bars[t]).sqrt() * v

    started = time.monotonic()
    for step in range(steps):
        chosen = torch.from_numpy(rng.choice(len(shards), BATCH, replace=len(shards) < BATCH))
        gain = torch.exp(0.2 * torch.randn(BATCH, 1, 1, 1))
        condition = encoder(pictures[chosen] * gain + 0.05 * torch.randn(BATCH, 3, 128, 128))
        noise = torch.randn(BATCH, 4, 16, 16) * (torch.rand(BATCH, 1, 1, 1) < 0.5)
        z = clean(noise, 999, condition)
        if rng.random() < SECOND:
            between = bars[499].sqrt() * z.detach() + (1 - bars[499]).sqrt() * torch.randn_like(z)
            z = clean(between, 499, condition)
        drawn = (decoder(z) + 1) / 2 * (data.RANGE_M[1] - data.RANGE_M[0]) + data.RANGE_M[0]
        drawn = (drawn - UNIT_M[0]) / (UNIT_M[1] - UNIT_M[0])
        turn = torch.eye(2).repeat(BATCH, 1, 1)
        at = F.affine_grid(torch.cat([turn, -2 / 128 * shift[pads[chosen]].flip(1)[:, :, None]], dim=2), list(drawn.shape), False)
        placed = F.grid_sample(drawn, at, padding_mode="border", align_corners=False)[:, 0]
        loss = distance(line[0] * placed + line[1] + field[pads[chosen]], imprints[chosen])
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_([p for group in optimiser.param_groups for p in group["params"]], 1.0)
        share = rates(step, steps)
        for group, (_, rate) in zip(optimiser.param_groups, groups):
            group["lr"] = rate * share
        optimiser.step()
        decay = min(0.98, (1 + step) / (10 + step))
        with torch.no_grad():
            for p, start, average in zip(networks, begin, mean):
                p.lerp_(start, 6e-4 * share * ANCHOR * 0.01)
                average.lerp_(p, 1 - decay)
        if step == 0:
            # The first step pays for memory and kernels.
            started = time.monotonic()
    each = (time.monotonic() - started) / max(steps - 1, 1)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    print(f"{each:.3f} s per step of {BATCH} pairs, {torch.get_num_threads()} threads, {peak} MiB, loss {float(loss.detach()):.4f}")


if __name__ == "__main__":
    main()
