"""Command line: `python -m training.export {generator|mask} --run DIR --data DIR --out BUNDLE`.

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

from . import data, diffusion, models

OPSET = 17


class Decoder(nn.Module):
    """The autoencoder's decoder, with the whitening of the latents folded in."""

    def __init__(self, decoder, mean, std):
        super().__init__()
        self.decoder = decoder
        self.register_buffer("mean", mean)
        self.register_buffer("std", std)

    def forward(self, latent):
        return self.decoder(latent * self.std + self.mean)


def load_generator(run):
    """(condition encoder, denoiser, decoder) with averaged weights, and the states they came from."""
    ae = torch.load(Path(run) / "autoencoder.pt", weights_only=True)
    state = torch.load(Path(run) / "generator.pt", weights_only=True)
    encoder, denoiser, autoencoder = models.ConditionEncoder(), models.Denoiser(), models.Autoencoder()
    encoder.load_state_dict(state["nets"]["encoder_ema"])
    denoiser.load_state_dict(state["nets"]["denoiser_ema"])
    autoencoder.load_state_dict(ae["nets"]["autoencoder"])
    decoder = Decoder(autoencoder.decoder, state["extra"]["latent_mean"], state["extra"]["latent_std"])
    return encoder.eval(), denoiser.eval(), decoder.eval(), ae, state


def predict(nets, gelslim, steps=10, seed=42):
    """Imprints in metres, raw orientation, for standardised GelSlim images."""
    encoder, denoiser, decoder = nets
    with torch.no_grad():
        return data.from_model(decoder(diffusion.ddim(denoiser, encoder(gelslim), steps, seed)))


def write(net, path, inputs, output, examples):
    """Exports one graph with a dynamic batch; returns its manifest entry and the largest difference to torch."""
    axes = {name: {0: "batch"} for name in (*inputs, output)}
    torch.onnx.export(net, examples, str(path), input_names=list(inputs), output_names=[output], dynamic_axes=axes,
                      opset_version=OPSET, dynamo=False)
    onnx.checker.check_model(str(path), full_check=True)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    engine = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    worst = 0.0
    for batch in (1, 3):
        tried = [e[:1].repeat(batch, *[1] * (e.dim() - 1)) if e.dtype == torch.int64 else torch.randn(batch, *e.shape[1:])
                 for e in examples]
        with torch.no_grad():
            expected = net(*tried).numpy()
        got = engine.run([output], {n: t.numpy() for n, t in zip(inputs, tried)})[0]
        worst = max(worst, float(np.abs(got - expected).max()))
    if worst > 1e-3:
        raise SystemExit(f"{path}: ONNX Runtime differs from torch by {worst}")
    return {"path": path.name, "sha256": data.sha256(path)}, worst


def provenance(note, shards, states, differences):
    return {
        "note": note,
        "data": "simulated touches (examples/training_data.rs); the unseen tools are not among them",
        "shards": shards.record(),
        "runs": {name: {k: s[k] for k in ("step", "samples", "minutes", "losses", "seed")} for name, s in states.items()},
        "onnx_minus_torch_max": differences,
        "tools": {"torch": torch.__version__, "onnx_opset": OPSET},
        "licence": "MIT OR Apache-2.0",
    }


