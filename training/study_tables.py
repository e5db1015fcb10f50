"""The rows of `training.study` as Markdown, in the paper's form: its tables of methods, conditions and ablations, and one of fits."""

from benches.numbers import COLUMNS, GROUPS, group_of, markdown, number

from . import study_runs
from .study_runs import CONDITIONS, REFERENCE, SHIFTS, test_set

SHOWN = [c for c in COLUMNS if c[1] in ("psnr_db", "psnr_noise_free_db", "ssim", "frechet", "angle_deg", "success_5", "success_10")]
# Columns of the paired differences.
PAIRED = [c for c in SHOWN if c[1] in ("psnr_db", "ssim", "angle_deg", "success_5", "success_10")]


def plain(settings, *but):
    """All settings are the reference's, save these; what was not trained here (measured, shipped) counts as plain."""
    return all(settings.get(key, value) == value for key, value in REFERENCE.items() if key not in but)


def label(settings, varied):
    """Name of a row among those that differ in the settings `varied`, in words."""
    parts = []
    if "method" in varied:
        parts += [settings["method"], *([f"{settings['samples']:,} samples"] if settings.get("samples") else [])]
    if "condition" in varied:
        parts.append(f"trained {settings['condition']}")
    if "geometry" in varied:
        on = [name for name in ("rotation", "flip") if settings[name]]
        parts += ["both" if len(on) == 2 else on[0] if on else "neither", *([settings["geometry"]] if settings["geometry"] != "full" else [])]
    if settings.get("shift", "exact") != "exact":
        parts.append({"paper": "shifted (paper)", "raw": "without shift"}[settings["shift"]])
    if settings.get("fit"):
        pairs, steps = settings["fit"]
        parts.append(f"fitted to {pairs} pairs" + (f" and tuned {steps} steps" if steps else ""))
    return ", ".join(parts)


def tested(settings):
    return settings["test"].removeprefix("test-set").strip("-") or "plain"


def table(rows, group, varied):
    """Figures of the rows, those of a test set together; the first column says which where there are several."""
    of = [(row, group_of(row, group)) for row in rows]
    of = [(row, figures) for row, figures in of if figures]
    columns = [c for c in SHOWN if any(figures.get(c[1]) is not None for _, figures in of)]
    several = len({row["settings"]["test"] for row in rows}) > 1
    lines = [[*([tested(row["settings"])] if several else []), label(row["settings"], varied),
              *(number(figures.get(key), digits) for _, key, digits in columns)] for row, figures in of]
    return markdown([*(["tested on"] if several else []), "row", *(c[0] for c in columns)], lines, 1 + several)


def against(found, budgets):
    """A difference as (row, reference, sign), or `None`: of samples, the reference is the next smaller number."""
    one, other = found["from"], found["from"] | found["to"]
    key, = found["to"]
    if key == "samples":
        one_before = budgets.index(other[key]) - budgets.index(one[key])
        return {1: (other, one, 1), -1: (one, other, -1)}.get(one_before)
    if one.get(key) == REFERENCE[key]:
        return other, one, 1
    return (one, other, -1) if other[key] == REFERENCE[key] else None


def turned(figure, sign):
    """A difference taken the other way round."""
    if figure is None or sign > 0:
        return figure
    low, high = figure.get("interval") or (None, None)
    return {"value": -figure["value"], "interval": [-high, -low]} if low is not None else {"value": -figure["value"]}


def paired(differences, budgets, group, varied):
    """Row less reference; in bold where the interval has no 0 in it."""
    lines = []
    for found in differences:
        figures, ends = group_of(found, group), against(found, budgets)
        if not figures or not ends:
            continue
        row, reference, sign = ends
        cells = []
        for _, key, digits in PAIRED:
            figure = turned(figures.get(key), sign)
            text, interval = number(figure, digits), (figure or {}).get("interval")
            cells.append(f"**{text}**" if interval and interval[0] * interval[1] > 0 else text)
        lines.append((order(row), [tested(row), label(row, varied), label(reference, varied), *cells]))
    lines.sort(key=lambda line: line[0])
    several = len({cells[0] for _, cells in lines}) > 1
    heads = [*(["tested on"] if several else []), "row", "less", *(c[0] for c in PAIRED)]
    return markdown(heads, [cells if several else cells[1:] for _, cells in lines], 2 + several) if lines else None


TESTS = (*map(test_set, CONDITIONS), "other-sensors", "other-gelslims")
METHODS = ("measured imprints", "shipped generator", *study_runs.METHODS)


def order(settings):
    """By test set; then what was not trained here, and by budget, method and what else differs, the reference first."""
    others = [settings.get(key, value) != value for key, value in REFERENCE.items() if key != "method"]
    return (TESTS.index(settings["test"]), settings.get("samples") or 0, METHODS.index(settings["method"]), sum(others), others[::-1],
            CONDITIONS.index(settings.get("condition", "plain")), tuple(settings.get("fit") or ()), SHIFTS.index(settings.get("shift", "exact")))


# The tables: a heading, what they say, the start of the test sets' names, and the settings in which rows differ.
SECTIONS = (
    ("Methods at equal budgets", "As the paper's results table: unseen grasps of tools that were trained on, and tools that were not.",
     "test-set", ("method", "samples", "shift")),
    ("Conditions", "Pairs with a fault, as in the paper's Table I: a latent diffusion trained on each kind, tested on each.",
     "test-set", ("condition",)),
    ("Ablations", "Pairs turned and mirrored while training (both, as the paper chose) and pictures resized, or each of these left out. "
     "Padded, the GelSlim's picture lies where the bubble would see it; cropped, only the part of the imprint that the GelSlim sees is "
     "learned, and the rest is counted as no imprint.",
     "test-set", ("rotation", "flip", "geometry")),
    ("Other sensors", "Another drawn pair of sensors, and GelSlims in other colors with other dots: as trained, and fitted by `adapt` to "
     "pairs of these.", "other", ("method", "samples", "fit")),
)


def tables(study):
    """The tables, each of the rows with most grasps; the file has the others too."""
    text, of = [], [row["settings"] for row in study["rows"]]
    budgets = sorted({s["samples"] for s in of if s.get("samples")})
    # Of the trainings of equal length: conditions and ablations.
    equal = next((s["samples"] for s in of if s.get("samples") and not plain(s, "method", "shift", "fit")), None)
    for heading, words, tests, varied in SECTIONS:
        within = lambda s: (s["test"].startswith(tests) and plain(s, *varied) and ("samples" in varied or s.get("samples") == equal)
                            and (tests != "test-set" or "samples" not in varied or s["test"] == tests))
        # The rows of most grasps: all of them where there is no number.
        for grasps in sorted({s["test_grasps"] for s in of}, key=lambda n: (n is not None, -(n or 0))):
            here = lambda s: s["test_grasps"] == grasps and within(s)
            rows = sorted((row for row in study["rows"] if here(row["settings"])), key=lambda row: order(row["settings"]))
            if all(plain(row["settings"]) for row in rows):
                continue
            differences = [d for d in study["differences"] if here(d["from"]) and here(d["from"] | d["to"])]
            text += [f"### {heading}", f"{words} {grasps or 46} grasps of each tool."]
            for group, name in GROUPS.items():
                text += [f"**{name}**", table(rows, group, varied)]
                less = paired(differences, budgets, group, varied)
                text += ["Paired differences, in bold where 0 is not in the interval:", less] if less else []
            break
    return "\n\n".join(text)
