"""Command line: `python -m training.fid_features --weights FILE --out BUNDLE`.

Makes the bundle for `touch2touch evaluate --features` of the Inception network whose 2048 features published FIDs are of.
FILE is `pt_inception-2015-12-05-6726825d.pth`, which pytorch-fid downloads; `pip install pytorch-fid torchvision` brings the
network. The graph takes pictures of 299 x 299 in 0..1; the studio resizes them as pytorch-fid does.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import onnxruntime
import torch
from torch import nn

from . import data
from .export import OPSET

SIZE = 299
FEATURES = 2048


class Features(nn.Module):
    """The network's last pooled features, flat."""

    def __init__(self, net):
        super().__init__()
        self.net = net

    def forward(self, image):
        return self.net(image)[0].flatten(1)


def inception(weights):
    """pytorch-fid's network with the weights of a file, instead of a download."""
    from pytorch_fid import inception as theirs

    theirs.load_state_dict_from_url = lambda *_, **__: torch.load(weights, map_location="cpu", weights_only=True)
    return theirs.InceptionV3([theirs.InceptionV3.BLOCK_INDEX_BY_DIM[FEATURES]], resize_input=False)


def write(net, size, features, name, provenance, out):
    """Writes a bundle of `net`, which turns pictures (N,3,size,size) into (N,features), and checks it with ONNX Runtime."""
    out.mkdir(parents=True, exist_ok=True)
    path, probe = out / "image_features.onnx", torch.rand(2, 3, size, size)
    with torch.no_grad():
        torch.onnx.export(net.eval(), (probe,), str(path), input_names=["image"], output_names=["features"],
                          dynamic_axes={"image": {0: "n"}, "features": {0: "n"}}, opset_version=OPSET, dynamo=False)
        expected = net(probe).numpy()
    found = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"]).run(None, {"image": probe.numpy()})[0]
    apart = float(np.abs(found - expected).max())
    if found.shape != (2, features) or apart > 1e-3 * max(1.0, float(np.abs(expected).max())):
        raise SystemExit(f"the exported graph differs from the network: {found.shape}, {apart}")
    manifest = {"format": "touch2touch-bundle", "format_version": 2, "kind": "image_features", "name": name,
                "files": {"image_features": {"path": path.name, "sha256": data.sha256(path)}},
                "input": {"size": [size, size]}, "output": {"features": features}, "provenance": provenance}
    (out / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")
    print(f"{out}: {features} features, largest difference from torch {apart:.1e}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--weights", required=True, help="pt_inception-2015-12-05-6726825d.pth")
    parser.add_argument("--out", required=True)
    args = parser.parse_args()
    provenance = {"weights": Path(args.weights).name, "sha256": data.sha256(Path(args.weights))}
    write(Features(inception(args.weights)), SIZE, FEATURES, "Inception of pytorch-fid", provenance, Path(args.out))


if __name__ == "__main__":
    main()
