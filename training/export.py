"""Command line: `python -m training.export NAME --run DIR --data DIR --out BUNDLE`, NAME as for `training.train`.

Writes the ONNX graphs and the manifest of a bundle, and checks every graph against torch with ONNX Runtime.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import torch
from torch import nn

from . import baselines, data, diffusion, half, models, weights

OPSET = 17


class OneShot(nn.Module):
    """The "denoiser" of a network that draws in one go: always the v that leads to the condition itself.

    With x = a z + s e and z the condition, v = a e - s z = (a x - z) / s. Every sampler ends at the condition.
    """

    def __init__(self):
        super().__init__()
        bars = torch.from_numpy(diffusion.alpha_bar())
        self.register_buffer("weights", torch.stack([(bars / (1 - bars)).sqrt(), -1 / (1 - bars).sqrt()], dim=1).float())

    def forward(self, latent, timestep, condition):
        w = self.weights[timestep][:, :, None, None]
        return w[:, :1] * latent + w[:, 1:] * condition


class Codes(nn.Module):
    """The VQ-VAE up to its quantised codes."""

    def __init__(self, net):
        super().__init__()
        self.net = net

    def forward(self, gelslim):
        return self.net.quantise(self.net.features(gelslim))


class Picture(nn.Module):
    """The picture as it is; a graph must hold an operator."""

    def forward(self, latent):
        return latent * 1.0


class Padded(nn.Module):
    """A network whose GelSlim image is first drawn where the sensor lies in the bubble's view."""

    def __init__(self, net):
        super().__init__()
        self.net = net
        self.rows, self.columns = (nn.Buffer(m) for m in data.shrunk())

    def forward(self, gelslim):
        return self.net(self.rows @ gelslim @ self.columns)


class Cropped(nn.Module):
    """A decoder of the GelSlim's view alone, drawn where it lies in the bubble's view; around it no imprint, 0 m."""

    def __init__(self, net):
        super().__init__()
        self.net = net
        self.rows, self.columns = (nn.Buffer(m) for m in data.shrunk())
        low, high = data.RANGE_M
        self.nothing = -(high + low) / (high - low)

    def forward(self, latent):
        return self.rows @ (self.net(latent).clamp(-1, 1) - self.nothing) @ self.columns + self.nothing


def placed(nets, geometry):
    """Condition encoder, denoiser and decoder of another geometry as ones of whole pictures, as every bundle has them."""
    encoder, denoiser, decoder = nets
    wrapped = {"full": (encoder, decoder), "padding": (Padded(encoder), decoder), "cropping": (encoder, Cropped(decoder))}
    encoder, decoder = wrapped[geometry]
    return encoder.eval(), denoiser, decoder.eval()


class Named(nn.Module):
    """The classifier with what its last layer sees, averaged over the cells: sets of imprints are compared by it."""

    FEATURES = 96

    def __init__(self, net):
        super().__init__()
        self.net = net

    def forward(self, imprint):
        maps = self.net.body[:-2](imprint)
        return self.net.body[-2:](maps), maps.mean(dim=(2, 3))


def bundle_nets(folder):
    """(condition encoder, denoiser, decoder) of a bundle of this architecture."""
    nets = models.generator()
    for net, role in zip(nets, ("condition_encoder", "denoiser", "decoder")):
        weights.load(net, Path(folder) / f"{role}.onnx")
    return nets


def generator_nets(run):
    """(condition encoder, denoiser, decoder) with averaged weights, and the states that they came from by name.

    As tuned through the sampler, where that stage has begun.
    """
    states = {name: torch.load(path, weights_only=True, map_location="cpu") for name in ("autoencoder", "generator", "sampler")
              if (path := Path(run) / f"{name}.pt").exists()}
    known, extra = states.get("sampler") or states.get("generator"), states.get("generator", {}).get("extra", {})
    if not known or "sampler" not in states and "autoencoder" not in states:
        raise SystemExit(f"{run} holds neither sampler.pt nor autoencoder.pt and generator.pt: train them first")
    nets = encoder, denoiser, decoder = models.generator()
    if "sampler" in states:
        decoder.load_state_dict(known["nets"]["decoder_ema"])
    else:
        ae = states["autoencoder"]["nets"]["autoencoder"]
        decoder.load_state_dict({k: v for k, v in ae.items() if k.startswith("decoder.")}
                                | {"mean": extra["latent_mean"], "std": extra["latent_std"]})
    encoder.load_state_dict(known["nets"]["encoder_ema"])
    denoiser.load_state_dict(known["nets"]["denoiser_ema"])
    return tuple(net.eval() for net in nets), states


