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


def _values(graph):
    """The graph's weights by name, those that are stored in 16 bits as the 32 that are computed with."""
    values = {i.name: torch.from_numpy(numpy_helper.to_array(i).copy()) for i in graph.initializer}
    for node in graph.node:
        if node.op_type == "Cast" and node.input[0] in values and node.input[0].endswith("_f16"):
            values[node.output[0]] = values.pop(node.input[0]).float()
    return values


def read(path):
    """The state dict of the network that was exported to the graph at `path`."""
    graph = onnx.load(str(path)).graph
    values = _values(graph)
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
    """Fills `net` from the graph at `path`, names there beginning with `prefix` or not. Returns what else the graph holds.

    A missing or misshapen weight is an error: the bundle is of another architecture.
    """
    found = read(path)
    wanted = net.state_dict()
    state = {k: found.pop(prefix + k, None) if prefix + k in found else found.pop(k, None) for k in wanted}
    wrong = [k for k, v in state.items() if v is None or v.shape != wanted[k].shape]
    if wrong:
        raise SystemExit(f"{Path(path)}: not this architecture's weights; missing or of another shape: {', '.join(wrong[:5])}")
    net.load_state_dict(state)
    return found


def load_folded(net, path):
    """Fills the mask UNet from its exported graph, where each batch norm is folded into the convolution before it.

    The norms come out as plain scales and shifts (running mean 0, variance 1), right in `eval` mode.
    """
    graph = onnx.load(str(path)).graph
    values, state = _values(graph), net.state_dict()
    for node in (n for n in graph.node if n.op_type == "Conv"):
        weight, bias = (values[name] for name in node.input[1:3])
        block, number = _layer(node.name).rpartition(".")[::2]
        norm = f"{block}.{int(number) + 1}" if number.isdigit() else ""
        if f"{norm}.running_var" in state:
            state[f"{block}.{number}.weight"], state[f"{norm}.bias"] = weight, bias
            state[f"{norm}.weight"], state[f"{norm}.running_mean"] = torch.ones_like(bias), torch.zeros_like(bias)
            state[f"{norm}.running_var"] = torch.full_like(bias, 1 - 1e-5)
        else:
            state[f"{_layer(node.name)}.weight"], state[f"{_layer(node.name)}.bias"] = weight, bias
    net.load_state_dict(state)
