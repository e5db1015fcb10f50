"""Paired differences between rows of the study: bootstrap over the grasps, which are the same in both.

The table's own conventions: figures of each tool, then the mean over the tools of a group; the grasps are drawn again within
each tool, the tools stay.
"""

import numpy as np

DRAWINGS, SEED = 1000, 1
# The lab's peak, in the unit of `rms`: 0.1 um.
PEAK = 225_000


def figures(tool, drawn):
    """Of one tool's grasps, drawn again (D,N): each figure (D,)."""
    rms, ssim, angle = (np.array(tool[key], float)[drawn] for key in ("rms", "ssim", "angle"))
    # Without a pose a grasp fails, and is in no mean.
    posed = ~np.isnan(angle)
    mean = np.where(posed, angle, 0).sum(axis=1) / np.maximum(posed.sum(axis=1), 1) / 100
    return {
        "psnr_db": 20 * np.log10(PEAK) - 10 * np.log10((rms**2).mean(axis=1)),
        "ssim": ssim.mean(axis=1) / 1e4,
        "angle_deg": mean,
        "success_5": 100 * (angle <= 500).mean(axis=1),
        "success_10": 100 * (angle <= 1000).mean(axis=1),
    }


def difference(a, b):
    """`b` minus `a` for each group of tools, with 95 % intervals; `None` where the grasps are not the same."""
    if {n: len(t["rms"]) for n, t in a.items()} != {n: len(t["rms"]) for n, t in b.items()}:
        return None
    rng, found = np.random.default_rng(SEED), {}
    for name, tool in a.items():
        n = len(tool["rms"])
        # As they are, then drawn again.
        drawn = np.concatenate([np.arange(n)[None], rng.integers(n, size=(DRAWINGS, n))])
        before, after = figures(tool, drawn), figures(b[name], drawn)
        found.setdefault(tool["group"], []).append({k: after[k] - before[k] for k in before})
    return {group: {k: interval(np.mean([t[k] for t in tools], axis=0)) for k in tools[0]} for group, tools in found.items()}


def interval(values):
    low, high = np.quantile(values[1:], (0.025, 0.975))
    return {"value": round(float(values[0]), 4), "interval": [round(float(low), 4), round(float(high), 4)]}


def differences(rows):
    """Of every two rows that differ in one setting."""
    found = []
    for i, a in enumerate(rows):
        for b in rows[i + 1:]:
            keys = [k for k in a["settings"] if a["settings"][k] != b["settings"].get(k)]
            if len(keys) != 1 or a["settings"].keys() != b["settings"].keys() or keys == ["test"]:
                continue
            groups = difference(a["grasps"], b["grasps"])
            if groups:
                found.append({"from": a["settings"], "to": {keys[0]: b["settings"][keys[0]]}, "groups": groups})
    return found
