"""Writes torch_views.pt and torch_views.json, the reference for reading PyTorch files.

Run with PyTorch (made with 2.15): python make_pt_fixture.py
The JSON holds the exact bits of every value, so that the reader is checked to the last bit.
"""

import json
import struct

import torch

torch.manual_seed(0)
big = torch.randn(6, 40)
tensors = {
    "f32": torch.randn(2, 3, 4),
    "transposed": torch.randn(3, 5).t(),
    "strided": big[1:5:2, 3:31:4],
    "view_in_larger_storage": big[2:4],
    "expanded": torch.randn(1, 3).expand(4, 3),
    "f64": torch.randn(2, 2, dtype=torch.float64),
    "theta": torch.tensor(-0.10756945610046387, dtype=torch.float64),
    "scalar_f32": torch.tensor(0.1),
    "special": torch.tensor([float("nan"), float("inf"), -float("inf"), -0.0, 1e-45, 3.4e38]),
    "f16": torch.tensor([1.0, -2.5, 6e-8, 65504.0, 0.333], dtype=torch.float16),
    "u8": torch.tensor([[0, 1], [254, 255]], dtype=torch.uint8),
    "bool": torch.tensor([True, False, True]),
    "i64": torch.tensor([-(2**62), 7, 2**62]),
    "i32": torch.tensor([-(2**31), 2**31 - 1], dtype=torch.int32),
    "grad": torch.randn(3, requires_grad=True),
    "empty": torch.zeros(0, 3),
}
plain = {"a_float": 0.25, "an_int": 7, "a_text": "hello", "a_list": ["x", "y"]}


def bits(t):
    t = t.detach().contiguous().flatten()
    if t.dtype == torch.float64:
        return [f"{struct.unpack('<Q', struct.pack('<d', v))[0]:016x}" for v in t.tolist()]
    if t.dtype == torch.float32:
        return [f"{v & 0xFFFFFFFF:08x}" for v in t.view(torch.int32).tolist()]
    if t.dtype == torch.float16:
        return [f"{v & 0xFFFFFFFF:08x}" for v in t.float().view(torch.int32).tolist()]
    return [str(int(v)) for v in t.tolist()]


torch.save({**tensors, **plain}, "torch_views.pt")
truth = {
    k: {"dtype": str(t.dtype).split(".")[1], "shape": list(t.shape), "bits": bits(t)}
    for k, t in tensors.items()
}
with open("torch_views.json", "w") as f:
    json.dump(truth, f, separators=(",", ":"))
torch.save({"train_tools": ["pattern_31_rod"], "test_tools": ["pattern_35", "pattern_36"]}, "torch_tools.pt")

import numpy as np  # noqa: E402

torch.save({"theta": np.float64(0.1), "arr": np.zeros(3), "ok": torch.ones(2)}, "torch_numpy.pt")
torch.save(torch.ones(3), "torch_toplevel.pt")
