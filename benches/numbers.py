"""Command line of `./study`: measures what the results folder lacks, or the steps that are named, and writes docs/numbers.md.

Of each step the folder keeps a file of figures; the page gets a section of each, and keeps the sections of steps without one.
`--real`, `--other` and `--python` give what does not come with the repository; the steps that need it are left out otherwise.
"""

import argparse
import json
import re
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

from .program import MODELS, ROOT, Program, Refused, machine, today

PAGE = ROOT / "docs" / "numbers.md"
HEAD = """# Numbers

Written by `./study`, not by hand. Brackets hold 95 % intervals: bootstrap over grasps in tables, Wilson's score for counts. Rows marked \
*published* are the paper's and its lab's, on real data: compare the order, not the decimals. Everything else is simulated unless it \
says real. [Words](glossary.md) and `touch2touch evaluate --help` explain the columns. OTHER are 40 grasps of an independent \
simulator, REAL 36 published real pairs; neither is part of the repository."""

GENERATOR = ("--bundle", MODELS / "generator_ldm")
SHIPPED = (*GENERATOR, "--mask-bundle", MODELS / "mask_unet")
CLASSIFIER = ("--classifier", MODELS / "tool_classifier")


class Bench:
    """Both programs, and the folders that were named."""

    def __init__(self, programs, out, places):
        self.verbs, self.benches = (Program(programs / name, out) for name in ("touch2touch", "touch2touch-bench"))
        self.out, self.places = out, places
        out.mkdir(parents=True, exist_ok=True)

    def verb(self, *words):
        return self.verbs.run(*words)

    def bench(self, name, *words):
        """A benchmark; its file lies in `out`."""
        file = self.out / f"{name}.json"
        return self.benches.write(file, *words)

    def cases(self, name, *words):
        """A folder of fresh cases; the same seed writes the same."""
        folder = self.out / "cases" / name
        words = ("cases", "--out", folder, *words)
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
    """A measurement: a word, what it is, the functions that make its figures and their table, and what it needs to be given."""

    name: str
    what: str
    figures: Callable[[Bench], dict]
    table: Callable[[dict], str]
    needs: tuple[str, ...] = ()


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


def front(bench):
    """Error against time of samplers, steps and engines."""
    answer = bench.bench("generator", "generator", "--grasps", "24")
    keys = ("name", "engine", "sampler", "steps", "median_ms", "share_of_reference", "rmse_mm", "psnr_db")
    rows = [{key: row[key] for key in keys} | {"mean_deg": row["angles"]["mean_deg"]} for row in answer["rows"]]
    return {"rows": rows, "measured_deg": answer["measured"]["mean_deg"], "defaults": answer["defaults"], "knees": answer["knees"],
            "first": answer["first"], "overhead": answer["overhead"], "load": answer["machine"]["load_1min"]}


# Sensors of the trials: the option.
SENSORS = {"nominal": (), "drawn": ("--sensors", "77"), "other_gelslims": ("--gelslims", "77")}


def tried(method):
    """A row of the trials."""
    return {"method": method["method"], "mean_deg": method["angle"]["mean_deg"], "success": method["success"],
            "with_verdict": method["with_verdict"]}


def trials(bench):
    found = {}
    for sensors, words in SENSORS.items():
        answer = bench.bench(f"trials_{sensors}", "trials", *SHIPPED, *words)
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


GROUPS = {"seen_tools": "Unseen grasps of seen tools", "unseen_tools": "Unseen tools"}
# Heading, the verb's name of the figure, digits.
COLUMNS = (("PSNR dB", "psnr_db", 1), ("clean dB", "psnr_noise_free_db", 1), ("SSIM", "ssim", 2),
           ("FD", "frechet", 2), ("angle °", "angle_deg", 1),
           ("≤5° %", "success_5", 1), ("≤10° %", "success_10", 1), ("place mm", "position_mm", 1), ("mask IoU", "mask_iou", 2),
           ("*good* %", "verdict_good", 0))
# Columns of a narrow table.
FEW = ("psnr_db", "ssim", "angle_deg", "success_5", "success_10")


