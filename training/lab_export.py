"""The lab's released checkpoints to bundles that the app opens: `python -m training.lab_export KIND CHECKPOINT --out BUNDLE`.

KIND is `diffusion` (LDM naming: `checkpoint.ckpt` with `training_stats.pt` beside it), `vqvae` (`checkpoint.pt`, and
`tools.pt` if it is there) or `mask` (the mask UNet's `.pth`). CHECKPOINT is the file, or for the first two its folder.
Normalisation, range and shift come from the lab's own files; what no file holds is in the constants below.

`--self-test` converts tiny random checkpoints of every kind and checks them and the errors of damaged ones.
"""

import argparse
import json
import resource
import sys
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import torch
from torch import nn

from . import half, lab_models
from .export import OPSET
from .lab_checkpoint import LabError, Weights, empty, numbers, read, sha256

# The released VQ-VAE's evaluation script holds these itself; no file does. GelSlim: of differences / 255. Bubble: metres.
VQ_GELSLIM = {"mean": [-0.0082, -0.0059, -0.0066], "std": [0.0989, 0.0746, 0.0731]}
VQ_BUBBLE_MEAN, VQ_BUBBLE_STD = 0.00382, 0.00424
# A bundle's picture lies in -1..1; standardised depths are divided by this so that nothing real is clamped (-30 to 38 mm).
VQ_SPAN = 8.0
# Depth that becomes 0 and 1 for the mask UNet, metres: fixed in the lab's code.
MASK_RANGE = [-0.0116, 0.0225]

# Parts of a latent diffusion checkpoint that prediction does not need: the schedule (recomputed from its ends), the
# first stage's encoder and loss, a second copy of the backbone.
UNUSED = ("alphas_cumprod", "sqrt_", "log_one_minus_alphas_cumprod", "posterior_", "lvlb_weights", "logvar",
          "first_stage_model.encoder.", "first_stage_model.quant_conv.", "first_stage_model.loss.", "cond_stage_model.resnet.")

# Largest difference allowed between torch and ONNX Runtime, in standard deviations of the output.
TOLERANCE, TOLERANCE_F16 = 1e-3, 0.05
# Largest share of cells for which another, about as near, code may be chosen.
TOLERANCE_CODES = 0.01


@dataclass
class Graph:
    """One graph of a bundle: its network, port names and one example of each input (batch of 1)."""

    net: nn.Module
    inputs: tuple
    output: str
    examples: tuple
    # Whether the output is a choice among codes, which rounding can change altogether.
    codes: bool = False


class Codes(nn.Module):
    """The VQ-VAE up to its quantised codes, as one product with the codebook: the nearest code has the largest score."""

    def __init__(self, net):
        super().__init__()
        self.encoder, self.book = net.encoder, net.codebook["embedding"].weight
        self.register_buffer("half_square", -0.5 * (self.book * self.book).sum(dim=1))

    def forward(self, gelslim):
        z = self.encoder(gelslim)
        height, width = lab_models.sides(z)
        depth = self.book.shape[1]
        score = nn.functional.linear(z.permute(0, 2, 3, 1).reshape(-1, depth), self.book, self.half_square)
        return self.book[score.argmax(dim=1)].reshape(-1, height, width, depth).permute(0, 3, 1, 2)


class Given(nn.Module):
    """The "denoiser" of a network that draws in one go: the clean latent is the condition. A graph must use its inputs."""

    def forward(self, latent, timestep, condition):
        return condition + 0.0 * (latent + timestep[:, None, None, None].float())


class Scaled(nn.Module):
    def __init__(self, net):
        super().__init__()
        self.net = net

    def forward(self, latent):
        return self.net(latent) / VQ_SPAN


