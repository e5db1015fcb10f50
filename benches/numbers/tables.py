"""The tables of `docs/numbers.md` and of the pages that quote it: from kept figures to Markdown, by name."""

GROUPS = {"seen_tools": "Unseen grasps of seen tools", "unseen_tools": "Unseen tools"}
# Heading, the verb's name of the figure, digits.
COLUMNS = (("PSNR dB", "psnr_db", 1), ("clean dB", "psnr_noise_free_db", 1), ("SSIM", "ssim", 2),
           ("clean SSIM", "ssim_noise_free", 2), ("FD", "frechet", 2), ("FID", "fid", 0), ("angle °", "angle_deg", 1),
           ("≤5° %", "success_5", 1), ("≤10° %", "success_10", 1), ("place mm", "position_mm", 1), ("mask IoU", "mask_iou", 2),
           ("*good* %", "verdict_good", 0), ("tool named %", "tool_accuracy", 1))
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
    text, ends = f"{figure['value']:.{digits}f}", figure.get("interval")
    return f"{text} [{ends[0]:.{digits}f}, {ends[1]:.{digits}f}]" if ends and interval else text


def name_of(row):
    names = {"Measured (upper bound)": "measured imprint (upper bound)", "Latent diffusion, simulated data": "shipped latent diffusion"}
    return names.get(row["method"], row["method"]) + (" (published, real data)" if row.get("published") else "")


def group_of(row, group):
    return next((g for g in row["groups"] if g["group"] == group), None)


def results_table(answer, group, columns=COLUMNS, interval=True, named=name_of):
    """A group of `evaluate`'s table, the paper's rows below ours."""
    rows = [(row, group_of(row, group)) for row in answer["rows"] + answer["published"]]
    rows = [(row, figures) for row, figures in rows if figures]
    columns = [c for c in columns if any(figures.get(c[1]) is not None for _, figures in rows)]
    return markdown(["method", *(c[0] for c in columns)],
                    [[named(row), *(number(figures.get(c[1]), c[2], interval) for c in columns)] for row, figures in rows])


def results(steps):
    answer = steps["results"]
    text = []
    for group, words in GROUPS.items():
        ours = group_of(answer["rows"][0], group)
        text += [f"**{words}** ({ours['grasps']} grasps of {ours['tools']} tools)", results_table(answer, group)]
    return "\n\n".join(text)


CONDITIONS = {"plain": "none", "ambiguous": "ambiguous (bare shaft)", "mixed": "mixed", "misaligned": "misaligned (up to 8 mm)",
              "noise": "noise on the GelSlim"}


def conditions(steps):
    """The shipped generator on each condition, seen and unseen tools."""
    answers = steps["conditions"]
    columns = [c for c in COLUMNS if c[1] in FEW or c[1] == "frechet"]
    text = []
    for group, words in GROUPS.items():
        rows = []
        for condition, label in CONDITIONS.items():
            figures = group_of(next(r for r in answers[condition]["rows"] if not r["upper_bound"]), group)
            rows.append([label, *(number(figures.get(c[1]), c[2]) for c in columns)])
        text += [f"**{words}**", markdown(["fault of the pairs", *(c[0] for c in columns)], rows)]
    return "\n\n".join(text)


LAWS = {"other": "independent simulator", "own": "built-in simulator", "any_depth": "bubbles of any size and depth",
        "predicted": "built-in simulator, predicted imprints"}


def registration(steps):
    """A table for each law: all engines and peers."""
    text = []
    for law, words in LAWS.items():
        if law not in steps["registration"]:
            continue
        found = steps["registration"][law]
        rows = []
        for row in found["engines"]:
            default = row["name"] == "joint"
            label = f"**{row['label']}**" if default else row["label"]
            rows.append([label, str(row["count"]), number(row["median_ms"], 2), number(row["p95_ms"], 2), number(row["cpu_mean_ms"], 2),
                         number(row["mean_deg"], 2), number(row["success_5"], 1), number(row["position_median_mm"], 2)])
        heads = ["engine", "grasps", "median ms", "p95 ms", "processor ms", "mean °", "≤5° %", "place mm"]
        text += [f"**Grasps of the {words}**", markdown(heads, rows)]
        whole = found["depth_to_pose"]
        text += [f"Depth and mask to the pose by the default: {whole['median_ms']:.2f} ms (p95 {whole['p95_ms']:.2f} ms)."]
    return "\n\n".join(text)


def engine(found, name):
    return next(row for row in found["engines"] if row["name"] == name)


