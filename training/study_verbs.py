"""What the study asks of the product: shards, other sensors' data sets, fits, and every figure of every row."""

import json
import os
import subprocess
from pathlib import Path

from .data import sha256

MODELS = Path(__file__).resolve().parent.parent / "assets" / "models"


class Refused(Exception):
    """The program refused a command; its last words."""


class Program:
    """`touch2touch` at a path; what it keeps lies under `place`."""

    def __init__(self, path, place):
        self.path, self.place = str(path), Path(place).resolve()
        self.environment = {**os.environ, "TOUCH2TOUCH_CACHE": str(self.place / "cache"),
                            "TOUCH2TOUCH_DATA": str(self.place / "kept"), "TOUCH2TOUCH_MODELS": str(MODELS)}

    def run(self, *words):
        """The JSON object of a verb. Exit code 1 is an answer with something missing, and says so in it."""
        command = [self.path, *map(str, words), "--json"]
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1) or not done.stdout:
            raise Refused(f"{' '.join(command)}: {done.stderr.strip()[-600:]}")
        return json.loads(done.stdout)

    def version(self):
        """Version and commit as the program says them, and which file it is: a build for development does not know."""
        done = subprocess.run([self.path, "--version"], env=self.environment, capture_output=True, text=True, check=True)
        said = ", ".join(" ".join(line.split()) for line in done.stdout.splitlines()[:2])
        return f"{said}, sha256 {sha256(self.path)[:12]}"

    def shards(self, condition, grasps, seed):
        """The folder of the training shards of a condition; those that are there are not written again."""
        folder = self.place / "shards" / condition
        self.run("training-data", "simulator", "--grasps", grasps, "--condition", condition, "--seed", seed, "--out", folder)
        return folder

    def other(self, name, seed):
        """Data sets of sensors that are not the nominal ones: pairs to fit to, and the test grasps."""
        option = {"other-sensors": "--sensors", "other-gelslims": "--gelslims"}[name]
        folder = self.place / name
        for part, words in (("fit", ("--tools", "seen", "--grasps", 4, "--seed", seed)), ("test", ("--test-set",))):
            if not (folder / part / "simulated.json").exists():
                self.run("simulate", *words, option, seed, "--out", folder / part)
        return folder / "fit", folder / "test"

    def fitted(self, bundle, data, pairs, steps, out):
        """A bundle fitted to some pairs by `adapt`."""
        if not (out / "manifest.json").exists():
            self.run("adapt", data, "--bundle", bundle, "--limit", pairs, "--tune", steps, "--validate", 0, "--force",
                     "--out", out)
        return out

    def evaluate(self, bundle, data, shift, grasps, features):
        """The verb's answer with every grasp, and the command that gave it."""
        words = ["evaluate", data, "--bundle", bundle, "--mask-bundle", MODELS / "mask_unet", "--classifier",
                 MODELS / "tool_classifier", "--shift", shift, "--pairs", *(("--grasps", grasps) if grasps else ()),
                 *(("--features", features) if features else ())]
        said = " ".join(map(str, words)).replace(str(self.place), "OUT").replace(str(MODELS), "assets/models")
        return self.run(*words), said
