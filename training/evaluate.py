"""Command line: `python -m training.evaluate --bundle DIR [--mask DIR] --data DIR ... [--pictures DIR] --out DIR`.

Runs exported bundles with ONNX Runtime on validation shards (PSNR with the lab's peak of 0.0225 m, L1, correlation;
mask IoU on measured and on predicted imprints) and, if given, on a folder of `NAME_gelslim.png` / `NAME_bubble.png`
(`NAME_vqvae.png`) tiles, both images scaled 0..1. Writes `contact_sheet.png`, `pictures.png` and `figures.json`.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import onnxruntime
import torch
import torch.nn.functional as F
from PIL import Image

from . import data, diffusion

PEAK_M = 0.0225
# What black and white of a picture without scale are taken to mean.
ASSUMED_M = (-0.0063, 0.0180)


class Bundle:
    """The graphs of a bundle, run with ONNX Runtime."""

    def __init__(self, folder):
        self.manifest = json.loads((Path(folder) / "manifest.json").read_text())
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self.graphs = {}
        for role, entry in self.manifest["files"].items():
            path = Path(folder) / entry["path"]
            if data.sha256(path) != entry["sha256"]:
                raise SystemExit(f"{path} is damaged: its sha256 is not the manifest's")
            self.graphs[role] = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])

    def run(self, role, *inputs):
        graph = self.graphs[role]
        feed = {i.name: t.numpy() for i, t in zip(graph.get_inputs(), inputs)}
        return torch.from_numpy(graph.run(None, feed)[0])

    def predict(self, gelslim, steps=None, seed=42):
        """Model images (N,1,128,128) in [-1,1] for standardised GelSlim images."""
        condition = self.run("condition_encoder", gelslim)
        latent = diffusion.ddim(lambda x, t, c: self.run("denoiser", x, t, c), condition,
                                steps or self.manifest["defaults"]["steps"], seed, self.manifest["latent"]["shape"])
        return self.run("decoder", latent)

    def metres(self, gelslim, offsets, **options):
        """The same in metres, each picture where its finger's camera has it (`offsets` of `Shards.offsets`)."""
        framed = "window_px" in self.manifest["output"]
        return data.from_model(self.predict(gelslim, **options), offsets if framed else None)

    def mask(self, metres):
        logits = self.run("mask_unet", data.to_mask_input(metres))
        return logits[:, 1] > logits[:, 0]


def psnr(a, b, peak):
    return 10 * np.log10(peak**2 / max(float(((a - b) ** 2).mean()), 1e-20))


def ssim(a, b):
    """Mean structural similarity of two images in 0..1: 11 x 11 Gaussian, sigma 1.5, valid pixels only."""
    g = torch.exp(-(torch.arange(11) - 5.0) ** 2 / (2 * 1.5**2))
    window = (g[:, None] * g[None] / g.sum() ** 2)[None, None].double()
    a, b = a.double()[None, None], b.double()[None, None]

    def mean(x):
        return F.conv2d(x, window)

    ma, mb = mean(a), mean(b)
    va, vb, ab = mean(a * a) - ma**2, mean(b * b) - mb**2, mean(a * b) - ma * mb
    c1, c2 = 0.01**2, 0.03**2
    return float((((2 * ma * mb + c1) * (2 * ab + c2)) / ((ma**2 + mb**2 + c1) * (va + vb + c2))).mean())


def iou(a, b):
    return float((a & b).sum() / (a | b).sum().clamp(min=1))


def unit(image):
    return (image - image.min()) / (image.max() - image.min()).clamp(min=1e-9)


def likeness(a, truth, prefix):
    """PSNR and SSIM of two images stretched to 0..1 each, and with scale and offset of `a` fitted to the truth.

    The stretch hangs on two pixels, the noisiest ones of a measured imprint; the fit on all.
    """
    centred = (a - a.mean()).double()
    slope = (centred * (truth - truth.mean())).sum() / (centred**2).sum().clamp(min=1e-12)
    fitted = (slope * centred + truth.mean()).float()
    a = unit(a)
    return {prefix + "psnr_db": psnr(a, truth, 1), prefix + "ssim": ssim(a, truth),
            prefix + "fitted_psnr_db": psnr(fitted, truth, 1), prefix + "fitted_ssim": ssim(fitted, truth),
            prefix + "correlation": float(np.corrcoef(a.flatten(), truth.flatten())[0, 1])}


def tile(image):
    """A grey or colour tile (128,128,3) u8 from (1,H,W) or (3,128,128) in 0..1."""
    image = F.interpolate(image[None].float(), size=(128, 128), mode="bilinear", align_corners=False)[0]
    return (image.expand(3, -1, -1).clamp(0, 1) * 255).byte().permute(1, 2, 0).numpy()


def sheet(rows, path):
    """Rows of tiles with a white line between."""
    tiles = [np.concatenate([np.pad(t, ((0, 2), (0, 2), (0, 0)), constant_values=255) for t in row], axis=1) for row in rows]
    Image.fromarray(np.concatenate(tiles, axis=0)).save(path)


