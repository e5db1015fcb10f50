"""Rows of many touches by two workers of Ray, one of them killed."""

import os
import signal
import subprocess
import threading
import time

import pytest
import touch2touch as t2t

ray = pytest.importorskip("ray")
pq = pytest.importorskip("pyarrow.parquet")

import touch2touch.ray as many  # noqa: E402


def rows(folder):
    table = pq.read_table(folder).sort_by("pair")
    return table.to_pylist()


@pytest.fixture(scope="module")
def data():
    return t2t.open("demo")[:24]


@pytest.fixture(scope="module")
def alone(data, tmp_path_factory):
    """Rows that one process makes."""
    folder = tmp_path_factory.mktemp("alone")
    recipe = t2t.Recipe("predicted")
    many.write(folder / "rows-all.parquet", [many.row(pair, recipe, recipe.id()) for pair in data])
    return rows(folder)


def killer(stop, killed):
    """Kills one of the actors once it works."""
    while not stop.is_set() and not killed:
        listed = subprocess.run(["pgrep", "-f", "^ray::.*MapWorker"], capture_output=True, text=True, check=False)
        workers = [int(pid) for pid in listed.stdout.split()]
        if len(workers) >= 2:
            time.sleep(1.0)
            os.kill(workers[0], signal.SIGKILL)
            killed.append(workers[0])
        time.sleep(0.05)


def same(a, b):
    """Equal to the last bit, NaN too."""
    return len(a) == len(b) and all(
        x.keys() == y.keys() and all(x[k] == y[k] or (x[k] != x[k] and y[k] != y[k]) for k in x) for x, y in zip(a, b))


def test_two_workers_one_killed_make_the_rows_of_one_process(data, alone, tmp_path):
    ray.init(num_cpus=2, include_dashboard=False, runtime_env={"env_vars": many.THREADS}, log_to_driver=False)
    stop, killed = threading.Event(), []
    thread = threading.Thread(target=killer, args=(stop, killed))
    thread.start()
    try:
        out, made = many.evaluate(data, t2t.Recipe("predicted"), tmp_path, batch=2, workers=2)
    finally:
        stop.set()
        thread.join()
    assert killed, "a worker was killed"
    assert made == len(data) and same(rows(out), alone)
    # Nothing is made again; another recipe has rows of its own in the same folder.
    assert many.evaluate(data, t2t.Recipe("predicted"), tmp_path)[1] == 0
    assert many.evaluate(data[:2], t2t.Recipe("predicted", seed=5), tmp_path, workers=1)[1] == 2
    assert len(rows(out)) == len(data) + 2
    ray.shutdown()