def predict(nets, gelslim, offsets, steps=10, seed=42, shape=(4, 16, 16)):
    """Imprints in metres, raw orientation, for standardised GelSlim images."""
    encoder, denoiser, decoder = nets
    with torch.no_grad():
        return data.from_model(decoder(diffusion.ddim(denoiser, encoder(gelslim), steps, seed, shape)), offsets)


# Largest allowed difference to torch, for standard normal inputs: rounding, or weights stored in 16 bits.
TOLERANCE, TOLERANCE_F16 = 1e-3, 0.05


def write(net, path, inputs, outputs, examples, f16=False):
    """Exports one graph with a dynamic batch; returns its manifest entry and the largest difference to torch."""
    outputs = [outputs] if isinstance(outputs, str) else list(outputs)
    axes = {name: {0: "batch"} for name in (*inputs, *outputs)}
    torch.onnx.export(net, examples, str(path), input_names=list(inputs), output_names=outputs, dynamic_axes=axes,
                      opset_version=OPSET, dynamo=False)
    if f16:
        half.store(path)
    onnx.checker.check_model(str(path), full_check=True)
    # A training on a GPU lets products be rounded; here graphs are compared.
    torch.set_float32_matmul_precision("highest")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    engine = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    worst = 0.0
    for batch in (1, 3):
        tried = [e[:1].repeat(batch, *[1] * (e.dim() - 1)) if e.dtype == torch.int64 else torch.randn(batch, *e.shape[1:])
                 for e in examples]
        with torch.no_grad():
            expected = net(*tried)
        got = engine.run(outputs, {n: t.numpy() for n, t in zip(inputs, tried)})
        expected = expected if isinstance(expected, tuple) else (expected,)
        worst = max(worst, *(float(np.abs(a - b.numpy()).max()) for a, b in zip(got, expected, strict=True)))
    if worst > (TOLERANCE_F16 if f16 else TOLERANCE):
        raise SystemExit(f"{path}: ONNX Runtime differs from torch by {worst}")
    return {"path": path.name, "sha256": data.sha256(path)}, worst


def sources(record):
    """What the shards hold, in words."""
    real, mixes = real_sources(record), {r["mix"] for r in record if "mix" in r}
    parts = [f"real touches of {', '.join(real)}"] if real else []
    if mixes:
        parts.append("simulated touches; the unseen tools are " + ("among them" if "unseen" in mixes else "not among them"))
    return "; ".join(parts)


def real_sources(record):
    """The real data sets among the shards; older shards are the simulator's and say nothing of it."""
    return sorted({r.get("source", "simulator") for r in record} - {"simulator"})


def titled(name, shards):
    """The bundle's name: what it is, and what it learned from."""
    real = real_sources(shards.record())
    return f"{name}, {', '.join(real)}" if real else f"{name}, simulated data"


# What shards of one kind say alike; all else of them is summed, listed or left out.
KIND = ("source", "mix", "condition", "simulator", "version")


def summed(record):
    """The shards' own descriptions in one entry for each kind: shards, touches, contact by how it is known, and seeds."""
    kinds = {}
    for about in record:
        kind = {"source": "simulator"} | {key: about[key] for key in KIND if key in about}
        empty = kind | {"shards": 0, "touches": 0, "contact": {}, "seeds": set()}
        entry = kinds.setdefault(json.dumps(kind, sort_keys=True), empty)
        entry["shards"] += 1
        entry["touches"] += about["samples"]
        for how, count in about.get("contact", {}).items():
            entry["contact"][how] = entry["contact"].get(how, 0) + count
        entry["seeds"] |= {about["seed"]} if "seed" in about else set()
    return [{**entry, "seeds": ranges(entry["seeds"])} for entry in kinds.values()]


def ranges(numbers):
    """Whole numbers in words: `1-4, 7`."""
    runs = []
    for number in sorted(numbers):
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in runs)


def provenance(note, shards, states, differences):
    record = shards.record()
    return {
        "note": note,
        "data": sources(record),
        "shards": summed(record),
        "runs": {name: {k: s[k] for k in ("step", "samples", "minutes", "losses", "seed", "options") if k in s} for name, s in states.items()},
        "onnx_minus_torch_max": differences,
        "tools": {"torch": torch.__version__, "onnx_opset": OPSET},
        "licence": "MIT OR Apache-2.0",
    }


