"""Training of the mask UNet."""

from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

from . import data, evaluate, models, weights
from .run import Run, batches

# Share of predicted imprints where a generator was named; of the others: measured, nearly clean, redrawn.
PREDICTED = 0.4
SHARES = (0.6, 0.2, 0.2)


def dice_loss(probability, truth):
    overlap = (probability * truth).sum(dim=(1, 2))
    return 1 - ((2 * overlap + 1) / (probability.sum(dim=(1, 2)) + truth.sum(dim=(1, 2)) + 1)).mean()


def another_sensor(metres, generated, rng):
    """Imprints of other scale and level, some of them with slow distortions; half of the measured ones shallower.

    What makes a pixel contact is the shape around it, not its depth: another gripper presses another bubble less.
    """
    n = len(metres)
    shallow = (rng.random(n) < 0.5) & ~generated
    gain = np.where(shallow, np.exp(rng.uniform(np.log(0.3), 0.0, n)), rng.uniform(0.9, 1.1, n))
    slow = F.interpolate(torch.from_numpy(rng.standard_normal((n, 1, 4, 5), dtype=np.float32)), size=metres.shape[-2:],
                         mode="bicubic", align_corners=True)
    distortion = np.where(rng.random(n) < 0.5, rng.uniform(0, 4e-4, n), 0.0)
    level = rng.normal(0, 4e-4, n)
    gain, distortion, level = (torch.from_numpy(v.astype(np.float32))[:, None, None, None] for v in (gain, distortion, level))
    return metres * gain + slow * distortion + level


class Predicted:
    """Imprints in micrometres that a generator bundle predicts for some of the touches, drawn once and kept in a file.

    A mask for a prediction is what the generator's errors make of the shape, so it is learnt from predictions.
    """

    def __init__(self, args, shards):
        self.path = Path(args.out) / "predicted.npz"
        if not self.path.exists():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            bundle, rng = evaluate.Bundle(args.predicted_by), np.random.default_rng(args.seed)
            # What a GelSlim image says nothing about, no prediction can be right about: the depths of `depths` shards.
            known = np.flatnonzero(shards.contact_known(range(len(shards))) & (shards.meta[:, 6] != 2))
            chosen = np.sort(rng.choice(known, min(args.predicted, len(known)), replace=False))
            parts = [chosen[i:i + 16] for i in range(0, len(chosen), 16)]
            metres = torch.cat([bundle.metres(shards.gelslim(part), shards.offsets(part), seed=int(part[0])) for part in parts])
            metres = metres.numpy()
            np.savez(self.path, chosen=chosen, imprint=np.round(metres[:, 0] * 1e6).astype(np.int16))
        kept = np.load(self.path)
        self.chosen, self.imprint = kept["chosen"], kept["imprint"]

    def draw(self, rng, count):
        """Sample numbers (count,) and their predictions (count,1,140,175) in metres."""
        at = np.sort(rng.choice(len(self.chosen), count, replace=False))
        return self.chosen[at], torch.from_numpy(self.imprint[at]).float()[:, None] * 1e-6


def mask(args):
    shards, net = data.Shards(args.data), models.MaskUNet()
    net.train()
    if args.start:
        # An exported graph has its batch norms folded in: from there on they stay fixed scales and shifts.
        weights.load_folded(net, Path(args.start) / "mask_unet.onnx")
        net.eval()
    net = net.to(memory_format=torch.channels_last)
    run = Run(args, "mask", {"mask": net}, 6e-4 if args.start else 3e-3)
    predicted = Predicted(args, shards) if args.predicted_by else None
    run.extra = {"predicted_by": data.sha256(Path(args.predicted_by) / "denoiser.onnx") if predicted else None}

    def varied(shards, batch, args, rng):
        """Inputs of the network and where contact is, of imprints from measured to generated; no input where none is known."""
        batch = batch[shards.contact_known(batch)]
        if not len(batch):
            return {}
        generated = rng.random(len(batch)) < (PREDICTED if predicted else 0)
        drawn = torch.zeros(0, 1, 140, 175)
        if generated.any():
            batch[generated], drawn = predicted.draw(rng, int(generated.sum()))
        noisy, clean = shards.metres("imprint", batch), shards.metres("clean", batch)
        # From measured to generated: the grain fades, and the shape passes through the generator's raster.
        kind = torch.from_numpy(rng.choice(3, len(batch), p=SHARES))[:, None, None, None]
        smooth = data.from_model(data.to_model(clean))
        if rng.random() < 0.5:
            smooth = F.avg_pool2d(F.pad(smooth, (1, 1, 1, 1), mode="replicate"), 3, stride=1)
        x = torch.where(kind == 0, noisy, torch.where(kind == 1, torch.lerp(clean, noisy, 0.4), smooth))
        x[torch.from_numpy(generated)] = drawn
        x = another_sensor(x, generated, rng)
        truth = shards.contact(batch)
        flips = [d for d in (1, 2) if rng.random() < 0.5]
        x, truth = torch.flip(x, [d + 1 for d in flips]), torch.flip(truth, flips)
        return {"input": data.to_mask_input(x).contiguous(memory_format=torch.channels_last), "truth": truth}

    for batch in batches(shards, run, 8, varied):
        if not batch:
            run.pass_over()
            continue
        truth = batch["truth"]
        with run.place.autocast():
            logits = net(batch["input"]).float()
        cross = F.cross_entropy(logits, truth)
        dice = dice_loss(logits.softmax(dim=1)[:, 1], truth.float())
        with torch.no_grad():
            on, there = logits[:, 1] > logits[:, 0], truth == 1
            iou = (on & there).sum() / (on | there).sum().clamp(min=1)
        run.descend(cross + dice, len(truth), {"cross": cross, "dice": dice, "iou": iou})
    run.end()
