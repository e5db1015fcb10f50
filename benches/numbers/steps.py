"""The steps: what is measured for `docs/numbers.md`, by which commands, and what is kept of the answers."""

from dataclasses import dataclass
from typing import Callable

from ..program import MODELS, Program

GENERATOR = ("--bundle", MODELS / "generator_ldm")
SHIPPED = (*GENERATOR, "--mask-bundle", MODELS / "mask_unet")
CLASSIFIER = ("--classifier", MODELS / "tool_classifier")


class Bench:
    """Both programs, the folders that were named, and the commands that were given so far."""

    def __init__(self, programs, out, places):
        self.verbs, self.benches = (Program(programs / name, out) for name in ("touch2touch", "touch2touch-bench"))
        self.out, self.places, self.commands = out, places, []
        out.mkdir(parents=True, exist_ok=True)

    def said(self, name, words):
        """A command as a person would give it, folders by their names in capitals."""
        text = " ".join(map(str, words)).replace(str(self.out), "OUT").replace(str(MODELS), "assets/models")
        for place, path in self.places.items():
            text = text.replace(str(path), place.upper()) if path else text
        self.commands.append(f"{name} {text}")

    def verb(self, *words):
        self.said("touch2touch", words)
        return self.verbs.run(*words)

    def bench(self, name, *words):
        """A benchmark; its pictures lie beside its file in `out`."""
        file = self.out / f"{name}.json"
        self.said("touch2touch-bench", words)
        return self.benches.write(file, *words)

    def cases(self, name, *words):
        """A folder of fresh cases; the same seed writes the same."""
        folder = self.out / "cases" / name
        words = ("cases", "--out", folder, *words)
        self.said("touch2touch-bench", words)
        if not (folder / "done").exists():
            self.benches.run(*words)
            (folder / "done").touch()
        return folder


    def without_names(self, named):
        """The pictures of a folder, without the file that names their tools."""
        folder = self.out / "unnamed"
        folder.mkdir(exist_ok=True)
        for picture in named.glob("*.png"):
            (folder / picture.name).unlink(missing_ok=True)
            (folder / picture.name).symlink_to(picture.resolve())
        return folder


@dataclass(frozen=True)
class Step:
    """A measurement: a word, what it is, what it needs to be given, and the function that makes its figures."""

    name: str
    what: str
    figures: Callable[[Bench], dict]
    needs: tuple[str, ...] = ()


def rounded(value, digits=5):
    """Figures as they are kept: no more digits than anyone reads."""
    if isinstance(value, float):
        return round(value, digits)
    if isinstance(value, dict):
        return {key: rounded(item, digits) for key, item in value.items() if item is not None}
    return [rounded(item, digits) for item in value] if isinstance(value, list) else value


def table(answer):
    """Of `evaluate`: each row's groups."""
    rows = [{key: row[key] for key in ("method", "upper_bound", "groups")} for row in answer["rows"]]
    return {"rows": rows, "published": answer.get("published", []), "runtime": answer["runtime"]}


def results(bench):
    return table(bench.verb("evaluate", "test-set", *SHIPPED, *CLASSIFIER, "--paper"))


CONDITIONS = ("ambiguous", "mixed", "misaligned", "noise")


def conditions(bench):
    words = (*SHIPPED, *CLASSIFIER, "--grasps", "16")
    return {c: table(bench.verb("evaluate", "test-set" if c == "plain" else f"test-set-{c}", *words)) for c in ("plain", *CONDITIONS)}


def engines(answer):
    """Of `registration`: the engines' errors and times over all cases."""
    keys = ("name", "label", "peer", "count", "mean_deg", "success_5", "success_10", "position_median_mm", "median_ms", "p95_ms",
            "cpu_mean_ms")
    kept = []
    for row in answer["engines"]:
        kept.append({key: row[key] for key in keys})
        if row["reliability"]:
            kept[-1] |= {key: row["reliability"][key] for key in ("rms", "within_2")}
    return {"engines": kept, "depth_to_pose": answer["depth_to_pose"], "notes": answer["notes"], "load": answer["machine"]["load_1min"]}


def laws(bench):
    """Cases of the built-in simulator, and of the other one where its folder was named."""
    found = {"own": bench.cases("own", "--count", "120", "--seed", "5151")}
    return {"other": bench.places["other"], **found} if bench.places["other"] else found


def registration(bench):
    """Every engine and every peer on spoilt masks."""
    python = ("--python", bench.places["python"]) if bench.places["python"] else ("--no-peers",)
    return {law: engines(bench.bench(f"registration_{law}", "registration", "--cases", folder, *python))
            for law, folder in laws(bench).items()}


# A threshold that the law's imprints are pressed beyond, millimeters.
THRESHOLDS = {"own": "5", "other": "2.5"}
BOTH = ("--engines", "joint,distance_field", "--no-peers")


def predicted(bench, seed):
    """Cases of the built-in simulator with what the shipped generator predicts in the place of the imprints."""
    return bench.cases(f"predicted_{seed}", "--count", "100", "--seed", str(seed), "--predicted", *GENERATOR)


