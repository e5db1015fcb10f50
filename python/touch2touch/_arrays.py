"""Writes arrays, from any container, as a folder of pictures."""

import csv
import json
from pathlib import Path

import numpy as np

from ._native import Refused, open as open_data, png

# The lab's sensors: (height, width) of the GelSlim and the Soft Bubble.
_LAB = (320, 427), (140, 175)


def _pictures(name, values):
    """Color pictures as (N, height, width, 3) bytes."""
    values = np.asarray(values)
    if values.ndim < 3 or values.shape[-1] != 3:
        raise Refused(f"{name} must be (N, height, width, 3), red, green, blue, not {values.shape}")
    if values.dtype == np.uint8:
        return values
    if not np.isfinite(values).all() or values.min(initial=0) < 0 or not 1 < values.max(initial=255) <= 255:
        raise Refused(f"{name} must be on the scale 0..255, without NaN")
    return np.round(values).astype(np.uint8)


def _sensor(key, kind, shape, px_per_mm):
    return {"key": key, "name": key.capitalize(), "kind": kind, "width": shape[1], "height": shape[0], "px_per_m": 1e3 * px_per_mm}


def _rig(color, depth, px_per_mm):
    if px_per_mm is None:
        raise Refused("px_per_mm must say the pixels per mm on the touched surface: (color, depth), or one for both")
    color_scale, depth_scale = np.broadcast_to(np.asarray(px_per_mm, float), 2).tolist()
    sensors = [_sensor("color", "color", color, color_scale)]
    if depth is not None:
        sensors.append(_sensor("depth", "depth", depth, depth_scale))
    return {"name": "From arrays", "sensors": sensors, "pads": [{"key": "finger", "name": "Finger"}]}


def from_arrays(color, reference, depth=None, *, out, names=None, tool=None, finger=None, px_per_mm=None, rig=None):
    """Writes touches as a folder of pictures with `rig.json`, which the studio, every verb and `open` read, and opens it.

    `color`: (N, height, width, 3), in contact, red, green, blue, 0..255. `reference`: without contact, one picture or N. `depth`:
    (N, h, w), deflection of the membrane or gel in meters, NaN where not measured, in the camera's orientation. `out`: a new
    folder. `names`, `tool`, `finger`: one value per touch, `tool` and `finger` also one for all; put CAD models into
    `out/tools_stls`. `px_per_mm`: pixels per mm on the contact surface, (color, depth); optional for pictures of the lab's size.
    `rig`: the content of `rig.json` as a dictionary instead.
    """
    color, reference = _pictures("color", color), _pictures("reference", reference)
    if color.ndim != 4 or not len(color):
        raise Refused(f"color must be (N, height, width, 3) of one touch or more, not {color.shape}")
    count, size = len(color), color.shape[1:3]
    if reference.shape not in (color.shape, color.shape[1:], (1, *color.shape[1:])):
        raise Refused(f"reference must be {color.shape[1:]} or {color.shape}, not {reference.shape}")
    if depth is not None:
        depth = np.asarray(depth, np.float32)
        if depth.ndim != 3 or len(depth) != count:
            raise Refused(f"depth must be ({count}, height, width), not {depth.shape}")
        deepest = np.abs(depth[np.isfinite(depth)]).max(initial=0)
        if deepest > 0.08:
            raise Refused(f"depth reaches {deepest:.3g}: it must be how far the surface is pushed in, in meters")
    names = [f"{at:04}" for at in range(count)] if names is None else [str(name) for name in names]
    bad = [name for name in names if not name or name[0] == "." or "/" in name or "\\" in name]
    if len(names) != count or len(set(names)) != count or bad:
        raise Refused(f"names must be {count} different file names{', not ' + repr(bad[0]) if bad else ''}")
    tools = [tool] * count if tool is None or isinstance(tool, str) else list(tool)
    fingers = [finger] * count if finger is None or isinstance(finger, str) else list(finger)
    if len(tools) != count or len(fingers) != count:
        raise Refused(f"tool and finger must be one for all or {count}")
    is_lab = size == _LAB[0] and (depth is None or depth.shape[1:] == _LAB[1]) and px_per_mm is None
    if rig is None and not is_lab:
        rig = _rig(size, None if depth is None else depth.shape[1:], px_per_mm)
    keys = {sensor["kind"]: sensor["key"] for sensor in reversed(rig["sensors"])} if rig else {"depth": "bubble"}
    if depth is not None and "depth" not in keys:
        raise Refused("rig declares no depth sensor")
    out = Path(out)
    if out.exists() and any(out.iterdir()):
        raise Refused(f"{out} is not empty; choose a new folder")
    out.mkdir(parents=True, exist_ok=True)
    if rig:
        (out / "rig.json").write_text(json.dumps(rig, indent=2) + "\n")
    common = reference.size == color[0].size
    if common:
        (out / "reference.png").write_bytes(png(reference.reshape(color.shape[1:])))
    if any(tools):
        with (out / "tools.csv").open("w", newline="") as file:
            write = csv.writer(file)
            write.writerow(["pair", "tool", *(["finger"] if any(fingers) else [])])
            write.writerows([name, tool, *([finger or ""] if any(fingers) else [])] for name, tool, finger in zip(names, tools, fingers) if tool)
    for at, name in enumerate(names):
        (out / f"{name}_touch.png").write_bytes(png(color[at]))
        if not common:
            (out / f"{name}_reference.png").write_bytes(png(reference[at]))
        if depth is not None:
            np.save(out / f"{name}_{keys['depth']}.npy", depth[at])
    return open_data(out)
