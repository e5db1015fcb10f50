"""A numpy twin of the lab's planar ICP, and the cases that the Rust loop is held against.

Written from a description of the lab's `evaluation/pose_estimators.py` (lines 153-281) and `ICP_dataset_cal.py`
(lines 127-153, 682-798), in its plane and with its signs, as literally as possible: the model is moved, every distance
is computed, all iterations are run. Run `python lab_icp_twin.py` (needs numpy only) to write `lab_icp_twin.json`.

Frames: points are (x, y, z) in metres; x is the closing axis. The loop looks along x: a turn of +90 degrees about y
makes (z, y, -x) of (x, y, z), and only the first two are compared. A pose maps the model to the scene.
"""

import json
import math
from pathlib import Path

import numpy as np

ITERATIONS = 200


def project(points):
    return np.stack([points[:, 2], points[:, 1], -points[:, 0]], axis=1)


def start_matrix(theta, y, z):
    """The start as a 4 x 4 matrix in the projected coordinates (z, y, -x)."""
    c, s = math.cos(theta), math.sin(theta)
    grasp = np.array([[1, 0, 0, 0], [0, c, -s, y], [0, s, c, z], [0, 0, 0, 1.0]])
    turn = np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1.0]])
    return turn @ grasp @ turn.T


def nearest(queries, points):
    return ((queries[:, None, :] - points[None, :, :]) ** 2).sum(axis=2).argmin(axis=1)


def fit(scene, model):
    """The turn and shift in the plane (z, y) that take `model` closest to `scene`, pair by pair."""
    mu_s, mu_m = scene.mean(axis=0), model.mean(axis=0)
    w = (scene - mu_s).T @ (model - mu_m)
    phi = math.atan2(w[1, 0] - w[0, 1], w[0, 0] + w[1, 1])
    r = np.array([[math.cos(phi), -math.sin(phi)], [math.sin(phi), math.cos(phi)]])
    return phi, mu_s - r @ mu_m, r


def as_pose(phi, t):
    """[theta about +x, y, z] of the pose in the grasp frame; the plane (z, y) turns the other way."""
    return [-phi, t[1], t[0]]


def run(scene, model, start):
    """Poses before the first and after every iteration; the first is the planar pose nearest to what was applied."""
    scene2 = project(scene)[:, :2]
    full = project(model)
    model2 = full[:, :2]
    t4 = start_matrix(*start)
    moved = (full @ t4[:3, :3].T + t4[:3, 3])[:, :2]
    phi, t, _ = fit(moved, model2)
    poses = [as_pose(phi, t)]
    for _ in range(ITERATIONS):
        pairs = nearest(scene2, moved)
        phi, t, r = fit(scene2, model2[pairs])
        moved = model2 @ r.T + t
        poses.append(as_pose(phi, t))
    return poses


def mean_square(scene, model, pose):
    theta, y, z = pose
    c, s = math.cos(theta), math.sin(theta)
    moved = np.stack([c * model[:, 1] - s * model[:, 2] + y, s * model[:, 1] + c * model[:, 2] + z], axis=1)
    return ((scene[:, None, 1:] - moved[None, :, :]) ** 2).sum(axis=2).min(axis=1).mean()


def el_shape(rng, count, thickness):
    """Points on the two flat sides and the rim of an L of 40 x 25 mm with 6 mm wide legs."""
    out = []
    while len(out) < count:
        y, z = rng.uniform(0, 0.025), rng.uniform(0, 0.040)
        if y < 0.006 or z < 0.006:
            out.append([rng.choice([-0.5, 0.5]) * thickness, y - 0.008, z - 0.015])
    return np.array(out)


def contacts(rng, model, theta, y, z, noise, blob):
    """Model points at a pose with noise, and a share of them in a blob beside the tool."""
    pick = model[rng.choice(len(model), 120)] + rng.normal(0, noise, (120, 3))
    c, s = math.cos(theta), math.sin(theta)
    moved = np.stack([pick[:, 0], c * pick[:, 1] - s * pick[:, 2] + y, s * pick[:, 1] + c * pick[:, 2] + z], axis=1)
    lost = rng.random(120) < blob
    moved[lost, 1:] = np.array([0.02, 0.012]) + rng.normal(0, 0.002, (lost.sum(), 2))
    return moved


def main():
    rng = np.random.default_rng(7)
    cases = []
    for name, theta, y, z, thickness, blob, multi in [
        ("one start", 0.16, 0.002, -0.001, 0.006, 0.0, False),
        ("one start, large angle, blob", -0.37, -0.004, 0.003, 0.006, 0.15, False),
        ("three starts", 0.3, 0.001, 0.004, 0.006, 0.1, True),
    ]:
        # Rounded to the nanometre before use, so that the file is short and both sides see the same numbers.
        model = np.round(el_shape(rng, 300, thickness), 9)
        scene = np.round(contacts(rng, model, theta, y, z, 2e-4, blob), 9)
        starts = [[0.0, 0.0, 0.0]]
        if multi:
            starts = [[math.radians(-22.5), 0.0, 0.0], [math.radians(12.5), 0.0033, -0.0078], [math.radians(22.5), -0.01, 0.0056]]
        runs = [run(scene, model, start) for start in starts]
        ends = [poses[-1] for poses in runs]
        cases.append(
            {
                "name": name,
                "model": (model * 1e9).round().astype(int).tolist(),
                "scene": (scene * 1e9).round().astype(int).tolist(),
                "starts": starts,
                # All of the first iterations, then a few; rad and metres.
                "iterations": [0, 1, 2, 3, 5, 8, 13, 21, 34, 55, 100, 200],
                "poses": [[[float(f"{v:.15g}") for v in poses[i]] for i in [0, 1, 2, 3, 5, 8, 13, 21, 34, 55, 100, 200]] for poses in runs],
                "scores": [mean_square(scene, model, end) for end in ends],
                "winner": int(np.argmin([mean_square(scene, model, end) for end in ends])),
            }
        )
    Path(__file__).with_suffix(".json").write_text(json.dumps(cases, separators=(",", ":")) + "\n")
    for case in cases:
        print(case["name"], "applied", [round(math.degrees(p[0][0]), 2) for p in case["poses"]],
              "ends", [round(math.degrees(p[-1][0]), 3) for p in case["poses"]], "winner", case["winner"], case["scores"])


if __name__ == "__main__":
    main()