def shards_figures(name, bundle, masker, shards, count, out):
    chosen = np.linspace(0, len(shards) - 1, min(count, len(shards))).astype(int)
    gelslim = shards.gelslim(chosen)
    clean, measured = shards.metres("clean", chosen), shards.metres("imprint", chosen)
    offsets = shards.offsets(chosen)
    parts = [slice(i, i + 16) for i in range(0, len(chosen), 16)]
    predicted = torch.cat([bundle.metres(gelslim[part], offsets[part]) for part in parts])
    figures = {"samples": len(chosen)}
    for label, truth in (("clean", clean), ("measured", measured)):
        figures[label] = {
            "psnr_db": float(np.mean([psnr(p, t, PEAK_M) for p, t in zip(predicted, truth)])),
            "l1_mm": float((predicted - truth).abs().mean() * 1e3),
            "correlation": float(np.mean([np.corrcoef(p.flatten(), t.flatten())[0, 1] for p, t in zip(predicted, truth)])),
        }
    mean_image = clean.mean(dim=0, keepdim=True)
    figures["mean_image_psnr_db"] = float(np.mean([psnr(mean_image[0], t, PEAK_M) for t in clean]))
    lo, hi = float(clean.min()), float(clean.max())
    rows = [[tile(0.5 + g / 8) for g in gelslim[:12]]]
    for metres in (measured, clean, predicted):
        rows.append([tile((torch.flip(m, (1, 2)) - lo) / (hi - lo)) for m in metres[:12]])
    if masker and shards.contact_known(chosen).all():
        contact = shards.contact(chosen) == 1
        on_measured, on_predicted = masker.mask(measured), masker.mask(predicted)
        figures["mask_iou"] = {
            "measured": float(np.mean([iou(a, b) for a, b in zip(on_measured, contact)])),
            "measured_pooled": iou(on_measured, contact),
            "predicted": float(np.mean([iou(a, b) for a, b in zip(on_predicted, contact)])),
            "predicted_pooled": iou(on_predicted, contact),
        }
        for mask in (contact, on_measured, on_predicted):
            rows.append([tile(torch.flip(m[None].float(), (1, 2))) for m in mask[:12]])
    sheet(rows, out / f"contact_sheet_{name}.png")
    return figures


def pictures_figures(bundle, masker, folder, out):
    """Tiles whose scale is lost: the modal grey of each channel is taken as zero."""
    names = sorted(p.name[:-len("_gelslim.png")] for p in Path(folder).glob("*_gelslim.png"))
    rows, pairs = [], []
    for name in names:
        def load(kind, name=name):
            image = torch.from_numpy(np.array(Image.open(Path(folder) / f"{name}_{kind}.png"))).float()
            return F.interpolate((image if image.dim() == 3 else image[:, :, None]).permute(2, 0, 1)[None], size=(128, 128),
                                 mode="bilinear", align_corners=False)[0]

        raw = load("gelslim")[:3]
        zero = torch.tensor([float(np.bincount(c.flatten().byte().numpy()).argmax()) for c in raw])
        difference = (raw - zero[:, None, None]) / 255
        standard = (difference - torch.tensor(data.MEAN)[:, None, None]) / torch.tensor(data.STD)[:, None, None]
        drawn = bundle.predict(standard[None])[0, 0]
        predicted, truth = unit(drawn), unit(load("bubble")[0])
        pair = {"name": name, "clipped": bool((zero < 40).any()), **likeness(drawn, truth, "")}
        # In the assumed scale, where the level of the prediction counts and its extremes do not.
        low, high = (2 * (m - data.RANGE_M[0]) / (data.RANGE_M[1] - data.RANGE_M[0]) - 1 for m in ASSUMED_M)
        scaled = (drawn - low) / (high - low)
        pair |= {"assumed_psnr_db": psnr(scaled, truth, 1), "assumed_ssim": ssim(scaled, truth)}
        row = [tile(raw / 255), tile(truth[None]), tile(predicted[None])]
        if (Path(folder) / f"{name}_vqvae.png").exists():
            lab = unit(load("vqvae")[0])
            pair |= likeness(lab, truth, "vqvae_")
            row.append(tile(lab[None]))
        if masker:
            metres = ASSUMED_M[0] + truth * (ASSUMED_M[1] - ASSUMED_M[0])
            full = torch.flip(F.interpolate(metres[None, None], size=(140, 175), mode="bilinear", align_corners=False), (2, 3))
            row.append(tile(torch.flip(masker.mask(full).float(), (1, 2))))
        pairs.append(pair)
        rows.append(np.concatenate(row, axis=0))
    sheet([rows[i:i + 12] for i in range(0, len(rows), 12)], out / "pictures.png")
    keys = [k for k in pairs[0] if k not in ("name", "clipped")]
    groups = {"all": pairs, "clean": [p for p in pairs if not p["clipped"]], "clipped": [p for p in pairs if p["clipped"]]}
    means = {g: {"pairs": len(ps), **{k: float(np.mean([p[k] for p in ps])) for k in keys}} for g, ps in groups.items() if ps}
    return {"pairs": pairs, "mean": means}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bundle", required=True, help="generator bundle")
    parser.add_argument("--mask", help="mask bundle")
    parser.add_argument("--data", nargs="*", default=[], help="folders of validation shards")
    parser.add_argument("--pictures", help="folder of picture pairs without scale")
    parser.add_argument("--count", type=int, default=96, help="samples per validation folder")
    parser.add_argument("--out", default="training/runs/evaluation")
    args = parser.parse_args()
    torch.set_num_threads(1)
    out = Path(args.out)
    out.mkdir(parents=True, exist_ok=True)
    bundle, masker = Bundle(args.bundle), Bundle(args.mask) if args.mask else None
    figures = {}
    for folder in args.data:
        name = Path(folder).name
        figures[name] = shards_figures(name, bundle, masker, data.Shards(folder), args.count, out)
    if args.pictures:
        figures["pictures"] = pictures_figures(bundle, masker, args.pictures, out)
    (out / "figures.json").write_text(json.dumps(figures, indent=1))
    short = {k: v if "mean" not in v else v["mean"] for k, v in figures.items()}
    print(json.dumps(short, indent=1))


if __name__ == "__main__":
    main()