KINDS = {"spoilt": "spoilt as a learned mask is", "clean": "clean", "threshold=5": "all deeper than 5 mm",
         "threshold=2.5": "all deeper than 2.5 mm", "unet": "by the shipped mask model"}


def by_mask(steps):
    """Rows of the step `masks`: the law, the kind of mask, the mask alone and joint."""
    for law, kinds in steps["masks"].items():
        for kind, found in kinds.items():
            yield [LAWS[law], KINDS[kind]], engine(found, "distance_field"), engine(found, "joint")


def masks(steps):
    """Joint registration and mask alone, by the mask."""
    rows = []
    for words, *both in by_mask(steps):
        cells = [f"{e['mean_deg']:.2f}°, {e['success_5']:.1f} %, {e['median_ms']:.2f} ms" for e in both]
        rows.append([*words, str(both[0]["count"]), *cells])
    heads = ["grasps of", "mask", "N", "mask alone: mean, ≤5°, median", "joint (default): mean, ≤5°, median"]
    return "\n\n".join([markdown(heads, rows, 2), "Errors of the joint registration in its own standard deviations: root mean square "
                        "(share within two); 1 and 95 % where they are right.", deviations(steps)])


def deviations(steps):
    """Errors of the joint registration in its own standard deviations, by the mask."""
    rows = []
    for words, _, joint in by_mask(steps):
        if "rms" in joint:
            scores = zip(joint["rms"], joint["within_2"], strict=True)
            rows.append([*words, str(joint["count"]), *(f"{rms:.2f} ({share:.0f} %)" for rms, share in scores)])
    return markdown(["grasps of", "mask", "N", "angle", "y", "z"], rows, 2)


# What the benchmark calls the faults, where that is too short.
FAULTS = {"wrong_unit": "model in another unit", "mirrored": "model mirrored", "blob": "blob in the mask", "half": "half of the mask gone",
          "swapped": "fingers swapped", "turned": "a camera turned by 10 to 20°", "blank": "one finger blank",
          "other_pair": "one imprint of another grasp"}


def verdict(steps):
    """Faults by what the verdict calls them."""
    found = steps["verdict"]
    words = {"own": "built-in simulator", "predicted": "the same simulator, predicted imprints", "spoilt": "independent simulator",
             "unet": "that one, masks by the shipped model"}
    sources = [s for s in words if s in found]
    rows = []
    for at, fault in enumerate(found["own"]["faults"]):
        of = [found[s]["faults"][at] for s in sources]
        rows.append([FAULTS.get(fault["fault"], fault["fault"].replace("_", " ")), *(f"{f['told']:.1f} % ({f['wrong']:.1f} %)" for f in of)])
    named = "; ".join(f"{words[s]} {found[s]['named']:.1f} %" for s in sources)
    trials = ", ".join(f"{words[s]}: {found[s]['faults'][0]['trials']}" for s in sources)
    return "\n\n".join([markdown(["fault", *(words[s] for s in sources)], rows),
                        f"*Check* or *wrong* (of these, *wrong*). The first row are false alarms, of right poses alone. Grasps: {trials}. "
                        f"With every tool tried, the own one comes first: {named}."])


def doctor(steps):
    found = steps["doctor"]
    return (f"{found['spoilt_sets']} data sets of {found['pairs']} pairs, stored wrongly in {found['ways']} ways: "
            f"{100 * found['named_share']:.1f} % named rightly and nothing else, {100 * found['noticed_share']:.1f} % noticed. "
            f"{found['near_sets']} slightly off in {found['near_ways']} ways: of {found['near_noticed']} something is said, of "
            f"{found['near_sets'] - found['near_named']} something wrong. {found['sound_sets']} sound ones: {found['false_alarms']} false "
            f"alarms. {found['worsened']} sets are worse when they are read as was said.")


def dataset(steps):
    found = steps["dataset"]
    heads = ["from", "seconds", "pairs/s", "mean °", "≤5° %"]
    words = {"points_to_pose": "contact points, by the mask alone", "depth_to_pose": "depth and mask, by the default"}
    rows = []
    for key, label in words.items():
        stage = found[key]
        rows.append([label, number(stage["seconds"], 1), number(stage["pairs_per_second"], 0), number(stage["mean_deg"], 2),
                     number(stage["success_5"], 1)])
    return f"{found['pairs']:,} pairs of {found['tools']} tools, all threads.\n\n" + markdown(heads, rows)


