"""The file of the study: a row for a line, and the paired differences between rows.

{"rows": [{"settings", "made", "groups", "grasps"}], "differences": [{"from", "to", "groups"}]}. `groups` are the verb's own
figures with their intervals. `grasps` holds of each tool, in the order of its grasps, root mean square error (0.1 um), SSIM
(1e-4; measured imprints have neither) and angle error (0.01 degrees; null: no pose), so that a row made on another day can be compared grasp by grasp.
"""

import json
import os
from pathlib import Path

from . import paired


def compact(scores):
    """The figures of every grasp, rounded, by tool."""
    tools = {}
    for grasp in sorted(scores["grasps"], key=lambda g: (g["tool"], int(g["pair"].rsplit("_", 1)[1]))):
        squares, pixels = (sum(image["error"][key] for image in grasp["images"]) for key in ("sum", "pixels"))
        ssim = [image["ssim"] for image in grasp["images"] if image["ssim"] is not None]
        tool = tools.setdefault(grasp["tool"], {"group": grasp["group"], "rms": [], "ssim": [], "angle": []})
        tool["rms"].append(round((squares / pixels) ** 0.5 * 1e7) if pixels else None)
        tool["ssim"].append(round(sum(ssim) / len(ssim) * 1e4) if ssim else None)
        angle = grasp["angle_error_rad"]
        tool["angle"].append(None if angle is None else round(angle * 18000 / 3.141592653589793))
    return tools


class Rows:
    """The rows of a file, read anew before each change."""

    def __init__(self, path):
        self.path = Path(path)

    def read(self):
        return json.loads(self.path.read_text())["rows"] if self.path.exists() else []

    def find(self, settings):
        return next((row for row in self.read() if row["settings"] == settings), None)

    def add(self, row):
        """Puts a row into the file, and its differences from the others."""
        rows = [r for r in self.read() if r["settings"] != row["settings"]] + [row]
        text = '{"rows": [\n%s\n],\n"differences": [\n%s\n]}\n' % tuple(
            ",\n".join(json.dumps(item) for item in items) for items in (rows, paired.differences(rows)))
        self.path.parent.mkdir(parents=True, exist_ok=True)
        partial = self.path.with_suffix(".partial")
        partial.write_text(text)
        os.replace(partial, self.path)