def generator_bundle(args, out, name, nets, shapes, steps, states):
    """Writes the three graphs; the manifest. `shapes`: of condition and latent, each (C,H,W)."""
    encoder, denoiser, decoder = nets
    shards = data.Shards(args.data)
    files, differences = {}, {}
    graphs = {
        "condition_encoder": (encoder, ("gelslim",), "condition", (torch.randn(2, 3, 128, 128),)),
        "denoiser": (denoiser, ("latent", "timestep", "condition"), "prediction",
                     (torch.randn(2, *shapes[1]), torch.tensor([1, 999]), torch.randn(2, *shapes[0]))),
        "decoder": (decoder, ("latent",), "image", (torch.randn(2, *shapes[1]),)),
    }
    for role, (net, inputs, output, examples) in graphs.items():
        files[role], differences[role] = write(net, out / f"{role}.onnx", inputs, output, examples, args.fp16)
    # Statistics for the paper's shift, on training touches of the sensors that it will run on: the real ones where there are
    # any, else the simulator's nominal ones.
    usual = next(found for kind in (3, 1, 0) if len(found := np.flatnonzero(shards.meta[:, 6] == kind)))
    chosen = np.sort(np.random.default_rng(args.seed).choice(usual, min(256, len(usual)), replace=False))
    framed = all(state["options"].get("frame") == "window" for state in states.values())
    parts = [chosen[i:i + 32] for i in range(0, len(chosen), 32)]
    predicted = torch.cat([predict(nets, shards.gelslim(part), shards.offsets(part) if framed else None, steps, shape=shapes[1])
                           for part in parts]).double()
    measured = shards.metres("imprint", chosen).double()
    return {
        "format": "touch2touch-bundle", "format_version": 1, "kind": "generator", "name": titled(name, shards), "files": files,
        "input": {"sensor": "gelslim", "size": [128, 128], "scale": "0..1", "mean": list(data.MEAN),
                  "std": list(data.STD), "resampling": "bilinear", "rotation_deg": 0},
        "condition": {"shape": list(shapes[0])},
        "latent": {"shape": list(shapes[1]), "scale_factor": 1.0},
        "schedule": {"kind": "scaled_linear", "steps": diffusion.STEPS, "beta_start": diffusion.BETA_START,
                     "beta_end": diffusion.BETA_END},
        "prediction": "v",
        "output": {"size": [128, 128], "channels": 1, "range_m": list(data.RANGE_M), "reduction": "mean",
                   "rotation_deg": 180, "imprint_size": [175, 140], "resampling": "bilinear",
                   **({"window_px": list(data.FRAME_PX)} if framed else {})},
        "shift": {"pred_mean": (predicted.mean().item() + data.RANGE_M[1]) / 2,
                  "pred_std": predicted.std(correction=0).item() / 2,
                  "gt_mean": measured.mean().item(), "gt_std": measured.std(correction=0).item()},
        "defaults": {"steps": steps, "sampler": args.sampler, "spacing": "trailing", "eta": 0.0, "seed": 42},
        "provenance": provenance(args.note, shards, states, differences),
    }


def averaged(nets, args):
    """Mixes the weights with those of the bundle that the run began from: keeps what it knew beside what is new."""
    for net, role, prefix in zip(nets, ("condition_encoder", "denoiser", "decoder"), ("", "", "decoder.")):
        net = getattr(net, "decoder", net)
        own = {k: v.clone() for k, v in net.state_dict().items()}
        weights.load(net, Path(args.average_with) / f"{role}.onnx", prefix)
        net.load_state_dict({k: torch.lerp(v, own[k], args.share) for k, v in net.state_dict().items()})


def generator(args, out):
    nets, states = generator_nets(args.run)
    if args.average_with:
        averaged(nets, args)
    shapes = (models.CONDITION, 16, 16), (models.LATENT, 16, 16)
    (geometry,) = {state["options"]["geometry"] for state in states.values()}
    return generator_bundle(args, out, "Latent diffusion", placed(nets, geometry), shapes, args.steps, states)