def masks(bench):
    """The registration by membrane and mask, and that by the mask alone, on masks of every kind."""
    found = {}
    for law, folder in laws(bench).items():
        for kind in ("spoilt", "clean", f"threshold={THRESHOLDS[law]}", "unet"):
            words = ("registration", "--cases", folder, "--masks", kind, *BOTH)
            found.setdefault(law, {})[kind] = engines(bench.bench(f"masks_{law}_{kind.split('=')[0]}", *words))
    folder = bench.cases("any_depth", "--count", "100", "--seed", "6161", "--any-depth")
    for kind in ("spoilt", "unet"):
        answer = bench.bench(f"masks_any_depth_{kind}", "registration", "--cases", folder, "--masks", kind, *BOTH)
        found.setdefault("any_depth", {})[kind] = engines(answer)
    answer = bench.bench("masks_predicted", "registration", "--cases", predicted(bench, 6161), "--masks", "unet", *BOTH)
    return found | {"predicted": {"unet": engines(answer)}}


def verdict(bench):
    """The verdict on grasps with a known fault."""
    answer = bench.bench("verdict", "verdict", "--count", "400", "--simulation-seed", "202")
    found = {"own": {key: answer[key] for key in ("faults", "named")}}
    if bench.places["other"]:
        for kind in ("spoilt", "unet"):
            answer = bench.bench(f"verdict_{kind}", "verdict", "--cases", bench.places["other"], "--masks", kind)
            found[kind] = {key: answer[key] for key in ("faults", "named")}
    answer = bench.bench("verdict_predicted", "verdict", "--cases", predicted(bench, 8181), "--masks", "unet")
    return found | {"predicted": {key: answer[key] for key in ("faults", "named")}}


def doctor(bench):
    other = ("--cases", bench.places["other"]) if bench.places["other"] else ()
    answer = bench.bench("doctor", "doctor", "--sets", "1", "--sound", "3", "--seed", "77", *other)
    keys = ("pairs", "named_share", "noticed_share", "sound_sets", "false_alarms", "worsened")
    counts = {f"{kind}_{key}": sum(row[key] for row in answer[kind]) for kind in ("spoilt", "near") for key in ("sets", "named", "noticed")}
    return {key: answer[key] for key in keys} | counts | {"ways": len(answer["spoilt"]), "near_ways": len(answer["near"])}


def dataset(bench):
    answer = bench.bench("dataset", "dataset")
    keys = ("pairs", "tools", "points_to_pose", "depth_to_pose")
    return {key: answer[key] for key in keys} | {"load": answer["machine"]["load_1min"]}


def front(bench):
    """Error against time of samplers, steps and engines."""
    answer = bench.bench("generator", "generator", "--grasps", "24")
    keys = ("name", "engine", "sampler", "steps", "median_ms", "share_of_reference", "rmse_mm", "psnr_db")
    rows = [{key: row[key] for key in keys} | {"mean_deg": row["angles"]["mean_deg"]} for row in answer["rows"]]
    return {"rows": rows, "measured_deg": answer["measured"]["mean_deg"], "defaults": answer["defaults"], "knees": answer["knees"],
            "first": answer["first"], "overhead": answer["overhead"], "load": answer["machine"]["load_1min"]}


# Sensors of the trials: the verb's option.
SENSORS = {"nominal": (), "drawn": ("--sensors", "77"), "other_gelslims": ("--gelslims", "77")}
ROOMS_M = (0.0005, 0.002, 0.005)


def tried(method):
    """A row of the trials."""
    sweep = {f"{1000 * s['clearance_m']:g}": s["success"] for s in method["sweep"] if any(abs(s["clearance_m"] - r) < 1e-9 for r in ROOMS_M)}
    return {"method": method["method"], "mean_deg": method["angle"]["mean_deg"], "success": method["success"], "sweep": sweep,
            "with_verdict": method["with_verdict"]}


def trials(bench):
    found = {}
    for sensors, words in SENSORS.items():
        answer = bench.verb("trials", *SHIPPED, *words)
        found[sensors] = {tool["tool"]: [tried(method) for method in tool["methods"]] for tool in answer["tools"]}
        found["published"] = answer["published"]
    return found


def real(bench):
    """Real pairs: as shipped, fitted and tuned, on grasps and on tools that were left out, and what lies beside them."""
    named = bench.places["real"]
    keys = ("before", "closed_form", "after", "pairs", "touches", "steps", "seconds", "fit_seconds")
    fits = {}
    # Whole tools are left out where they are named.
    for left_out, pairs in (("tools", named), ("grasps", bench.without_names(named))):
        answers = {steps: bench.verb("adapt", pairs, *GENERATOR, "--tune", steps, "--validate", 3) for steps in (0, 50)}
        fits[left_out] = {str(steps): {key: answer[key] for key in keys} for steps, answer in answers.items()}
    fitted = bench.out / "fitted_real"
    bench.verb("adapt", named, *GENERATOR, "--validate", 0, "--force", "--replace", "--out", fitted)
    demo = bench.verb("evaluate", "demo", *GENERATOR, "--bundle", fitted, "--grasps", 8)
    return {"fits": fits, "stored": table(bench.verb("evaluate", named, *GENERATOR)), "demo": table(demo)}


STEPS = (
    Step("results", "The paper's results table, on the simulated test set", results),
    Step("conditions", "The same on pairs with a fault, as in the paper's Table I", conditions),
    Step("real", "Real pairs: the shipped generator, and fitted to them", real, ("real",)),
    Step("front", "Error against time of a prediction", front),
    Step("registration", "Error against time of every registration", registration),
    Step("masks", "Registration by the contact mask that it is given", masks),
    Step("verdict", "The verdict as a detector of faults", verdict),
    Step("doctor", "Data stored wrongly, and told from sound ones", doctor),
    Step("dataset", "A whole data set on all cores", dataset),
    Step("trials", "What a robot would do with the poses", trials),
)
