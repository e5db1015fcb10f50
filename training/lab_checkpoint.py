"""Reading the lab's checkpoint and statistics files, and filling networks from them.

Every file is read without running anything in it: a Lightning checkpoint names classes of packages that need not be
there, and a pickle could name anything. Tensors are mapped from the file, so that a checkpoint with optimiser states
costs no memory.
"""

import collections
import hashlib
import pickle
import types
import zipfile

import numpy as np
import torch

# Configuration that the released networks share; a retrained one with other widths needs them changed in lab_models.py.
SHAPES_HINT = "the file holds another network, or one with other widths than the released ones (the defaults in training/lab_models.py)"


class LabError(Exception):
    """What is wrong with which file, and what to do; for people."""


class Inert:
    """Stands for any class of the pickle that is not needed here."""

    def __new__(cls, *args, **kwargs):
        return super().__new__(cls)

    def __init__(self, *args, **kwargs):
        self.items = {}

    def __setstate__(self, state):
        pass

    def __setitem__(self, key, value):
        self.items[key] = value

    def append(self, value):
        pass

    def extend(self, values):
        pass


SAFE = {
    ("collections", "OrderedDict"): collections.OrderedDict,
    ("torch._utils", "_rebuild_tensor"): torch._utils._rebuild_tensor,
    ("torch._utils", "_rebuild_tensor_v2"): torch._utils._rebuild_tensor_v2,
    ("torch._utils", "_rebuild_parameter"): torch._utils._rebuild_parameter,
    ("torch", "Size"): torch.Size,
    ("torch", "device"): torch.device,
    ("numpy", "dtype"): np.dtype,
    ("numpy", "ndarray"): np.ndarray,
    ("_codecs", "encode"): lambda text, encoding: text.encode(encoding),
    # The classes of old storages are looked up by their names only.
    **{("torch", name): getattr(torch, name) for name in dir(torch) if name.endswith("Storage")},
}
for package in ("numpy.core", "numpy._core"):
    SAFE[(f"{package}.multiarray", "scalar")] = np._core.multiarray.scalar
    SAFE[(f"{package}.multiarray", "_reconstruct")] = np._core.multiarray._reconstruct


class Reader(pickle.Unpickler):
    def find_class(self, module, name):
        return SAFE.get((module, name), Inert)


# What torch.load asks of a pickle module.
READER = types.SimpleNamespace(Unpickler=Reader, load=lambda file, **kw: Reader(file, **kw).load(), __name__="lab_reader")


def read(path):
    """The content of a `.ckpt`, `.pt` or `.pth` file, its tensors on the CPU."""
    if not path.is_file():
        raise LabError(f"{path}: not found; give the lab's own file (training/README.md lists the names)")
    try:
        return torch.load(path, map_location="cpu", mmap=zipfile.is_zipfile(path) or None, weights_only=False, pickle_module=READER)
    except Exception as err:  # whatever a damaged archive or pickle raises
        raise LabError(f"{path}: not a readable PyTorch file ({type(err).__name__}: {err}); copy it again") from err


def state_dict(path):
    """The state dict of a checkpoint and what stands beside it (epoch, step)."""
    content = read(path)
    if not isinstance(content, dict) or not content:
        raise LabError(f"{path}: holds {type(content).__name__} instead of a dict of tensors; {SHAPES_HINT}")
    state = content.get("state_dict", content)
    if not isinstance(state, dict):
        raise LabError(f"{path}: state_dict is {type(state).__name__} instead of a dict; {SHAPES_HINT}")
    beside = {k: content[k] for k in ("epoch", "global_step") if isinstance(content.get(k), int)} if state is not content else {}
    return dict(state), beside


def sha256(path):
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 24):
            digest.update(block)
    return digest.hexdigest()