def markdown(heads, rows, words=1):
    """A table: text to the left in the first columns, figures to the right."""
    lines = [heads, [*["---"] * words, *["--:"] * (len(heads) - words)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def number(figure, digits, interval=True):
    """A figure, with its 95 % interval where it has one."""
    if figure is None:
        return "-"
    if not isinstance(figure, dict):
        return f"{figure:.{digits}f}"
    text, ends = f"{figure['value']:.{digits}f}", [f"{end:.{digits}f}" for end in figure.get("interval") or ()]
    # An interval of no width says nothing.
    return f"{text} [{', '.join(ends)}]" if interval and set(ends) - {text} else text


def name_of(row):
    names = {"Measured (upper bound)": "measured imprint (upper bound)", "Latent diffusion, simulated data": "shipped latent diffusion"}
    return names.get(row["method"], row["method"]) + (" (published, real data)" if row.get("published") else "")


def group_of(row, group):
    return next((g for g in row["groups"] if g["group"] == group), None)


def group_table(answer, group, columns=COLUMNS, interval=True, named=name_of):
    """A group of `evaluate`'s table, the paper's rows below ours."""
    rows = [(row, group_of(row, group)) for row in answer["rows"] + answer["published"]]
    rows = [(row, figures) for row, figures in rows if figures]
    columns = [c for c in columns if any(figures.get(c[1]) is not None for _, figures in rows)]
    return markdown(["method", *(c[0] for c in columns)],
                    [[named(row), *(number(figures.get(c[1]), c[2], interval) for c in columns)] for row, figures in rows])


def results_table(found):
    text = []
    for group, words in GROUPS.items():
        ours = group_of(found["rows"][0], group)
        text += [f"**{words}** ({ours['grasps']} grasps of {ours['tools']} tools)", group_table(found, group)]
    return "\n\n".join(text)


CONDITION_WORDS = {"plain": "none", "ambiguous": "ambiguous (bare shaft)", "mixed": "mixed", "misaligned": "misaligned (up to 8 mm)",
              "noise": "noise on the GelSlim"}


def conditions_table(found):
    """The shipped generator on each condition, seen and unseen tools."""
    columns = [c for c in COLUMNS if c[1] in FEW or c[1] == "frechet"]
    text = []
    for group, words in GROUPS.items():
        rows = []
        for condition, label in CONDITION_WORDS.items():
            figures = group_of(next(r for r in found[condition]["rows"] if not r["upper_bound"]), group)
            rows.append([label, *(number(figures.get(c[1]), c[2], False) for c in columns)])
        text += [f"**{words}**", markdown(["fault of the pairs", *(c[0] for c in columns)], rows)]
    return "\n\n".join(text)


LAWS = {"other": "independent simulator", "own": "built-in simulator", "any_depth": "bubbles of any size and depth",
        "predicted": "built-in simulator, predicted imprints"}


def registration_table(found):
    """A table for each law: all engines and peers."""
    text = []
    for law, words in LAWS.items():
        if law not in found:
            continue
        rows = []
        for row in found[law]["engines"]:
            default = row["name"] == "joint"
            label = f"**{row['label']}**" if default else row["label"]
            rows.append([label, str(row["count"]), number(row["median_ms"], 2), number(row["p95_ms"], 2), number(row["cpu_mean_ms"], 2),
                         number(row["mean_deg"], 2), number(row["success_5"], 1), number(row["position_median_mm"], 2)])
        heads = ["engine", "grasps", "median ms", "p95 ms", "processor ms", "mean °", "≤5° %", "place mm"]
        text += [f"**Grasps of the {words}**", markdown(heads, rows)]
        whole = found[law]["depth_to_pose"]
        text += [f"Depth and mask to the pose by the default: {whole['median_ms']:.2f} ms (p95 {whole['p95_ms']:.2f} ms)."]
    return "\n\n".join(text)


def engine(found, name):
    return next(row for row in found["engines"] if row["name"] == name)


KINDS = {"spoilt": "degraded like a learned mask", "clean": "clean", "threshold=5": "all deeper than 5 mm",
         "threshold=2.5": "all deeper than 2.5 mm", "unet": "by the shipped mask model"}


def by_mask(laws):
    """Rows of the step `masks`: the law, the kind of mask, the mask alone and joint."""
    for law, kinds in laws.items():
        for kind, found in kinds.items():
            yield [LAWS[law], KINDS[kind]], engine(found, "distance_field"), engine(found, "joint")


def masks_table(found):
    """Joint registration and mask alone, by the mask; errors of joint in its own standard deviations."""
    rows = []
    for words, *both in by_mask(found):
        cells = [f"{e['mean_deg']:.2f}°, {e['success_5']:.1f} %, {e['median_ms']:.2f} ms" for e in both]
        joint = both[1]
        rms = [f"{rms:.2f} ({share:.0f} %)" for rms, share in zip(joint["rms"], joint["within_2"], strict=True)] if "rms" in joint else 3 * ["-"]
        rows.append([*words, str(joint["count"]), *cells, *rms])
    heads = ["grasps of", "mask", "N", "mask alone: mean, ≤5°, median", "joint (default)", "angle / σ", "y / σ", "z / σ"]
    return markdown(heads, rows, 2) + ("\n\nThe last three: errors of joint in its own standard deviations, root mean square (share within "
                                       "two); 1 and 95 % where they are right.")


# What the benchmark calls the faults, where that is too short.
FAULTS = {"wrong_unit": "model in another unit", "mirrored": "model mirrored", "blob": "blob in the mask", "half": "half of the mask gone",
          "swapped": "fingers swapped", "turned": "a camera turned by 10 to 20°", "blank": "one finger blank",
          "other_pair": "one imprint of another grasp"}


def verdict_table(found):
    """Faults by what the verdict calls them."""
    words = {"own": "built-in simulator", "predicted": "the same simulator, predicted imprints", "spoilt": "independent simulator",
             "unet": "independent simulator, masks by the shipped model"}
    sources = [s for s in words if s in found]
    rows = []
    for at, fault in enumerate(found["own"]["faults"]):
        of = [found[s]["faults"][at] for s in sources]
        rows.append([FAULTS.get(fault["fault"], fault["fault"].replace("_", " ")), *(f"{f['told']:.1f} % ({f['wrong']:.1f} %)" for f in of)])
    named = "; ".join(f"{words[s]} {found[s]['named']:.1f} %" for s in sources)
    trials = ", ".join(f"{words[s]}: {found[s]['faults'][0]['trials']}" for s in sources)
    return "\n\n".join([markdown(["fault", *(words[s] for s in sources)], rows),
                        f"*Check* or *wrong* (of these, *wrong*). The first row shows false alarms, over correct poses only. Grasps: {trials}. "
                        f"With every tool tried, the own one comes first: {named}."])


def doctor_table(found):
    return (f"{found['spoilt_sets']} data sets of {found['pairs']} pairs, each stored wrongly in one of {found['ways']} ways: "
            f"{100 * found['named_share']:.1f} % identified with no other finding, {100 * found['noticed_share']:.1f} % detected. "
            f"{found['near_sets']} slightly off in {found['near_ways']} ways: {found['near_noticed']} reported, "
            f"{found['near_sets'] - found['near_named']} wrongly. {found['sound_sets']} sound ones: {found['false_alarms']} false "
            f"alarms. {found['worsened']} sets got worse by the fix that was suggested.")


ENGINES = {"ort": "ONNX Runtime", "rten": "built-in engine"}
SAMPLERS = {"ddim": "DDIM", "ddpm": "DDPM"}
# Numbers of steps of the table; the result has them all.
STEPS_SHOWN = (1, 2, 10, 50, 200)


def front_table(found):
    """Samplers and some numbers of steps of each engine; the knee, and the wait for a first result."""
    sampler = lambda row: f"{SAMPLERS[row['sampler']]} {row['steps']}"
    text = []
    for engine, words in ENGINES.items():
        rows = []
        shown = (r for r in found["rows"] if r["engine"] == engine and r["steps"] in STEPS_SHOWN)
        for row in sorted(shown, key=lambda r: (r["sampler"], r["steps"])):
            part = row.get("share_of_reference")
            rows.append([sampler(row), number(row["median_ms"], 0), "-" if part is None else f"{100 * part:.1f}",
                         number(row["rmse_mm"], 2), number(row["psnr_db"], 1), number(row["mean_deg"], 2)])
        if rows:
            text += [f"**{words}**", markdown(["sampler, steps", "ms", "% of DDIM 200", "rms mm", "PSNR dB", "angle °"], rows)]
    knees = "; ".join(f"{ENGINES[k['engine']]}: {k['both']}" for k in found["knees"] if k.get("both"))
    first = "; ".join(f"{ENGINES[f['engine']]}: {f['cold_ms']:.0f} ms cold, {f['warm_ms']:.0f} ms warm" for f in found["first"])
    over = "; ".join(f"{ENGINES[o['engine']]}: {o['percent_of_shortest']:.1f} %" for o in found["overhead"])
    return "\n\n".join([*text, f"The default is {sampler(found['defaults'])}. Angle of the measured imprints by the same masks: {found['measured_deg']:.2f}°. "
                        f"Within 2 % of DDIM 200 in a tenth of its time ({knees or 'none'}). First result of a loaded bundle ({first}). "
                        f"Preparing pictures, sampler and meters over the bare graphs, shortest runs ({over})."])


def share(success):
    low, high = (100 * end for end in success["interval"])
    return f"{success['hits']}/{success['of']} ({low:.0f}-{high:.0f} %)"


SENSOR_WORDS = {"nominal": "The simulator's nominal sensors", "drawn": "Another pair of sensors (seed 77)",
           "other_gelslims": "GelSlims in other colors and with other dots (seed 77)"}


def trials_table(found):
    """Success of each tool by each method, with the verdict in the loop."""
    text = []
    for sensors, words in SENSOR_WORDS.items():
        heads, rows = [], []
        for tool, methods in found[sensors].items():
            row, heads = [tool], ["tool"]
            # The floor first.
            for method in sorted(methods, key=lambda m: not m["method"].startswith("No correction")):
                heads.append(name_of(method).replace("No", "no"))
                row.append(f"{number(method['mean_deg'], 1)}°, {share(method['success'])}")
            again = next(loop for loop in methods[1]["with_verdict"] if loop["after"] == "try")
            heads.append("the same, trying only where the verdict is *good*")
            row.append(f"{share(again['per_trial'])}, {again['regrasps']} grasped again")
            rows.append(row)
        text += [f"**{words}**", markdown(heads, rows)]
    paper = "; ".join(f"{p['what']} {share(p['share'])}" for p in found["published"])
    return "\n\n".join([*text, f"Published, the paper's diffusion model on a real robot: {paper}."])


PICTURES = (("PSNR dB", "psnr_db", 1), ("SSIM", "ssim", 3), ("angle °", "angle_deg", 1), ("≤5° %", "success_5", 0))


def scored(figures):
    """Figures of picture pairs; `adapt` keeps those of the angle by themselves."""
    angle = figures.get("angle") or {}
    figures = {"angle_deg": angle.get("mean_deg"), "success_5": angle.get("success_5"), **figures}
    return [number(figures.get(key), digits) for _, key, digits in PICTURES]


def mean_of_groups(row, key):
    """A figure over all pictures of a row whose groups are by picture: the mean, weighted by images."""
    of = [(g["images"], g[key]["value"]) for g in row["groups"] if g.get(key)]
    return sum(n * value for n, value in of) / sum(n for n, _ in of) if of else None


LEFT_OUT = {"grasps": "other grasps", "tools": "other tools"}


def real_table(found):
    """Scores on pairs that were left out, and time."""
    fits = found["fits"]
    rows = [["as shipped", "-", *scored(fits["tools"]["0"]["before"])]]
    for left_out, words in LEFT_OUT.items():
        for steps_tuned, fit in fits[left_out].items():
            name = f"fitted, and tuned for {steps_tuned} steps" if fit.get("after") else "fitted in closed form"
            rows.append([name, words, *scored(fit.get("after") or fit["closed_form"])])
    for row in found["stored"]["rows"]:
        if not row["upper_bound"] and row["method"] != "Latent diffusion, simulated data":
            rows.append([row["method"], "-", *scored({key: mean_of_groups(row, key) for _, key, _ in PICTURES})])
    first = fits["tools"]["0"]
    shipped, fitted = (group_mean(row, "psnr_db") for row in found["demo"]["rows"] if not row["upper_bound"])
    return (markdown(["generator", "fitted to pairs of", *(c[0] for c in PICTURES)], rows, 2) + f"\n\n{first['pairs']} pairs; "
            "cross-validated in three parts, each score on grasps or whole tools that were not fitted. Angles are from the pose of the "
            "measured imprint. On the built-in demo, which is another "
            f"rig, the model fitted to all of them has {fitted:.1f} dB where the shipped one has {shipped:.1f} dB.")


def group_mean(row, key):
    """A figure over the tools of all groups."""
    of = [(g["tools"], g[key]["value"]) for g in row["groups"] if g.get(key)]
    return sum(n * value for n, value in of) / sum(n for n, _ in of)


STEPS = (
    Step("results", "The paper's results table, on the simulated test set", results, results_table),
    Step("conditions", "The same on pairs with a fault, as in the paper's Table I", conditions, conditions_table),
    Step("real", "Real pairs: the shipped generator, and fitted to them", real, real_table, ("real",)),
    Step("front", "Error against time of a prediction", front, front_table),
    Step("registration", "Error against time of every registration", registration, registration_table),
    Step("masks", "Registration by kind of contact mask", masks, masks_table),
    Step("verdict", "The verdict as a fault detector", verdict, verdict_table),
    Step("doctor", "Wrongly stored data", doctor, doctor_table),
    Step("trials", "Robot tasks executed with the poses", trials, trials_table),
)


def section(step, kept):
    """A step's table, and the origin of its figures."""
    facts = kept["made"]
    made = f"`./study {step.name}`, {facts['date']} at commit {facts['commit']}, {facts['seconds']} s on {facts['machine']}."
    return "\n\n".join([f"## {step.what}", step.table(kept["figures"]), made])


def write(results):
    """Writes the page: sections of what the folder has, and of other steps what the page said before."""
    before = re.split(r"\n(?=## )", PAGE.read_text())[1:] if PAGE.exists() else []
    before = {part.split("\n", 1)[0].removeprefix("## "): part.strip() for part in before}
    parts = []
    for step in STEPS:
        file = results / f"{step.name}.json"
        parts.append(section(step, json.loads(file.read_text())) if file.exists() else before.get(step.what))
    PAGE.write_text("\n\n".join([HEAD, *filter(None, parts)]) + "\n")


def measure(step, args):
    """Writes a step's file into the results folder."""
    places = {name: getattr(args, name) for name in ("real", "other", "python")}
    bench = Bench(args.programs.resolve(), args.out.resolve(), places)
    begun, load = time.monotonic(), machine()
    figures = step.figures(bench)
    facts = {"date": today(), "commit": bench.verbs.commit(), "machine": load, "seconds": round(time.monotonic() - begun)}
    partial = args.results / f"{step.name}.partial"
    partial.write_text(json.dumps({"made": facts, "figures": figures}, ensure_ascii=False, indent=1))
    partial.replace(args.results / f"{step.name}.json")
    print(f"{step.name}: {facts['seconds']} s", flush=True)


def main():
    words = "\n".join(f"  {step.name:<14}{step.what}" + (f" (needs --{', --'.join(step.needs)})" if step.needs else "") for step in STEPS)
    parser = argparse.ArgumentParser(prog="./study", description=__doc__, epilog=f"steps:\n{words}",
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("steps", nargs="*", metavar="STEP", help="steps to make anew (default: those that the folder lacks)")
    parser.add_argument("--results", type=Path, default=ROOT / "target" / "study" / "results", metavar="DIR", help="results folder (default: target/study/results)")
    parser.add_argument("--real", type=Path, metavar="DIR", help="folder of real pairs")
    parser.add_argument("--other", type=Path, metavar="DIR", help="folder of cases with known truth by another simulator")
    parser.add_argument("--python", type=Path, metavar="PY", help="Python with open3d and small_gicp, the peers of the registration")
    parser.add_argument("--out", type=Path, default=ROOT / "target" / "study", help="folder of what is made on the way (default: target/study)")
    parser.add_argument("--programs", type=Path, default=ROOT / "target" / "release", help="folder of the programs (default: target/release)")
    args = parser.parse_args()
    unknown = set(args.steps) - {step.name for step in STEPS}
    if unknown:
        sys.exit(f"no step is named {', '.join(sorted(unknown))}; there are: {', '.join(step.name for step in STEPS)}")
    args.results.mkdir(parents=True, exist_ok=True)
    failed = False
    for step in STEPS:
        if step.name not in args.steps and (args.steps or (args.results / f"{step.name}.json").exists()):
            continue
        missing = [need for need in step.needs if not getattr(args, need)]
        if missing:
            print(f"{step.name}: left out, it needs --{', --'.join(missing)}", flush=True)
            continue
        try:
            measure(step, args)
        except Refused as why:
            print(f"{step.name}: {why}", file=sys.stderr, flush=True)
            failed = True
    write(args.results)
    sys.exit(failed)


if __name__ == "__main__":
    main()
