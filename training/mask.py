"""Training of the mask UNet."""

import math
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

from . import data, export, models, weights
from .run import Run
from .touches import Touches, batches

# Share of predicted imprints where a generator was named; of the others: measured, nearly clean, redrawn.
PREDICTED = 0.4
SHARES = (0.6, 0.2, 0.2)


def dice_loss(probability, truth):
    overlap = (probability * truth).sum(dim=(1, 2))
    return 1 - ((2 * overlap + 1) / (probability.sum(dim=(1, 2)) + truth.sum(dim=(1, 2)) + 1)).mean()


def another_sensor(metres, generated):
    """Imprints of other scale and level, some of them with slow distortions; half of the measured ones shallower.

    What makes a pixel contact is the shape around it, not its depth: another gripper presses another bubble less.
    """
    n, device = len(metres), metres.device

    def uniform():
        return torch.rand(n, 1, 1, 1, device=device)

    shallow = (uniform() < 0.5) & ~generated[:, None, None, None]
    gain = torch.where(shallow, torch.exp(math.log(0.3) * uniform()), 0.9 + 0.2 * uniform())
    slow = F.interpolate(torch.randn(n, 1, 4, 5, device=device), size=metres.shape[-2:], mode="bicubic", align_corners=True)
    distortion = torch.where(uniform() < 0.5, 4e-4 * uniform(), 0)
    level = 4e-4 * torch.randn(n, 1, 1, 1, device=device)
    return metres * gain + slow * distortion + level


class Predicted:
    """Imprints in micrometres that a generator bundle predicts for some of the touches, drawn once and kept in a file.

    A mask for a prediction is what the generator's errors make of the shape, so it is learnt from predictions.
    """

    def __init__(self, args, shards, device):
        self.path = Path(args.out) / "predicted.npz"
        if not self.path.exists():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            nets, rng = export.bundle_nets(args.predicted_by), np.random.default_rng(args.seed)
            nets = [net.eval().to(device) for net in nets]
            # What a GelSlim image says nothing about, no prediction can be right about: the depths of `depths` shards.
            known = np.flatnonzero(shards.contact_known(np.arange(len(shards))) & (shards.meta[:, 6] != 2))
            chosen = np.sort(rng.choice(known, min(args.predicted, len(known)), replace=False))
            parts = [chosen[i:i + 16] for i in range(0, len(chosen), 16)]
            metres = torch.cat([export.predict(nets, *(x.to(device) for x in (shards.gelslim(part), shards.offsets(part))),
                                               steps=2, seed=int(part[0])) for part in parts]).cpu().numpy()
            np.savez(self.path, imprint=np.round(metres[:, 0] * 1e6).astype(np.int16), contact=shards.take("contact", chosen))
        with np.load(self.path) as kept:
            self.imprint, self.contact = (torch.from_numpy(kept[name]) for name in ("imprint", "contact"))

    def draw(self, count):
        """Predictions (count,1,140,175) in metres, and where contact is."""
        at = torch.randperm(len(self.imprint))[:count]
        return data.metres(self.imprint[at]), self.contact[at]


def mask(args):
    net = models.MaskUNet()
    net.train()
    if args.start:
        # An exported graph has its batch norms folded in: from there on they stay fixed scales and shifts.
        weights.load_folded(net, Path(args.start) / "mask_unet.onnx")
        net.eval()
    run = Run(args, "mask", {"mask": net}, (8, 6e-4 if args.start else 3e-3), (128, 6e-4 if args.start else 3e-3))
    touches = Touches(args, run.place, ("imprint", "clean", "contact"), usable=data.Shards.contact_known)
    predicted = Predicted(args, touches.shards, run.place.device) if args.predicted_by else None
    run.extra = {"predicted_by": data.sha256(Path(args.predicted_by) / "denoiser.onnx") if predicted else None}

    def varied(touches, places, args):
        """Inputs of the network and where contact is, of imprints from measured to generated."""
        n, device = len(places), touches.place.device
        generated = (torch.rand(n) < (PREDICTED if predicted else 0)).to(device)
        batch = touches.get(places)
        noisy, clean = data.metres(batch["imprint"]), data.metres(batch["clean"])
        # From measured to generated: the grain fades, and the shape passes through the generator's raster.
        kind = torch.multinomial(torch.tensor(SHARES, device=device), n, replacement=True)[:, None, None, None]
        smooth = data.from_model(data.to_model(clean))
        if torch.rand(1) < 0.5:
            smooth = F.avg_pool2d(F.pad(smooth, (1, 1, 1, 1), mode="replicate"), 3, stride=1)
        x = torch.where(kind == 0, noisy, torch.where(kind == 1, torch.lerp(clean, noisy, 0.4), smooth))
        if predicted:
            drawn, of_drawn = predicted.draw(int(generated.sum()))
            x[generated], batch["contact"][generated] = drawn.to(device), of_drawn.to(device)
        x = another_sensor(x, generated)
        flips = [d for d in (1, 2) if torch.rand(1) < 0.5]
        x, truth = torch.flip(x, [d + 1 for d in flips]), torch.flip(batch["contact"], flips).long()
        return {"input": data.to_mask_input(x).contiguous(memory_format=torch.channels_last), "truth": truth}

    for batch in batches(run, touches, varied):
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
