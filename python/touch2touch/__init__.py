"""Cross-modal tactile generation and in-hand poses, from Python.

>>> import touch2touch as t2t
>>> pair = t2t.open("demo")[0]
>>> result = t2t.estimate(pair, t2t.Recipe("predicted"))
>>> result.pose.matrix, result.pose.sigma, result.verdict

Lengths are meters and angles radians; images are (fingers, height, width), right finger first, in the cameras' own
orientation; poses are float64 matrices for column vectors, named `dst_from_src`. The package calls the functions behind the
studio and its command line, so results are identical to the last bit.
"""

from . import _native
from ._native import (
    Cancelled,
    Dataset,
    Estimate,
    Pair,
    Pose,
    Recipe,
    Refused,
    Scores,
    Tool,
    __version__,
    adapt,
    bundles,
    estimate,
    estimate_many,
    evaluate,
    export_masks,
    frechet,
    label,
    open,
    psnr,
    register,
    register_many,
    simulate,
    ssim,
)
from ._arrays import from_arrays
from ._many import predict, predict_many, table
from ._studio import studio

__all__ = [
    "Cancelled", "Dataset", "Estimate", "Pair", "Pose", "Recipe", "Refused", "Scores", "Tool", "__version__", "adapt", "bundles",
    "estimate", "estimate_many", "evaluate", "export_masks", "frechet", "from_arrays", "label", "open", "predict", "predict_many", "psnr",
    "register", "register_many", "simulate", "ssim", "studio", "table",
]


# Classes pickle as references to their source, so that another process reads the data itself.


def _dataset(path, read_as, tool_unit, names):
    data = open(path, read_as=read_as, tool_unit=tool_unit)
    return data if names is None else data._named(names)


def _pair(data, at):
    return data[at]


def _simulated(tool, angle, x, y, seed, sensors, gelslims):
    return simulate(tool, angle, x, y, seed=seed, sensors=sensors, gelslims=gelslims)


def _recipe(choices):
    return Recipe(**choices)


def _tool(vertices, faces, name):
    return Tool(vertices, faces, name=name)
