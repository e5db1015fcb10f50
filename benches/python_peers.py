"""Python's view of time: `register` beside Open3D and small_gicp on the same arrays, the binding's own cost, reading of pairs.

`python -m benches.python_peers [--count N] [--lab DIR] [--json FILE]` with the package installed, and with open3d, small_gicp
and torch where there are rows of theirs. DIR is a folder of the lab's files. One thread each; times are medians over the
grasps, milliseconds, call overhead included; errors stand beside them.
"""

import argparse
import importlib.util
import json
import math
import statistics
import time
from pathlib import Path

import numpy as np
import touch2touch as t2t

from . import peers


def clock(call, ms=8.0):
    """The last result and the median time of a call that is repeated for some time, milliseconds."""
    took = []
    while len(took) < 3 or (sum(took) < ms and len(took) < 15):
        begin = time.perf_counter()
        result = call()
        took.append((time.perf_counter() - begin) * 1e3)
    return result, statistics.median(took)


def grasps(count):
    """Contact points, tool and true angle of grasps of the built-in test set, masks by the shipped model."""
    data = t2t.open("test-set")
    for at in np.linspace(0, len(data) - 1, count).round().astype(int):
        pair = data[int(at)]
        yield t2t.estimate(pair, stage="cloud").points, pair.tool, pair.true_angle


def surface(tool, count=5000):
    """Points drawn evenly from the tool's surface: the peers' fixed cloud."""
    corners = tool.vertices[tool.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    rng = np.random.default_rng(0)
    a, b, c = np.moveaxis(corners[rng.choice(len(area), count, p=area / area.sum())], 1, 0)
    along, across = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    return a * (1 - along) + b * along * (1 - across) + c * along * across


def registrations(cases):
    """Of each way: name, median milliseconds, mean error in degrees, percent within 5 degrees."""
    others, _, missing = peers.methods()
    for name, why in missing.items():
        print(f"left out: {name}: {why}")
    found = {}
    for points, tool, truth in cases:
        for method in others:
            if tool.name not in method.tools:
                method.prepare(tool.name, surface(tool))
        # The peers' pose is grasp_from_object, whose angle is the opposite of the lab's.
        calls = {"touch2touch.register": lambda: t2t.register(points, tool, evidence=False).angle,
                 "the same with verdict": lambda: t2t.register(points, tool).angle}
        calls |= {m.label: lambda m=m: -m.solve(tool.name, points)["theta_rad"] for m in others}
        for name, call in calls.items():
            angle, ms = clock(call)
            off = abs(math.degrees(math.remainder(angle - truth, 2 * math.pi)))
            found.setdefault(name, []).append((ms, off))
    return [{"name": name, "median_ms": statistics.median(ms for ms, _ in rows),
             "mean_deg": statistics.mean(off for _, off in rows),
             "success_5": 100 * statistics.mean(off <= 5 for _, off in rows)} for name, rows in found.items()]


def overhead_us(cases):
    """Cost of a call beyond the registration that it makes: the median of the differences."""
    extra = []
    for points, tool, _ in cases:
        for _ in range(50):
            begin = time.perf_counter()
            pose = t2t.register(points, tool, evidence=False)
            extra.append((time.perf_counter() - begin) * 1e6 - pose.ms * 1e3)
    return statistics.median(extra)


def reading(folder):
    """Median milliseconds of reading one pair of the lab's files, by the package and by torch."""
    data = t2t.open(folder)
    rows = {"touch2touch": statistics.median(clock(lambda at=at: data[at])[1] for at in range(len(data)))}
    if importlib.util.find_spec("torch"):
        import torch

        files = sorted(Path(folder).rglob("*data_*.pt"))
        each = [clock(lambda f=f: torch.load(f, map_location="cpu", weights_only=False))[1] for f in files]
        rows["torch.load of both files"] = 2 * statistics.mean(each)
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--lab", type=Path)
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    cases = list(grasps(args.count))
    answer = {"grasps": len(cases), "registrations": registrations(cases), "overhead_us": overhead_us(cases[:8])}
    answer["reading_ms"] = reading(args.lab) if args.lab else {}
    for row in answer["registrations"]:
        print(f"{row['name']:38} {row['median_ms']:9.3f} ms {row['mean_deg']:6.2f}° {row['success_5']:5.1f} %")
    print(f"binding: {answer['overhead_us']:.1f} us a call")
    for name, ms in answer["reading_ms"].items():
        print(f"reading a pair, {name}: {ms:.1f} ms")
    if args.json:
        args.json.write_text(json.dumps(answer, indent=1))


if __name__ == "__main__":
    main()
