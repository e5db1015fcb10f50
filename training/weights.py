"""Weights of an exported bundle back into torch, to go on from it (`--from BUNDLE`)."""

from pathlib import Path

import onnx
import torch
from onnx import numpy_helper

# What the exporter makes of a layer's weights where it does not keep their names.
UNNAMED = {"MatMul": "weight", "Mul": "weight", "Add": "bias"}


def _layer(node_name):
    """`/mix.0/mlp/mlp.2/MatMul` to `mix.0.mlp.2`: a Sequential's own name is repeated by its children."""
    parts = node_name.strip("/").split("/")[:-1]
    kept = [p for p, after in zip(parts, parts[1:] + [""]) if not after.startswith(p + ".")]
    return ".".join(kept)


def read(path):
    """The state dict of the network that was exported to the graph at `path`."""
    graph = onnx.load(str(path)).graph
    values = {i.name: torch.from_numpy(numpy_helper.to_array(i).copy()) for i in graph.initializer}
    for node in graph.node:
        if node.op_type == "Cast" and node.input[0] in values and node.input[0].endswith("_f16"):
            values[node.output[0]] = values.pop(node.input[0]).float()
    state = {k: v for k, v in values.items() if not k.startswith("onnx::")}
    for node in graph.node:
        if node.op_type not in UNNAMED:
            continue
        for name in (n for n in node.input if n.startswith("onnx::") and n in values):
            value = values[name]
            value = value.T.contiguous() if node.op_type == "MatMul" else value.flatten()
            state[f"{_layer(node.name)}.{UNNAMED[node.op_type]}"] = value
    return state


def load(net, path, prefix=""):
    """Fills `net` from the graph at `path`, names there beginning with `prefix`. Returns what else the graph holds.

    A missing or misshapen weight is an error: the bundle is of another architecture.
    """
    found = read(path)
    wanted = net.state_dict()
    state = {k: found.pop(prefix + k, None) for k in wanted}
    wrong = [k for k, v in state.items() if v is None or v.shape != wanted[k].shape]
    if wrong:
        raise SystemExit(f"{Path(path)}: not this architecture's weights; missing or of another shape: {', '.join(wrong[:5])}")
    net.load_state_dict(state)
    return found
