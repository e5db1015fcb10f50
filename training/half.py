"""Storage of a graph's large weights as 16-bit floats: half the size, still computed in 32 bits."""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

# Smaller ones (norms, biases, schedules) keep their precision; they weigh nothing.
LARGE = 4096


def store(path):
    """Rewrites the graph at `path`: every large float32 weight becomes float16 and a Cast back to float32."""
    model = onnx.load(str(path))
    graph, casts = model.graph, []
    for i, weight in enumerate(graph.initializer):
        values = numpy_helper.to_array(weight)
        if weight.data_type != TensorProto.FLOAT or values.size < LARGE:
            continue
        if np.abs(values).max() > 6e4:
            raise SystemExit(f"{path}: {weight.name} does not fit into 16 bits")
        name = weight.name
        graph.initializer[i].CopyFrom(numpy_helper.from_array(values.astype(np.float16), name + "_f16"))
        casts.append(helper.make_node("Cast", [name + "_f16"], [name], name=f"/cast/{name}", to=TensorProto.FLOAT))
    nodes = casts + list(graph.node)
    del graph.node[:]
    graph.node.extend(nodes)
    onnx.save(model, str(path))
