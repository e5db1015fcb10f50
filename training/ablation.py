"""Command line: `python -m training.ablation --from BUNDLE --data DIR --test DIR --out DIR [--steps N]`.

One short run for each dataset condition of the paper's Table I and each switch of its ablation (Table III), all with
the same number of steps, and a table of what came out (`ablation.json`, and printed as Markdown).

`--data` and `--test` hold one folder of shards per condition: `plain`, `ambiguous`, `misaligned` (`touch2touch
training-data` writes them; README.md). Conditions and turns go on from an exported generator; the geometry runs begin from scratch
with the L1 UNet, because a condition encoder knows where the GelSlim lies and would have to unlearn it first.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import torch

from . import baselines, data, diffusion, export, latent
from .evaluate import PEAK_M, psnr

# Name, what is trained, folders of training shards, switches.
RUNS = (
    ("plain", "generator", ("plain",), {}),
    ("ambiguous", "generator", ("ambiguous",), {}),
    ("mixed", "generator", ("plain", "ambiguous", "misaligned"), {}),
    ("misaligned", "generator", ("misaligned",), {}),
    ("noise", "generator", ("plain",), {"condition_noise": 0.5}),
    ("no rotation", "generator", ("plain",), {"rotation": False}),
    ("no flip", "generator", ("plain",), {"flip": False}),
    ("geometry full", "l1unet", ("plain",), {}),
    ("geometry padding", "l1unet", ("plain",), {"geometry": "padding"}),
    ("geometry cropping", "l1unet", ("plain",), {"geometry": "cropping"}),
)


def gathered(root, conditions, out):
    """A folder of links to the shards of several conditions."""
    folder = out / "shards" / "_".join(conditions)
    folder.mkdir(parents=True, exist_ok=True)
    for condition in conditions:
        for shard in sorted((Path(root) / condition).iterdir()):
            link = folder / f"{condition}_{shard.name}"
            if not link.exists():
                link.symlink_to(shard.resolve(), target_is_directory=True)
    return folder


def drawn(what, folder, gelslim, geometry):
    """Model images (N,1,128,128) of the run in `folder`."""
    if what == "generator":
        nets = export.load_generator(folder)[:3]
        with torch.no_grad():
            return torch.cat([nets[2](diffusion.ddim(nets[1], nets[0](g), 10)) for g in gelslim.split(16)])
    net = baselines.L1UNet()
    net.load_state_dict(torch.load(folder / "l1unet.pt", weights_only=True)["nets"]["l1unet"])
    if geometry == "padding":
        gelslim = data.padded(gelslim)
    with torch.no_grad():
        return torch.cat([net.eval()(g) for g in gelslim.split(16)])


def decibels(images, truth):
    """Mean PSNR of model images, in metres with the lab's peak."""
    scale = (data.RANGE_M[1] - data.RANGE_M[0]) / 2
    return float(np.mean([psnr(a.clamp(-1, 1) * scale, b * scale, PEAK_M) for a, b in zip(images, truth)]))


def figures(what, folder, options, tests):
    """PSNR to the noise-free imprint on each test set, plain and in random turns; and within the GelSlim's view."""
    geometry = options.get("geometry", "full")
    found = {}
    for name, shards in tests.items():
        every = np.arange(len(shards))
        gelslim, truth = shards.gelslim(every), data.to_model(shards.metres("clean", every), shards.offsets(every))
        noise = options.get("condition_noise", 0.0)
        noisy = gelslim + noise * torch.from_numpy(np.random.default_rng(5).standard_normal(gelslim.shape, dtype=np.float32))
        images = drawn(what, folder, noisy, geometry)
        if geometry == "cropping":
            found[name] = {"in_view_db": decibels(images, data.cropped(truth))}
            continue
        found[name] = {"psnr_db": decibels(images, truth), "in_view_db": decibels(data.cropped(images), data.cropped(truth))}
        if name == "plain":
            k = np.random.default_rng(6).integers(1, 8, len(every))
            turned = drawn(what, folder, data.each_dihedral(noisy, k), geometry)
            found[name]["turned_db"] = decibels(turned, data.each_dihedral(truth, k))
    return found


def train(what, args, folder, options, shards):
    run = argparse.Namespace(data=str(shards), out=str(folder), minutes=0, steps=args.steps, seed=args.seed, bf16=False,
                             start=args.start if what == "generator" else None, turned=0.5, rotation=True, flip=True,
                             geometry="full", frame="window", condition_noise=0.0, rate=None)
    vars(run).update(options)
    torch.manual_seed(args.seed)
    if what == "generator":
        known = Path(args.autoencoder)
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / "autoencoder.pt").exists():
            (folder / "autoencoder.pt").symlink_to(known.resolve())
        latent.generator(run)
    else:
        baselines.l1unet(run)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--from", dest="start", required=True, help="generator bundle to go on from")
    parser.add_argument("--autoencoder", required=True, help="checkpoint autoencoder.pt of the run behind that bundle")
    parser.add_argument("--data", required=True)
    parser.add_argument("--test", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--steps", type=int, default=120, help="optimiser steps per run, 16 samples each")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    torch.set_num_threads(1)
    out = Path(args.out)
    tests = {path.name: data.Shards(path) for path in sorted(Path(args.test).iterdir())}
    results = {}
    for name, what, conditions, options in RUNS:
        folder = out / name.replace(" ", "_")
        train(what, args, folder, options, gathered(args.data, conditions, out))
        results[name] = {"network": what, "data": conditions, "options": options, "tests": figures(what, folder, options, tests)}
        (out / "ablation.json").write_text(json.dumps(results, indent=1))
        print(name, json.dumps(results[name]["tests"]), flush=True)


if __name__ == "__main__":
    main()
