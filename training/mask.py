"""Training of the mask UNet."""

import numpy as np
import torch
import torch.nn.functional as F

from . import data, models
from .run import Run, indices


def dice_loss(probability, truth):
    overlap = (probability * truth).sum(dim=(1, 2))
    return 1 - ((2 * overlap + 1) / (probability.sum(dim=(1, 2)) + truth.sum(dim=(1, 2)) + 1)).mean()


def mask(args):
    shards, rng = data.Shards(args.data), np.random.default_rng(args.seed)
    net = models.MaskUNet().to(memory_format=torch.channels_last)
    run = Run(args, "mask", {"mask": net}, 3e-3)
    net.train()
    for batch in indices(shards, rng, 8):
        if run.over():
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
        with torch.autocast("cpu", torch.bfloat16, enabled=args.bf16):
            logits = net(data.to_mask_input(x).contiguous(memory_format=torch.channels_last)).float()
        cross = F.cross_entropy(logits, truth)
        dice = dice_loss(logits.softmax(dim=1)[:, 1], truth.float())
        with torch.no_grad():
            on, there = logits[:, 1] > logits[:, 0], truth == 1
            iou = (on & there).sum() / (on | there).sum().clamp(min=1)
        run.descend(cross + dice, len(batch), {"cross": cross, "dice": dice, "iou": iou})
    run.save()
