"""The file of the study: a row for a line, and the paired differences between rows.

{"rows": [{"settings", "made", "groups"}], "differences": [{"from", "to", "groups"}]}. `groups` are the verb's own figures with
their intervals; `from` and `to` are settings, those of `to` only where they differ.
"""

import hashlib
import json
import os
from pathlib import Path

from .study_paired import differences as less
from .study_paired import generator
from .study_runs import REFERENCE


def differ(a, b):
    """The setting by which two rows are compared, in a list: the only one in which they differ, if one of them has the reference's."""
    keys = [key for key in a if a[key] != b.get(key)]
    if len(keys) != 1 or a.keys() != b.keys():
        return []
    key, = keys
    return keys if key == "samples" or key in REFERENCE and REFERENCE[key] in (a[key], b[key]) else []


class Rows:
    """The rows of a file, read anew before each change; every grasp of a row lies in `place`, for later ones to be compared with."""

    def __init__(self, path, place):
        self.path, self.place = Path(path), Path(place)

    def read(self):
        return json.loads(self.path.read_text()) if self.path.exists() else {"rows": [], "differences": []}

    def find(self, settings):
        return next((row for row in self.read()["rows"] if row["settings"] == settings), None)

    def grasps(self, settings):
        """The file of a row's grasps."""
        return self.place / f"{hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:16]}.json"

    def alike(self, settings):
        """Rows that differ in one setting and whose grasps are here: their settings."""
        known = (row["settings"] for row in self.read()["rows"])
        return [other for other in known if differ(other, settings) and self.grasps(other).exists()]

    def add(self, row, answer, alike):
        """Puts a row into the file with its differences from rows that are alike, and its grasps beside it."""
        self.place.mkdir(parents=True, exist_ok=True)
        file = self.read()
        rows = [r for r in file["rows"] if r["settings"] != row["settings"]] + [row]
        differences = [d for d in file["differences"] if row["settings"] not in (d["from"], d["from"] | d["to"])]
        for before in alike:
            key, = differ(before, row["settings"])
            earlier = generator(json.loads(self.grasps(before).read_text()))
            groups = less(earlier, generator(answer))
            differences.append({"from": before, "to": {key: row["settings"][key]}, "groups": groups})
        text = '{"rows": [\n%s\n],\n"differences": [\n%s\n]}\n' % tuple(
            ",\n".join(json.dumps(item) for item in items) for items in (rows, differences))
        self.path.parent.mkdir(parents=True, exist_ok=True)
        for path, content in ((self.grasps(row["settings"]), json.dumps(answer)), (self.path, text)):
            partial = path.with_suffix(".partial")
            partial.write_text(content)
            os.replace(partial, path)
