"""What the study asks of the product: shards, other sensors' data sets, fits, and every figure of every row."""

from pathlib import Path

from benches.program import MODELS, Program, Refused

__all__ = ["MODELS", "Product", "Refused"]


class Product(Program):
    """`touch2touch` at a path, asked for what the rows need."""

    def shards(self, condition, grasps, seed):
        """The folder of the training shards of a condition; those that are there are not written again."""
        folder = self.place / "shards" / condition
        bench = Program(Path(self.path).with_name("touch2touch-bench"), self.place)
        bench.run("training-data", "simulator", "--grasps", grasps, "--condition", condition, "--seed", seed, "--out", folder)
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

    def evaluate(self, bundle, data, shift, grasps):
        """The verb's answer with every grasp, and the command that gave it."""
        words = ["evaluate", data, "--bundle", bundle, "--mask-bundle", MODELS / "mask_unet", "--classifier",
                 MODELS / "tool_classifier", "--shift", shift, "--pairs", *(("--grasps", grasps) if grasps else ())]
        said = " ".join(map(str, words)).replace(str(self.place), "OUT").replace(str(MODELS), "assets/models")
        return self.run(*words), said