class Weights:
    """A state dict from which networks are filled; whatever nobody took or knows is an error at the end."""

    def __init__(self, path, ignored=()):
        self.path = path
        self.state, self.beside = state_dict(path)
        # DataParallel puts a word before every name.
        if all(k.startswith("module.") for k in self.state):
            self.state = {k[len("module."):]: v for k, v in self.state.items()}
        self.ignored, self.taken = tuple(ignored), set()

    def tensor(self, key):
        value = self.state.get(key)
        if not isinstance(value, torch.Tensor):
            near = sorted(k for k in self.state if k.split(".")[0] == key.split(".")[0])[:3]
            raise LabError(f"{self.path}: {key}: missing" + (f" (there are {', '.join(near)}, …)" if near else "")
                           + f"; {SHAPES_HINT}")
        self.taken.add(key)
        return value

    def fill(self, net, prefix="", name=lambda key: key):
        """Fills `net`; `name` turns its own names into those after `prefix` in the file."""
        wrong, found = [], {}
        for own, expected in net.state_dict().items():
            key = prefix + name(own)
            value = self.state.get(key)
            if own.endswith("num_batches_tracked"):
                found[own] = torch.zeros((), dtype=torch.int64)  # counts training steps: not needed, not always stored
                self.taken.add(key)
            elif not isinstance(value, torch.Tensor):
                wrong.append(f"{key}: missing, expected {tuple(expected.shape)}")
            elif value.shape != expected.shape:
                wrong.append(f"{key}: shape {tuple(value.shape)} instead of {tuple(expected.shape)}")
            elif not value.is_floating_point():
                wrong.append(f"{key}: element type {value.dtype} instead of floating point")
            elif not torch.isfinite(value).all():
                wrong.append(f"{key}: holds values that are not finite")
            else:
                found[own] = value.float()
                self.taken.add(key)
        if wrong:
            more = f"\n- and {len(wrong) - 8} more" if len(wrong) > 8 else ""
            raise LabError(f"{self.path}: {len(wrong)} of {len(net.state_dict())} tensors of {type(net).__name__} do not fit:\n- "
                           + "\n- ".join(wrong[:8]) + f"{more}\n{SHAPES_HINT}")
        net.load_state_dict(found, assign=True)
        return net.eval().requires_grad_(False)

    def finish(self, known=()):
        """Refuses keys that nobody took: they may belong to a part of the network that this converter does not build."""
        unknown = sorted(k for k in self.state if k not in self.taken and not k.startswith((*known, *self.ignored)))
        if unknown:
            listed = "\n- ".join(unknown[:8]) + (f"\n- and {len(unknown) - 8} more" if len(unknown) > 8 else "")
            raise LabError(f"{self.path}: {len(unknown)} unknown keys:\n- {listed}\n{SHAPES_HINT}. If they are not used when "
                           f"predicting, say so: --ignore {unknown[0].split('.')[0]}")


def empty(make):
    """A network without memory, to be filled from a file."""
    with torch.device("meta"):
        return make()


def numbers(path, content, key, count):
    """`count` finite numbers under `key` of a statistics file, whether stored as tensor, array, list or number."""
    if not isinstance(content, dict):
        raise LabError(f"{path}: holds {type(content).__name__} instead of a dict with {key}; give the statistics file")
    if key not in content:
        raise LabError(f"{path}: {key}: missing (there are {', '.join(map(str, content)) or 'no keys'}); give the statistics file "
                       "that was saved with the checkpoint")
    try:
        values = [float(v) for v in np.asarray([np.asarray(v, dtype=np.float64) for v in np.atleast_1d(content[key])]).reshape(-1)]
    except (TypeError, ValueError) as err:
        raise LabError(f"{path}: {key}: not numbers ({err}); give the statistics file that was saved with the checkpoint") from err
    if len(values) != count or not np.isfinite(values).all():
        raise LabError(f"{path}: {key}: {values} instead of {count} finite number{'s' if count > 1 else ''}; correct the file")
    # float32 values as they were meant: 0.0225, not 0.02250000089.
    return [float(f"{v:.7g}") for v in values]
