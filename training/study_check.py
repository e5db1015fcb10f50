"""Command line: `python -m training.study_check`: every method is given the same samples, and a stop changes nothing.

On random touches: a few steps of each method in one go, and stopped and gone on; the samples that each asked for, and the
weights to the last bit.
"""

import json
import tempfile
from pathlib import Path

import numpy as np
import torch

from .study_runs import METHODS, Training
from .study_training import AUTOENCODER_BATCH, BATCH, train_to
from .touches import Touches, places

TOUCHES, STEPS = 40, 5


def random_shards(folder):
    """Touches of noise: what they hold is of no importance here."""
    rng, shard = np.random.default_rng(0), Path(folder) / "shard"
    shard.mkdir(parents=True)
    meta = np.zeros((TOUCHES, 8), np.float32)
    meta[:, 1], meta[:, 6] = np.arange(TOUCHES) % 2, np.arange(TOUCHES) % 3 == 0
    imprint = rng.integers(0, 9000, (TOUCHES, 140, 175)).astype(np.int16)
    arrays = {"gelslim": rng.integers(-900, 900, (TOUCHES, 3, 128, 128)).astype(np.int16), "imprint": imprint, "clean": imprint,
              "contact": np.zeros((TOUCHES, 140, 175), np.uint8), "meta": meta}
    for name, array in arrays.items():
        np.save(shard / f"{name}.npy", array)
    (shard / "done.json").write_text(json.dumps({"samples": TOUCHES}))
    return Path(folder)


def same(a, b):
    """True where two states, however nested, are equal to the last bit."""
    if isinstance(a, torch.Tensor):
        return torch.equal(a, b)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(same, a, b))
    return a == b


def main():
    torch.set_num_threads(1)
    asked, get = [], Touches.get
    Touches.get = lambda self, at: (len(at) == BATCH and asked.append(list(at))) or get(self, at)
    with tempfile.TemporaryDirectory() as folder:
        shards = random_shards(Path(folder) / "shards")
        expected = [list(places(1, step * BATCH, BATCH, TOUCHES)) for step in range(STEPS)]
        for method, kind in METHODS.items():
            training, ways = Training(method), []
            for stops in ((STEPS,), (2, STEPS)):
                out, asked[:] = Path(folder) / kind / str(len(stops)), []
                if kind == "generator":
                    train_to("autoencoder", training, shards, out, 2 * AUTOENCODER_BATCH, 0.2, 1)
                for steps in stops:
                    train_to(kind, training, shards, out, steps, 0.0, 1)
                assert asked == expected, f"{method} was given other samples"
                ways.append(torch.load(out / f"{kind}.pt", weights_only=True))
            equal = [same(ways[0][key], ways[1][key]) for key in ("nets", "optimiser", "others", "step")]
            assert all(equal), f"{method}: a stop shows"
            print(f"{method}: the samples of the seed in its order; the same to the last bit over a stop", flush=True)


if __name__ == "__main__":
    main()