def schedule(weights):
    """The manifest's schedule, from the betas in the checkpoint."""
    betas = weights.tensor("betas").double().reshape(-1)
    first, last = (float(f"{betas[i].item():.7g}") for i in (0, -1))
    wanted = torch.linspace(first**0.5, last**0.5, len(betas), dtype=torch.float64) ** 2
    if 0 < first <= last < 1 and torch.allclose(wanted, betas, rtol=1e-5, atol=0):
        return {"kind": "scaled_linear", "steps": len(betas), "beta_start": first, "beta_end": last}
    raise LabError(f"{weights.path}: betas: {len(betas)} values from {first} to {last} that are not scaled linear, as the lab's are; "
                   "the app's bundles know no others: train with those")


def shift(path):
    """Statistics of the paper's shift from the `stats.pt` that the lab's evaluation saves."""
    if path is None:
        return {}
    content = read(path)
    (gt_mean, gt_std), (pred_mean, pred_std) = (numbers(path, content, key, 2) for key in ("gt_stats", "pred_stats"))
    if min(gt_std, pred_std) <= 0:
        raise LabError(f"{path}: gt_stats, pred_stats: a deviation is not positive; give the file of a finished evaluation")
    return {"shift": {"pred_mean": pred_mean, "pred_std": pred_std, "gt_mean": gt_mean, "gt_std": gt_std}}


def inside(path, name):
    return path / name if path.is_dir() else path


def generator(name, path, graphs, **sections):
    """A manifest, but for the files; the name is the folder's, as the lab tells its runs apart by it."""
    latent, _, condition = (list(e.shape[1:]) for e in graphs["denoiser"].examples)
    folder = path.absolute().parent.name
    return {"format": "touch2touch-bundle", "format_version": 1, "kind": "generator", "name": f"{name} ({folder})", "files": {},
            "condition": {"shape": condition}, "latent": {"shape": latent, "scale_factor": sections.pop("scale", 1.0)}, **sections}