def generator(args, out):
    encoder, denoiser, decoder, ae, state = load_generator(args.run)
    shards = data.Shards(args.data)
    files, differences = {}, {}
    graphs = {
        "condition_encoder": (encoder, ("gelslim",), "condition", (torch.randn(2, 3, 128, 128),)),
        "denoiser": (denoiser, ("latent", "timestep", "condition"), "prediction",
                     (torch.randn(2, 4, 16, 16), torch.tensor([1, 999]), torch.randn(2, models.CONDITION, 16, 16))),
        "decoder": (decoder, ("latent",), "image", (torch.randn(2, 4, 16, 16),)),
    }
    for role, (net, inputs, output, examples) in graphs.items():
        files[role], differences[role] = write(net, out / f"{role}.onnx", inputs, output, examples)
    # Statistics for the paper's shift, on training touches of the nominal sensors.
    nominal = np.flatnonzero(shards.meta[:, 6] == 1)
    chosen = np.sort(np.random.default_rng(args.seed).choice(nominal, min(256, len(nominal)), replace=False))
    predicted = torch.cat([predict((encoder, denoiser, decoder), shards.gelslim(chosen[i:i + 32]))
                           for i in range(0, len(chosen), 32)]).double()
    measured = shards.metres("imprint", chosen).double()
    return {
        "format": "touch2touch-bundle", "format_version": 1, "kind": "generator",
        "name": "Latent diffusion, simulated data", "files": files,
        "input": {"sensor": "gelslim", "size": [128, 128], "scale": "0..1", "mean": list(data.MEAN),
                  "std": list(data.STD), "resampling": "bilinear", "rotation_deg": 0},
        "condition": {"shape": [models.CONDITION, 16, 16]},
        "latent": {"shape": [models.LATENT, 16, 16], "scale_factor": 1.0},
        "schedule": {"kind": "scaled_linear", "steps": diffusion.STEPS, "beta_start": diffusion.BETA_START,
                     "beta_end": diffusion.BETA_END},
        "prediction": "v",
        "output": {"size": [128, 128], "channels": 1, "range_m": list(data.RANGE_M), "reduction": "mean",
                   "rotation_deg": 180, "imprint_size": [175, 140], "resampling": "bilinear"},
        "shift": {"pred_mean": (predicted.mean().item() + data.RANGE_M[1]) / 2,
                  "pred_std": predicted.std(correction=0).item() / 2,
                  "gt_mean": measured.mean().item(), "gt_std": measured.std(correction=0).item()},
        "defaults": {"steps": 10, "sampler": "ddim", "spacing": "trailing", "eta": 0.0, "seed": 42},
        "provenance": provenance(args.note, shards, {"autoencoder": ae, "generator": state}, differences),
    }


def mask(args, out):
    state = torch.load(Path(args.run) / "mask.pt", weights_only=True)
    net = models.MaskUNet()
    net.load_state_dict(state["nets"]["mask"])
    entry, difference = write(net.eval(), out / "mask_unet.onnx", ("imprint",), "logits", (torch.rand(2, 1, 140, 175),))
    return {
        "format": "touch2touch-bundle", "format_version": 1, "kind": "mask_unet",
        "name": "Mask UNet, simulated data", "files": {"mask_unet": entry},
        "input": {"sensor": "bubble", "size": [175, 140], "range_m": list(data.MASK_RANGE_M), "cast": "saturate",
                  "rotation_deg": 0},
        "output": {"classes": 2, "threshold": 0.5},
        "provenance": provenance(args.note, data.Shards(args.data), {"mask": state}, {"mask_unet": difference}),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("generator", "mask"))
    parser.add_argument("--run", default="training/runs/demo", help="folder of checkpoints")
    parser.add_argument("--data", default="training/data/train", help="folder of the training shards")
    parser.add_argument("--out", required=True, help="bundle folder to write")
    parser.add_argument("--note", default="", help="free text for the provenance")
    parser.add_argument("--seed", type=int, default=7, help="which training touches the shift statistics come from")
    args = parser.parse_args()
    torch.set_num_threads(1)
    out = Path(args.out)
    out.mkdir(parents=True, exist_ok=True)
    manifest = {"generator": generator, "mask": mask}[args.what](args, out)
    (out / "manifest.json").write_text(json.dumps(manifest, indent=2) + "\n")
    print(json.dumps({"bundle": str(out), "bytes": sum(f.stat().st_size for f in out.iterdir()),
                      "onnx_minus_torch_max": manifest["provenance"]["onnx_minus_torch_max"]}))


if __name__ == "__main__":
    main()
