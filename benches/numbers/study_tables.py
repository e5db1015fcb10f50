"""The rows of `docs/study.json` as Markdown, in the paper's form: a table for each test set and group of tools."""

from .tables import COLUMNS, GROUPS, group_of, markdown, number

SHOWN = [c for c in COLUMNS if c[1] in ("psnr_db", "psnr_noise_free_db", "ssim", "frechet", "fid", "angle_deg", "success_5", "success_10")]
# Columns of the paired differences.
PAIRED = [c for c in SHOWN if c[1] in ("psnr_db", "ssim", "angle_deg", "success_5", "success_10")]


def label(settings):
    """Name of a row, in words."""
    name = settings["method"]
    if settings.get("samples"):
        name += f", {settings['samples']:,} samples"
    if settings.get("condition", "plain") != "plain":
        name += f", trained {settings['condition']}"
    name += "".join(f", no {key}" for key in ("rotation", "flip") if not settings.get(key, True))
    if settings.get("geometry", "full") != "full":
        name += f", {settings['geometry']}"
    if settings.get("shift", "exact") != "exact":
        name += {"paper": ", shifted (paper)", "raw": ", without shift"}[settings["shift"]]
    if settings.get("fit"):
        pairs, steps = settings["fit"]
        name += f", fitted to {pairs} pairs" + (f", tuned {steps} steps" if steps else "")
    return name


def table(rows, group):
    of = [(row, group_of(row, group)) for row in rows]
    of = [(row, figures) for row, figures in of if figures]
    columns = [c for c in SHOWN if any(figures.get(c[1]) is not None for _, figures in of)]
    return markdown(["row", *(c[0] for c in columns)],
                    [[label(row["settings"]), *(number(figures.get(key), digits) for _, key, digits in columns)] for row, figures in of])


def paired(differences, group):
    """Second row less first; in bold where the interval has no 0 in it."""
    rows = []
    for found in differences:
        figures = group_of(found, group)
        if figures:
            cells = []
            for _, key, digits in PAIRED:
                text, ends = number(figures.get(key), digits), (figures.get(key) or {}).get("interval")
                cells.append(f"**{text}**" if ends and ends[0] * ends[1] > 0 else text)
            rows.append([label(found["from"] | found["to"]), label(found["from"]), *cells])
    return markdown(["row", "less", *(c[0] for c in PAIRED)], rows) if rows else None


def order(row):
    """The upper bound first, then what ships, then by method and budget."""
    settings = row["settings"]
    return (settings["method"] != "measured imprints", settings.get("samples") is not None, settings.get("samples") or 0)


def tables(study):
    """All rows and all differences of the file."""
    text = []
    sets = dict.fromkeys((row["settings"]["test"], row["settings"]["test_grasps"]) for row in study["rows"])
    for test, grasps in sets:
        here = lambda settings: (settings["test"], settings["test_grasps"]) == (test, grasps)
        rows = sorted((row for row in study["rows"] if here(row["settings"])), key=order)
        differences = [d for d in study["differences"] if here(d["from"])]
        for group, words in GROUPS.items():
            text += [f"**{test}: {words.lower()}** ({grasps or 46} grasps of each)", table(rows, group)]
            less = paired(differences, group)
            text += [f"Paired differences, {test}: {words.lower()}; in bold where 0 is not in the interval", less] if less else []
    return "\n\n".join(text)