def diffusion(args, **widths):
    """Their latent diffusion: three graphs and the manifest. `widths`: of tiny networks, by network."""
    path = inside(args.checkpoint, "checkpoint.ckpt")
    stats_path = args.stats or path.parent / "training_stats.pt"
    stats = read(stats_path)
    mean, std = (numbers(stats_path, stats, f"gelslim_{what}", 3) for what in ("mean", "std"))
    (low,), (high,) = (numbers(stats_path, stats, f"bubbles_{what}", 1) for what in ("min", "max"))
    if min(std) <= 0:
        raise LabError(f"{stats_path}: gelslim_std: {std} must be positive; give the file that was saved with the checkpoint")
    if not low < high:
        raise LabError(f"{stats_path}: bubbles_min {low} is not below bubbles_max {high}; give the file saved with the checkpoint")
    shifted = shift(args.shift)

    weights = Weights(path, args.ignore)
    ema = not args.no_ema and any(k.startswith("model_ema.diffusion_model") for k in weights.state)
    unet = empty(lambda: lab_models.UNet(**widths.get("unet", {})))
    if ema:
        # The averages are stored under the names of the weights without their dots.
        weights.fill(unet, "model_ema.", lambda key: ("diffusion_model." + key).replace(".", ""))
        weights.taken |= {"model_ema.decay", "model_ema.num_updates", *("model.diffusion_model." + key for key in unet.state_dict())}
    else:
        weights.fill(unet, "model.diffusion_model.")
    first = weights.fill(empty(lambda: lab_models.FirstStage(**widths.get("first", {}))), "first_stage_model.")
    condition = weights.fill(empty(lambda: lab_models.ResnetCondition(**widths.get("condition", {}))), "cond_stage_model.")
    betas = schedule(weights)
    scale = 1.0
    if "scale_factor" in weights.state:
        scale = float(f"{weights.tensor('scale_factor').item():.7g}")
        if not (np.isfinite(scale) and scale > 0):
            raise LabError(f"{path}: scale_factor: {scale} is not positive; the checkpoint is damaged: copy it again")
    elif args.scale_factor:
        scale = args.scale_factor
    else:
        raise LabError(f"{path}: scale_factor: missing; latents were scaled by it in training: pass --scale-factor VALUE "
                       "(0.18215 for the public autoencoder, 1 if training did not scale)")
    weights.finish(UNUSED if ema else (*UNUSED, "model_ema."))

    embed = first.post_quant_conv.in_channels
    cells = 256 // 8
    latent = torch.randn(1, embed, cells, cells)
    c = torch.randn(1, condition.deconv2.out_channels, cells, cells)
    graphs = {
        "condition_encoder": Graph(condition, ("gelslim",), "condition", (torch.randn(1, 3, 256, 256),)),
        "denoiser": Graph(unet, ("latent", "timestep", "condition"), "prediction", (latent, torch.tensor([500]), c)),
        "decoder": Graph(first, ("latent",), "image", (latent,)),
    }
    notes = []
    if max(std) < 1 and args.input_scale == "0..255":
        notes.append("gelslim_std is below 1 although the lab's estimator applies it to differences of 0..255; if predictions "
                     "make no sense, try --input-scale 0..1")
    manifest = generator(
        "Lab latent diffusion", path, graphs, scale=scale,
        input={"sensor": "gelslim", "size": [256, 256], "scale": args.input_scale, "mean": mean, "std": std,
               "resampling": "bicubic", "rotation_deg": 0},
        schedule=betas, prediction="epsilon",
        output={"size": [256, 256], "channels": first.decoder.conv_out.out_channels, "range_m": [low, high], "reduction": "luma",
                "rotation_deg": args.rotation, "imprint_size": [175, 140], "resampling": "bilinear"},
        **shifted, defaults={"steps": 200, "sampler": "ddim", "spacing": "lab", "eta": 0.0, "seed": 42},
        provenance={"checkpoint": path.name, "checkpoint_sha256": sha256(path), **weights.beside,
                    "unet_weights": "exponential moving average" if ema else "as trained",
                    "statistics": {stats_path.name: {"gelslim_mean": mean, "gelslim_std": std, "bubbles_min": low, "bubbles_max": high}},
                    **({"shift_from": args.shift.name} if args.shift else {}), "notes": notes})
    return graphs, manifest


def vqvae(args, **widths):
    """Their VQ-VAE as a generator of one step: encoder and codebook, the codes themselves, decoder."""
    path = inside(args.checkpoint, "checkpoint.pt")
    shifted = shift(args.shift)
    weights = Weights(path, args.ignore)
    net = weights.fill(empty(lambda: lab_models.VqVae(**widths)))
    weights.finish()
    depth = net.codebook["embedding"].weight.shape[1]
    codes = torch.randn(1, depth, 32, 32)
    graphs = {
        "condition_encoder": Graph(Codes(net).eval(), ("gelslim",), "condition", (torch.randn(1, 3, 128, 128),), codes=True),
        "denoiser": Graph(Given(), ("latent", "timestep", "condition"), "prediction", (codes, torch.tensor([999]), codes + 1)),
        "decoder": Graph(Scaled(net.decoder).eval(), ("latent",), "image", (codes,)),
    }
    tools_path = path.parent / "tools.pt"
    tools = {}
    if tools_path.is_file():
        content = read(tools_path)
        tools = {k: [str(v) for v in content.get(k, [])] for k in ("train_tools", "test_tools")} if isinstance(content, dict) else {}
    reach = VQ_SPAN * VQ_BUBBLE_STD
    manifest = generator(
        "Lab VQ-VAE", path, graphs,
        input={"sensor": "gelslim", "size": [128, 128], "scale": "0..1", **VQ_GELSLIM, "resampling": "bilinear", "rotation_deg": 0},
        schedule={"kind": "scaled_linear", "steps": 1000, "beta_start": 0.0015, "beta_end": 0.0155}, prediction="sample",
        output={"size": [128, 128], "channels": 1, "range_m": [VQ_BUBBLE_MEAN - reach, VQ_BUBBLE_MEAN + reach], "reduction": "mean",
                "rotation_deg": 180, "imprint_size": [175, 140], "resampling": "bilinear"},
        **shifted, defaults={"steps": 1, "sampler": "ddim", "spacing": "trailing", "eta": 0.0, "seed": 42},
        provenance={"checkpoint": path.name, "checkpoint_sha256": sha256(path), **weights.beside, **tools,
                    "statistics": {"gelslim": VQ_GELSLIM, "bubble": [VQ_BUBBLE_MEAN, VQ_BUBBLE_STD]},
                    "notes": ["statistics are the constants of the released evaluation script; no file holds them"]})
    return graphs, manifest


