#!/usr/bin/env python3
"""Draws what the benchmarks measured: error against time, and how far standard deviations can be relied on.

usage: pictures.py REPORT.json...    of `touch2touch-bench registration` or `generator`; PNG files beside it (needs matplotlib)
"""
import json
import pathlib
import sys

import matplotlib.pyplot as plt


def front(points, default, title, time, error, file):
    """Mean (disc) and median (ring) error over the time, with the staircase of what nothing beats."""
    _, axes = plt.subplots(figsize=(10, 6.2))
    for point in points:
        color = "tab:orange" if point["peer"] else "tab:blue"
        axes.plot([point["ms"]] * 2, [point["mean_deg"], point["median_deg"]], color=color, lw=0.8)
        axes.plot(point["ms"], point["mean_deg"], "o", color=color)
        axes.plot(point["ms"], point["median_deg"], "o", color=color, mfc="white", ms=4)
        name = point["name"] + (" (default)" if point["name"] == default else "")
        axes.annotate(name, (point["ms"], point["mean_deg"]), xytext=(8, 3), textcoords="offset points", color=color)
    best = sorted((p["ms"], p["mean_deg"]) for p in points if p["on_front"])
    axes.step(*zip(*best), where="post", color="tab:green", lw=1.5)
    axes.set(xscale="log", ylim=(0, None), title=title, xlabel=time, ylabel=error)
    axes.grid(color="0.9")
    plt.savefig(file, dpi=150, bbox_inches="tight")
    plt.close()


def reliability(rows, title, file):
    """Share of the angle's errors within a limit, over the share that the standard deviation foretells."""
    _, axes = plt.subplots(figsize=(6.2, 6.2))
    axes.plot([0, 100], [0, 100], color="0.2", lw=0.8)
    for row in rows:
        axes.plot(*zip(*row["reliability"]["curve"]), label=f"{row['name']}: rms {row['reliability']['rms'][0]:.2f}")
    axes.set(title=title, xlabel="errors that the standard deviation foretells within a limit, %", ylabel="errors within it, %")
    axes.legend(loc="lower right")
    axes.grid(color="0.9")
    plt.savefig(file, dpi=150, bbox_inches="tight")
    plt.close()


for name in sys.argv[1:]:
    file = pathlib.Path(name)
    report = json.loads(file.read_text())
    if "front" in report:
        rows, cases = report["engines"], len(report["cases"])
        front(report["front"], report["default"], f"Registration: error against time, {cases} cases, one thread",
              "points to pose, ms", "error, degrees", file.with_suffix(".png"))
        judged = [row for row in rows if row.get("reliability") and row["name"].startswith(("joint", "distance_field"))]
        reliability(judged, f"Standard deviation of the angle, {cases} cases", file.with_name(file.stem + "_reliability.png"))
    else:
        title, time = f"Generator: {{}} against time, {report['grasps']} grasps", "both fingers, image to meters, median, ms"
        for key, what, suffix in [("front_angle", "pose angle error, degrees", ""), ("front_rmse", "rms error of the imprint, mm", "_rmse")]:
            front(report[key], None, title.format(what.split(",")[0]), time, what, file.with_name(file.stem + suffix + ".png"))