def one_shot(args, out):
    """A baseline that draws in one go, as a generator whose denoiser leads any sampler to the drawn picture."""
    state = torch.load(Path(args.run) / f"{args.what}.pt", weights_only=True, map_location="cpu")
    net = baselines.VqVae() if args.what == "vqvae" else baselines.L1UNet()
    net.load_state_dict(state["nets"][args.what])
    net = net.eval()
    if args.what == "vqvae":
        nets, shape = (Codes(net), OneShot(), net.decoder), (net.book.shape[1], 16, 16)
    else:
        nets, shape = (net, OneShot(), Picture()), (1, 128, 128)
    nets = placed(nets, state["options"]["geometry"])
    title = {"vqvae": "VQ-VAE", "l1unet": "L1 UNet", "visgel": "VisGel"}[args.what]
    return generator_bundle(args, out, title, nets, (shape, shape), 1, {args.what: state})


def classifier(args, out):
    state = torch.load(Path(args.run) / "classifier.pt", weights_only=True, map_location="cpu")
    net, shards = baselines.Classifier(), data.Shards(args.data)
    net.load_state_dict(state["nets"]["classifier"])
    entry, difference = write(Named(net.eval()), out / "tool_classifier.onnx", ("imprint",), ("logits", "features"),
                              (torch.rand(2, 1, 128, 128),), args.fp16)
    return {
        "format": "touch2touch-bundle", "format_version": 1, "kind": "tool_classifier",
        "name": titled("Tool classifier", shards), "files": {"tool_classifier": entry},
        "input": {"sensor": "bubble", "size": [128, 128], "range_m": list(data.RANGE_M), "rotation_deg": 180},
        "output": {"classes": list(baselines.NAMES), "features": Named.FEATURES},
        "provenance": provenance(args.note, shards, {"classifier": state}, {"tool_classifier": difference}),
    }


def mask(args, out):
    state = torch.load(Path(args.run) / "mask.pt", weights_only=True, map_location="cpu")
    net, shards = models.MaskUNet(), data.Shards(args.data)
    net.load_state_dict(state["nets"]["mask"])
    entry, difference = write(net.eval(), out / "mask_unet.onnx", ("imprint",), "logits", (torch.rand(2, 1, 140, 175),), args.fp16)
    return {
        "format": "touch2touch-bundle", "format_version": 1, "kind": "mask_unet",
        "name": titled("Mask UNet", shards), "files": {"mask_unet": entry},
        "input": {"sensor": "bubble", "size": [175, 140], "range_m": list(data.MASK_RANGE_M), "cast": "saturate",
                  "rotation_deg": 0},
        "output": {"classes": 2, "threshold": 0.5},
        "provenance": provenance(args.note, shards, {"mask": state}, {"mask_unet": difference}),
    }


WHAT = {"generator": generator, "mask": mask, "l1unet": one_shot, "visgel": one_shot, "vqvae": one_shot, "classifier": classifier}


def bundle(args):
    """Writes a bundle; returns its manifest, which is written last."""
    out = Path(args.out)
    out.mkdir(parents=True, exist_ok=True)
    manifest = WHAT[args.what](args, out)
    (out / "manifest.json").write_text(json.dumps(manifest, indent=2) + "\n")
    return manifest


def parser():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=tuple(WHAT))
    parser.add_argument("--run", default="training/runs/demo", help="folder of checkpoints")
    parser.add_argument("--data", nargs="+", default=["training/data/train"], help="folders of the training shards")
    parser.add_argument("--out", required=True, help="bundle folder to write")
    parser.add_argument("--fp16", action="store_true", help="store large weights in 16 bits (half the size)")
    parser.add_argument("--average-with", help="generator bundle that the run began from (`--from`); its weights are mixed in")
    parser.add_argument("--share", type=float, default=0.5, help="the run's own share of that mixture")
    parser.add_argument("--steps", type=int, default=10, help="default sampling steps of a diffusion bundle")
    parser.add_argument("--sampler", default="ddim", help="its default sampler: ddim or ddpm")
    parser.add_argument("--note", default="", help="free text for the provenance")
    parser.add_argument("--seed", type=int, default=7, help="which training touches the shift statistics come from")
    return parser


def main():
    args = parser().parse_args()
    torch.set_num_threads(1)
    manifest, out = bundle(args), Path(args.out)
    print(json.dumps({"bundle": str(out), "bytes": sum(f.stat().st_size for f in out.iterdir()),
                      "onnx_minus_torch_max": manifest["provenance"]["onnx_minus_torch_max"]}))


if __name__ == "__main__":
    main()