def mask(args, **widths):
    """Their mask UNet."""
    path = args.checkpoint
    weights = Weights(path, args.ignore)
    net = weights.fill(empty(lambda: lab_models.MaskUNet(**widths)))
    weights.finish(("mask_values",))
    manifest = {
        "format": "touch2touch-bundle", "format_version": 1, "kind": "mask_unet", "name": "Lab mask UNet", "files": {},
        "input": {"sensor": "bubble", "size": [175, 140], "range_m": MASK_RANGE, "cast": args.cast, "rotation_deg": 0},
        "output": {"classes": 2, "threshold": 0.5},
        "provenance": {"checkpoint": path.name, "checkpoint_sha256": sha256(path), **weights.beside, "notes": []},
    }
    return {"mask_unet": Graph(net, ("imprint",), "logits", (torch.rand(1, 1, 140, 175),))}, manifest


KINDS = {"diffusion": diffusion, "vqvae": vqvae, "mask": mask}


def differences(got, expected, codes):
    """Largest absolute difference and the expected values' deviation; of codes, where the same was chosen."""
    gap = np.abs(got - expected)
    report = {"std": float(expected.std())}
    if codes:
        other = gap.max(axis=1) > 0.01 * expected.std()
        report["other_codes"] = float(other.mean())
        gap = gap * ~other[:, None]
    return {"max_abs": float(gap.max()), **report}


def tried(graph, batch):
    """Inputs for a comparison: the examples' shapes, standard normal, and steps from one end to the other."""
    noise = torch.Generator().manual_seed(batch)
    return [torch.linspace(1, 999, batch).round().long() if e.dtype == torch.int64
            else torch.rand(batch, *e.shape[1:], generator=noise) if "imprint" in graph.inputs
            else torch.randn(batch, *e.shape[1:], generator=noise) for e in graph.examples]


def write(graph, path, f16):
    """Exports one graph with a dynamic batch; returns how far ONNX Runtime is from torch."""
    axes = {name: {0: "batch"} for name in (*graph.inputs, graph.output)}
    with warnings.catch_warnings():
        # Fixed sides are meant; the older exporter is the one whose graphs both engines are tested with.
        warnings.simplefilter("ignore")
        torch.onnx.export(graph.net, graph.examples, str(path), input_names=list(graph.inputs), output_names=[graph.output],
                          dynamic_axes=axes, opset_version=OPSET, dynamo=False)
    # Rounding would choose other codes, each a different picture, in about a hundredth of the cells.
    f16 = f16 and not graph.codes
    if f16:
        half.store(path)
    onnx.checker.check_model(str(path))
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = torch.get_num_threads()
    engine = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    # Exported with a batch of one, so that two show that the batch is dynamic.
    inputs = tried(graph, 2)
    with torch.no_grad():
        expected = graph.net(*inputs).numpy()
    found = differences(engine.run([graph.output], {n: t.numpy() for n, t in zip(graph.inputs, inputs)})[0], expected, graph.codes)
    allowed = (TOLERANCE_F16 if f16 else TOLERANCE) * found["std"]
    if not found["max_abs"] <= allowed:
        raise LabError(f"{path}: ONNX Runtime differs from torch by {found['max_abs']:.2g} (allowed {allowed:.2g}); "
                       + ("export without --fp16" if f16 else "report it with the versions of torch and onnxruntime"))
    if graph.codes and found["other_codes"] > TOLERANCE_CODES:
        raise LabError(f"{path}: ONNX Runtime chooses another code than torch in {100 * found['other_codes']:.1f} % of the cells; "
                       "report it with the versions of torch and onnxruntime")
    return found


