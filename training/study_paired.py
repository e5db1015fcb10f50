"""Paired differences of two evaluations (`touch2touch evaluate --json --pairs`): figures of each tool's grasps, then the mean
over the tools; intervals by drawing the grasps again within each tool, the same for both."""

import math
import random
from collections import defaultdict

PEAK_M = 0.0225
DRAWINGS = 400


def psnr(grasps):
    errors = [image["error"] for grasp in grasps for image in grasp["images"]]
    total, pixels = sum(e["sum"] for e in errors), sum(e["pixels"] for e in errors)
    return 20 * math.log10(PEAK_M) - 10 * math.log10(total / pixels) if total > 0 else None


def mean(values):
    values = [value for value in values if value is not None]
    return sum(values) / len(values) if values else None


def within(degrees):
    def share(grasps):
        known = [g["angle_error_rad"] for g in grasps if "angle_error_rad" in g]
        return mean(100.0 * (e is not None and math.degrees(e) <= degrees) for e in known)
    return share


COLUMNS = {
    "psnr_db": psnr,
    "ssim": lambda grasps: mean(image["ssim"] for grasp in grasps for image in grasp["images"]),
    "angle_deg": lambda grasps: mean(math.degrees(g["angle_error_rad"]) for g in grasps if g.get("angle_error_rad") is not None),
    "success_5": within(5),
    "success_10": within(10),
}


def less(tools, figure):
    """Mean over the tools of the later figure less the earlier one."""
    each = ([figure([pair[side] for pair in pairs]) for side in (0, 1)] for pairs in tools)
    return mean(after - before for before, after in each if None not in (before, after))


def differences(before, after):
    """The groups of `after` less `before`, both the grasps of one method, over those that both have."""
    known = {grasp["pair"]: grasp for grasp in before}
    groups = defaultdict(lambda: defaultdict(list))
    for grasp in after:
        if grasp["pair"] in known:
            groups[grasp["group"]][grasp["tool"]].append((known[grasp["pair"]], grasp))
    found = []
    for group, by_tool in sorted(groups.items()):
        tools, drawn, row = list(by_tool.values()), random.Random(1), {"group": group}
        row |= {"tools": len(tools), "grasps": sum(map(len, tools))}
        again = [[drawn.choices(pairs, k=len(pairs)) for pairs in tools] for _ in range(DRAWINGS)]
        for key, figure in COLUMNS.items():
            value = less(tools, figure)
            if value is not None:
                all_of = sorted(v for v in (less(one, figure) for one in again) if v is not None)
                low, high = (all_of[round((len(all_of) - 1) * share)] for share in (0.025, 0.975))
                row[key] = {"value": value, "interval": [low, high]}
        found.append(row)
    return found


def generator(answer):
    """The grasps of the only generator of an answer."""
    return next(row["grasps"] for row in answer["pairs"] if not row["upper_bound"])
