"""The rows of the study as Markdown, in the paper's form."""

from .paired import differences

# Heading, the verb's name of the figure, digits.
COLUMNS = (("PSNR dB", "psnr_db", 1), ("clean dB", "psnr_noise_free_db", 1), ("SSIM", "ssim", 3), ("FD", "frechet", 2), ("FID", "fid", 1),
           ("angle °", "angle_deg", 1), ("≤5° %", "success_5", 1), ("≤10° %", "success_10", 1))
GROUPS = {"seen_tools": "unseen grasps of seen tools", "unseen_tools": "unseen tools"}


def label(settings):
    """What a row is of, in words."""
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


def number(figure, digits):
    if not isinstance(figure, dict):
        return "-" if figure is None else f"{figure:.{digits}f}"
    interval = figure["interval"]
    return f"{figure['value']:.{digits}f}" + (f" [{interval[0]:.{digits}f} {interval[1]:.{digits}f}]" if interval else "")


def table(rows, group):
    of = [(row, next((g for g in row["groups"] if g["group"] == group), {})) for row in rows]
    columns = [c for c in COLUMNS if any(figures.get(c[1]) is not None for _, figures in of)]
    lines = [["row", *(column[0] for column in columns)], ["---", *["--:"] * len(columns)]]
    for row, figures in of:
        lines.append([label(row["settings"]), *(number(figures.get(key), digits) for _, key, digits in columns)])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def paired_table(rows, group):
    heads = ["from", "to", *(column[0] for column in COLUMNS if column[1] not in ("psnr_noise_free_db", "frechet", "fid"))]
    lines = [heads, ["---", "---", *["--:"] * (len(heads) - 2)]]
    for found in differences(rows):
        figures = found["groups"].get(group)
        if figures:
            to = label(found["from"] | found["to"])
            cells = [number(figures[key], digits) for _, key, digits in COLUMNS if key in figures]
            lines.append([label(found["from"]), to, *cells])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def markdown(rows):
    """A table of figures and one of paired differences for each test set and group of tools."""
    text = []
    for test, grasps in dict.fromkeys((row["settings"]["test"], row["settings"]["test_grasps"]) for row in rows):
        chosen = [r for r in rows if (r["settings"]["test"], r["settings"]["test_grasps"]) == (test, grasps)]
        # The upper bound first, then what ships.
        chosen.sort(key=lambda row: (row["settings"]["method"] != "measured imprints", "samples" in row["settings"] and
                                     row["settings"]["samples"] is not None))
        for group, words in GROUPS.items():
            text += [f"**{test}, {words}** ({grasps or 46} grasps of each)", table(chosen, group)]
            text += ["Paired differences", paired_table(chosen, group)]
    return "\n\n".join(text)