def export(graphs, manifest, out, f16):
    """Writes the bundle."""
    out.mkdir(parents=True, exist_ok=True)
    provenance = manifest["provenance"]
    provenance["onnx_minus_torch"] = {}
    for role, graph in graphs.items():
        path = out / f"{role}.onnx"
        provenance["onnx_minus_torch"][role] = write(graph, path, f16)
        manifest["files"][role] = {"path": path.name, "sha256": sha256(path)}
    provenance["stored_as"] = "large weights float16 (not those that choose codes), computed in float32" if f16 else "float32"
    provenance["tools"] = {"torch": torch.__version__, "onnx_opset": OPSET}
    provenance["licence"] = "that of the checkpoint; ask its authors before passing the bundle on"
    (out / "manifest.json").write_text(json.dumps(manifest, indent=2) + "\n")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=tuple(KINDS), nargs="?")
    parser.add_argument("checkpoint", type=Path, nargs="?", help="the file, or its folder")
    parser.add_argument("--out", type=Path, help="bundle folder to write")
    parser.add_argument("--fp16", action="store_true", help="store large weights in 16 bits (half the size; computed in 32 bits)")
    parser.add_argument("--ignore", action="append", default=[], metavar="PREFIX", help="keys that begin so are not needed")
    parser.add_argument("--shift", type=Path, metavar="STATS.PT", help="statistics of the paper's shift (gt_stats, pred_stats)")
    parser.add_argument("--self-test", action="store_true")
    ldm = parser.add_argument_group("diffusion")
    ldm.add_argument("--stats", type=Path, help="training statistics (default: training_stats.pt beside the checkpoint)")
    ldm.add_argument("--no-ema", action="store_true", help="take the UNet's weights as trained, not their averages")
    ldm.add_argument("--input-scale", choices=("0..255", "0..1"), default="0..255",
                     help="scale of the differences that gelslim_mean and gelslim_std are applied to (the lab's estimator: 0..255)")
    ldm.add_argument("--rotation", type=int, choices=(0, 180), default=0, help="of the picture, to the files' raw orientation")
    ldm.add_argument("--scale-factor", type=float, help="of the latents, if the checkpoint does not hold it")
    unet = parser.add_argument_group("mask")
    unet.add_argument("--cast", choices=("wrap", "saturate"), default="wrap",
                      help="8-bit cast of imprints beyond 22.5 mm: as the lab's evaluation (wrap), or without its wrap-around")
    return parser


def main():
    parser = arguments()
    args = parser.parse_args()
    if args.self_test:
        from . import lab_self_test

        lab_self_test.run()
        return
    if not (args.kind and args.checkpoint and args.out):
        parser.error("give KIND, CHECKPOINT and --out")
    begun = time.monotonic()
    try:
        graphs, manifest = KINDS[args.kind](args)
        export(graphs, manifest, args.out, args.fp16)
    except LabError as err:
        sys.exit(f"error: {err}")
    for note in manifest["provenance"]["notes"]:
        print(f"note: {note}", file=sys.stderr)
    print(json.dumps({
        "bundle": str(args.out), "bytes": {f.name: f.stat().st_size for f in sorted(args.out.iterdir())},
        "onnx_minus_torch": manifest["provenance"]["onnx_minus_torch"], "seconds": round(time.monotonic() - begun, 1),
        # Mapped pages of the checkpoint are counted too; the system can drop them.
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024}, indent=1))


if __name__ == "__main__":
    main()