ENGINES = {"ort": "ONNX Runtime", "rten": "built-in engine"}
SAMPLERS = {"ddim": "DDIM", "ddpm": "DDPM", "dpm_solver2m": "DPM-Solver++(2M)"}
# Numbers of steps of the table; docs/numbers.json has them all.
STEPS_SHOWN = (1, 2, 4, 10, 20, 50, 200)


def front(steps):
    """Samplers and some numbers of steps of each engine; the knee, and the wait for a first result."""
    found = steps["front"]
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


SENSORS = {"nominal": "The simulator's nominal sensors", "drawn": "Another pair of sensors (seed 77)",
           "other_gelslims": "GelSlims in other colors and with other dots (seed 77)"}


def trials(steps):
    """Success of each tool by each method, with the verdict in the loop."""
    found, text = steps["trials"], []
    for sensors, words in SENSORS.items():
        rows = []
        for tool, methods in found[sensors].items():
            for method in methods:
                loops = {loop["after"]: loop for loop in method["with_verdict"]}
                sweep = " / ".join(str(s["hits"]) for s in method["sweep"].values()) or "-"
                tried, gave_up = loops.get("try"), loops.get("give_up")
                rows.append([tool, name_of(method), number(method["mean_deg"], 1), share(method["success"]), sweep,
                             share(tried["per_trial"]) + f", {tried['regrasps']} regrasps" if tried else "-",
                             f"{gave_up['per_try']['hits']}/{gave_up['per_try']['of']}, {gave_up['refusals']} refused" if gave_up else "-"])
        heads = ["tool", "poses from", "mean °", "success", "room 0.5 / 2 / 5 mm", "verdict, then try", "verdict, then give up"]
        text += [f"**{words}**", markdown(heads, rows)]
    paper = "; ".join(f"{p['what']} {share(p['share'])}" for p in found["published"])
    return "\n\n".join([*text, f"Published, the paper's diffusion model on a real robot: {paper}."])


PICTURES = (("PSNR dB", "psnr_db", 1), ("SSIM", "ssim", 3), ("raw dB", "psnr_raw_db", 1), ("raw SSIM", "ssim_raw", 3),
            ("line dB", "psnr_line_db", 1), ("angle °", "angle_deg", 1), ("≤5° %", "success_5", 0))


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


def real(steps):
    """Scores on pairs that were left out, and time."""
    found = steps["real"]
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


def three(steps):
    """README: three results."""
    rows = []
    for law, words in (("other", "an independent simulator"), ("own", "the built-in simulator, fresh")):
        found = steps["registration"].get(law)
        if not found:
            continue
        joint, lab = engine(found, "joint"), engine(found, "lab_icp")
        peers = [row for row in found["engines"] if row["peer"] and row["label"].startswith("Open3D")]
        best = min(peers, key=lambda row: row["mean_deg"]) if peers else None
        cell = lambda row: f"{row['mean_deg']:.2f}°, {row['success_5']:.1f} %" if row else "-"
        rows.append([f"**In-hand pose**, {joint['count']} grasps of {words}: mean error, within 5°", f"**{cell(joint)}**",
                     f"ICP: {cell(lab)}", cell(best)])
        time = lambda row: f"{row['median_ms']:.2f} ms" if row else "-"
        rows.append(["**Time** of these poses from contact points, median", f"**{time(joint)}**", f"ICP: {time(lab)}", time(best)])
    if "real" in steps:
        last = steps["real"]["fits"]["grasps"]["50"]
        stored = next(row for row in steps["real"]["stored"]["rows"] if not row["upper_bound"] and "simulated" not in row["method"])
        score = f"{last['after']['psnr_db']:.1f} dB, {last['after']['ssim']:.2f}"
        lab = f"{mean_of_groups(stored, 'psnr_db'):.1f} dB, {mean_of_groups(stored, 'ssim'):.2f}"
        rows.append(["**Prediction** on real pairs that were not fitted: PSNR, SSIM", f"**{score}**", f"VQ-VAE: {lab}", "-"])
    return "\n".join("| " + " | ".join(line) + " |" for line in
                     [["", "this program", "the lab's", "Open3D's best"], ["---"] * 4, *rows])


# Name of a table: the step that it needs, and the function. Each step has one of its own name.
TABLES = {of.__name__: (of.__name__, of) for of in (results, conditions, real, front, registration, masks, verdict, doctor, dataset,
                                                    trials)} | {"three": ("registration", three), "deviations": ("masks", deviations)}


def table(name, steps):
    """A table by name; `None` where the step that it needs was not made."""
    step, of = TABLES[name]
    return of(steps) if step in steps else None
