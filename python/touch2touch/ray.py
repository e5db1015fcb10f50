"""Processes many pairs on many machines with Ray.

`pip install touch2touch[ray]`, then

>>> import touch2touch as t2t, touch2touch.ray
>>> touch2touch.ray.evaluate(t2t.open("/data/lab"), t2t.Recipe("predicted"), out="rows")

writes one row per touch as Parquet into a folder that all machines share: identity of pair and recipe, pose, standard deviations,
verdict, error where the truth is known, and each finger's metrics against the measured imprint. Existing rows are skipped, so a run
that was stopped, or that lost a worker, resumes; rows are identical to the last bit on any machine.
"""

import hashlib
import os
import time
from pathlib import Path

import numpy as np

from . import Dataset, Recipe, Refused, estimate, psnr, ssim

# One thread for each worker: there are as many workers as cores.
THREADS = {"RAYON_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
# Data range of SSIM, meters: fixed, because a row does not know the other predictions of its tool.
RANGE_M = 0.0225


def row(pair, recipe, identity):
    """The results of a touch as a dictionary of plain values, NaN where missing. A failed touch is also a row, with the reason in `why`."""
    nan = float("nan")
    found = {"pair": pair.name, "tool": pair.tool_name, "recipe": identity, "angle_rad": nan, "y_m": nan, "z_m": nan,
             "angle_sd_rad": nan, "y_sd_m": nan, "z_sd_m": nan, "verdict": None, "why": None, "error_rad": nan,
             "true_angle_rad": nan if pair.true_angle is None else pair.true_angle, "num_points": 0}
    for finger in ("right", "left"):
        found |= {f"psnr_{finger}_db": nan, f"ssim_{finger}": nan}
    try:
        result = estimate(pair, recipe)
    except Refused as why:
        return found | {"why": str(why)}
    measured = pair.imprint
    if measured is not None and recipe.choices["imprint"] == "predicted":
        for finger, made, true in zip(("right", "left"), result.imprint, measured):
            if np.isfinite(made).any() and np.isfinite(true).any():
                found |= {f"psnr_{finger}_db": psnr(made, true), f"ssim_{finger}": ssim(made, true, data_range=RANGE_M)}
    pose = result.pose
    if pose is None:
        return found | {"why": result.why_not}
    (y, z), (angle_sd, y_sd, z_sd) = pose.place, pose.sigma
    error = nan if pose.error is None else pose.error
    return found | {"angle_rad": pose.angle, "y_m": y, "z_m": z, "angle_sd_rad": float(angle_sd), "y_sd_m": float(y_sd),
                    "z_sd_m": float(z_sd), "verdict": pose.verdict, "why": pose.why, "error_rad": error,
                    "num_points": pose.num_points}


def part(out, identity, names):
    """The file of the rows of some pairs."""
    digest = hashlib.sha256("\n".join([identity, *names]).encode()).hexdigest()[:16]
    return Path(out) / f"rows-{digest}.parquet"


def write(file, rows):
    """Writes rows as Parquet, completely or not at all."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_suffix(f".{os.getpid()}.partial")
    pq.write_table(pa.Table.from_pylist(rows, schema=schema(pa)), partial)
    os.replace(partial, file)


def schema(pa):
    text = ("pair", "tool", "recipe", "verdict", "why")
    numbers = ("angle_rad", "y_m", "z_m", "angle_sd_rad", "y_sd_m", "z_sd_m", "error_rad", "true_angle_rad")
    measures = [name for f in ("right", "left") for name in (f"psnr_{f}_db", f"ssim_{f}")]
    return pa.schema([(name, pa.string()) for name in text] + [(name, pa.float64()) for name in (*numbers, *measures)] +
                     [("num_points", pa.int64())])


def known(out, identity):
    """Names of the pairs that have rows of this recipe in a folder."""
    import pyarrow.parquet as pq

    names = set()
    for file in sorted(Path(out).glob("rows-*.parquet")):
        table = pq.read_table(file, columns=["pair", "recipe"])
        names |= {pair for pair, by in zip(table["pair"].to_pylist(), table["recipe"].to_pylist()) if by == identity}
    return names


class Worker:
    """An actor: opens the data and loads the models once, then makes files of rows."""

    def __init__(self, data, recipe, out):
        self.data, self.recipe, self.out, self.identity = data, recipe, out, recipe.id()

    def __call__(self, batch):
        names = [str(name) for name in batch["pair"]]
        file = part(self.out, self.identity, names)
        # A batch repeated after its worker was lost may already be written.
        if not file.exists():
            write(file, [row(self.data[name], self.recipe, self.identity) for name in names])
        return {"pairs": np.array([len(names)])}


def evaluate(data, recipe=None, out="rows", *, batch=16, workers=None):
    """Writes the missing rows of a data set's touches to `out`. Returns the folder and the number of new rows.

    `data` must be at the same path on every machine. `workers`: actors at a time (default: one for each core of the cluster).
    """
    import ray

    if not isinstance(data, Dataset):
        raise TypeError("data must be a touch2touch.Dataset")
    recipe, out = recipe or Recipe(), Path(out).absolute()
    done = known(out, recipe.id())
    todo = [name for name in data.names if name not in done]
    if not todo:
        return out, 0
    ray.init(ignore_reinit_error=True, runtime_env={"env_vars": THREADS}, log_to_driver=False)
    workers = workers or max(1, int(ray.cluster_resources().get("CPU", 1)))
    # Blocks of one batch each, so that a lost worker costs only its current batch.
    blocks = ray.data.from_items([{"pair": name} for name in todo], override_num_blocks=-(-len(todo) // batch))
    made = blocks.map_batches(Worker, batch_size=batch, fn_constructor_args=(data, recipe, str(out)), num_cpus=1,
                              compute=ray.data.ActorPoolStrategy(size=workers), max_restarts=-1, max_task_retries=-1)
    return out, int(sum(made.to_pandas()["pairs"]))


def main():
    """`python -m touch2touch.ray DATA OUT [--predicted]`: writes the rows without Ray, on one machine or as part of a job array."""
    import argparse

    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("data")
    parser.add_argument("out", type=Path)
    parser.add_argument("--predicted", action="store_true", help="evaluate predicted instead of measured imprints")
    parser.add_argument("--shard", default="1/1", metavar="I/N", help="every N-th batch from the I-th on, counted from 1")
    parser.add_argument("--batch", type=int, default=16)
    args = parser.parse_args()
    from . import open as open_data

    data, recipe = open_data(args.data), Recipe("predicted" if args.predicted else "measured")
    at, of = map(int, args.shard.split("/"))
    if not 1 <= at <= of:
        parser.error("--shard: I must be from 1 to N")
    batches = [data.names[n:n + args.batch] for n in range(0, len(data), args.batch)][at - 1::of]
    worker, begun = Worker(data, recipe, args.out), time.monotonic()
    for names in batches:
        worker({"pair": names})
    pairs = sum(map(len, batches))
    print(f"{pairs} rows in {time.monotonic() - begun:.1f} s")


if __name__ == "__main__":
    main()
