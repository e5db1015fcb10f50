"""PyTorch against the app's two engines, for a checkpoint of the lab and bundles made from it.

    python -m training.lab_compare KIND CHECKPOINT --bundles BUNDLE... --data DATASET

Compares every graph on random inputs, and one whole generation as `touch2touch generate` makes it with the same noise.
Needs the two programs (see `--programs`) and a dataset in the lab's layout, for example one of `touch2touch simulate`.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import onnxruntime
import torch
import torch.nn.functional as F

from . import lab_export
from .lab_checkpoint import LabError, read

LUMA = (0.2989, 0.587, 0.114)


def run(command):
    """Standard output and peak memory (MiB) of a program."""
    library = sorted(Path(onnxruntime.__file__).parent.glob("capi/libonnxruntime.so*"))
    env = {**os.environ, **({"ORT_DYLIB_PATH": str(library[0])} if library else {})}
    with tempfile.TemporaryFile() as out:
        child = subprocess.Popen([str(c) for c in command], stdout=out, env=env)
        peak = None
        while child.poll() is None:
            peak = high_water(child.pid) or peak
            time.sleep(0.05)
        if child.returncode:
            raise LabError(f"{' '.join(map(str, command))} ended with {child.returncode}; what it wrote is above")
        out.seek(0)
        return out.read().decode(), peak


def high_water(pid):
    """Peak memory of a running program so far, MiB; only Linux tells."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return None
    return next((int(line.split()[1]) // 1024 for line in status.splitlines() if line.startswith("VmHWM")), None)


def visited(manifest, steps):
    """(step, signal power there, signal power after it) of a sampler's steps, as the app visits them."""
    s = manifest["schedule"]
    betas = np.linspace(s["beta_start"] ** 0.5, s["beta_end"] ** 0.5, s["steps"]) ** 2
    if s["kind"] == "linear":
        betas = np.linspace(s["beta_start"], s["beta_end"], s["steps"])
    bars, total = np.cumprod(1 - betas), s["steps"]
    if manifest["defaults"]["spacing"] == "lab":
        times = [t + 1 for t in range(0, total, total // steps) if t + 1 < total][::-1]
    else:
        times = [(2 * total * (steps - i) + steps) // (2 * steps) - 1 for i in range(steps)]
    return list(zip(times, bars[times], [*bars[times[1:]], 1.0]))


def generation(graphs, manifest, difference, noise, steps):
    """The imprint in metres (140,175), from a difference image (3,H,W) of 0..255: DDIM without fresh noise."""
    nets = {role: graph.net for role, graph in graphs.items()}
    given, out = manifest["input"], manifest["output"]
    width, height = given["size"]
    image = F.interpolate(difference[None].double(), (height, width), mode=given["resampling"], align_corners=False)
    column = lambda key: torch.tensor(given[key], dtype=torch.float64)[:, None, None]
    image = (image / (255 if given["scale"] == "0..1" else 1) - column("mean")) / column("std")
    condition = nets["condition_encoder"](image.float())
    x = torch.from_numpy(noise)[None]
    for t, now, after in visited(manifest, steps):
        found = nets["denoiser"](x.float(), torch.tensor([t]), condition).double()
        if manifest["prediction"] == "sample":
            clean, epsilon = found, (x - now**0.5 * found) / (1 - now) ** 0.5
        else:
            clean, epsilon = (x - (1 - now) ** 0.5 * found) / now**0.5, found
        x = after**0.5 * clean + (1 - after) ** 0.5 * epsilon
    picture = nets["decoder"]((x / manifest["latent"]["scale_factor"]).float()).double().clamp(-1, 1)
    low, high = out["range_m"]
    metres = (picture + 1) / 2 * (high - low) + low
    weights = torch.tensor(LUMA if out["reduction"] == "luma" else [1 / out["channels"]] * out["channels"], dtype=torch.float64)
    metres = (metres * weights[:, None, None]).sum(dim=1, keepdim=True)
    if out["reduction"] == "luma":
        # The app maps, then undoes, the released script's doubled range; luma's weights sum to 0.9999.
        metres = metres + high * (sum(LUMA) - 1)
    width, height = out["imprint_size"]
    metres = F.interpolate(metres, (height, width), mode=out["resampling"], align_corners=False)[0, 0]
    return (metres.flip(0, 1) if out["rotation_deg"] == 180 else metres).numpy()


def compare(args, folder):
    """Prints one JSON object per bundle and engine; files go to `folder`."""
    graphs, manifest = lab_export.KINDS[args.kind](args)
    inputs = {role: lab_export.tried(graph, 1) for role, graph in graphs.items()}
    np.savez(folder / "in.npz", **{f"{role}.{name}": value.numpy() for role, graph in graphs.items()
                                   for name, value in zip(graph.inputs, inputs[role])})
    expected, whole = {}, None
    with torch.no_grad():
        for role, graph in graphs.items():
            expected[role] = graph.net(*inputs[role]).numpy()
    for bundle in args.bundles:
        run([args.programs / "touch2touch", "bundle", "check", bundle])
        for engine in args.engines:
            found = folder / "out.npz"
            text, peak = run([args.programs / "examples" / "graph_outputs", bundle, engine, folder / "in.npz", found, args.seed])
            seconds = json.loads(text)
            row = {"bundle": bundle.name, "engine": engine, "graphs_peak_mib": peak, "graphs": {}}
            arrays = np.load(found)
            for role, graph in graphs.items():
                row["graphs"][role] = {**lab_export.differences(arrays[role], expected[role], graph.codes), **seconds[role]}
            if args.kind != "mask":
                out = folder / f"{bundle.name}_{engine}"
                _, peak = run([args.programs / "touch2touch", "generate", "--input", args.data, "--out", out, "--limit", 1,
                               "--finger", "right", "--steps", args.steps, "--seed", args.seed, "--runtime", engine,
                               "--bundle", bundle, "--shift", "exact"])
                report = json.loads((out / "generate.json").read_text())
                if whole is None:
                    name = report["pairs"][0]["name"]
                    paths = [p for p in args.data.rglob(Path(name).name + ".pt") if "gelslim" in str(p.relative_to(args.data))]
                    if not paths:
                        raise LabError(f"{args.data}: no GelSlim file of the pair {name}; give a dataset in the lab's layout")
                    sample = read(paths[0])
                    difference = sample["gelslim"][0].float() - sample["gelslim_ref"][0].float()
                    with torch.no_grad():
                        whole = generation(graphs, manifest, difference, arrays["noise"], args.steps)
                [made] = out.glob("*.npy")
                gap = np.abs(np.load(made) - whole)
                row["generation"] = {"steps": args.steps, "max_abs_mm": float(gap.max() * 1e3), "mean_abs_mm": float(gap.mean() * 1e3),
                                     "std_mm": float(whole.std() * 1e3), "seconds": report["pairs"][0]["seconds"], "peak_mib": peak}
            print(json.dumps(row), flush=True)


def main():
    parser = lab_export.arguments()
    parser.description = __doc__
    parser.add_argument("--bundles", type=Path, nargs="+", required=True)
    parser.add_argument("--data", type=Path, help="a dataset in the lab's layout; its first pair is generated")
    parser.add_argument("--engines", nargs="+", default=["rten", "ort"])
    parser.add_argument("--steps", type=int, default=4)
    parser.add_argument("--seed", type=int, default=42)
    parser.add_argument("--scratch", type=Path, help="where temporary files go")
    parser.add_argument("--programs", type=Path, default=Path("target/release"), help="folder of touch2touch and examples/graph_outputs")
    args = parser.parse_args()
    if not (args.kind and args.checkpoint and (args.data or args.kind == "mask")):
        parser.error("give KIND, CHECKPOINT and, but for the mask UNet, --data")
    try:
        with tempfile.TemporaryDirectory(prefix="lab_compare_", dir=args.scratch) as folder:
            compare(args, Path(folder))
    except LabError as err:
        sys.exit(f"error: {err}")
    print(json.dumps({"torch_peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024}))


if __name__ == "__main__":
    main()
