"""Command line of `./study`: measures what is missing, or the steps that are named anew, and writes docs/numbers.md.

A step whose figures are kept in docs/numbers.json is not made again unless it is named. `--real`, `--other` and `--python`
give what does not come with the repository; the steps that need it are left out otherwise, with the figures that are kept.
"""

import argparse
import json
import os
import sys
import time
from pathlib import Path

from ..program import ROOT, Refused, machine, today
from . import pages
from .steps import STEPS, Bench, rounded

KEPT = ROOT / "docs" / "numbers.json"


def read(path):
    return json.loads(path.read_text()) if path.exists() else {}


def keep(kept):
    """Writes the figures, a step for a line, whole or not at all."""
    text = "{\n" + ",\n".join(f"{json.dumps(name)}: {json.dumps(step, ensure_ascii=False)}" for name, step in kept.items()) + "\n}\n"
    partial = KEPT.with_suffix(".partial")
    partial.write_text(text)
    os.replace(partial, KEPT)


def listed(kept):
    for step in STEPS:
        facts = kept.get(step.name, {}).get("made")
        when = f"{facts['seconds']} s, made {facts['date']} at {facts['commit']}" if facts else "not made"
        needs = f" (needs --{', --'.join(step.needs)})" if step.needs else ""
        print(f"{step.name:<14}{when:<66}{step.what}{needs}")


def measure(step, args, kept):
    places = {name: getattr(args, name) for name in ("real", "other", "python")}
    bench = Bench(Path(args.programs).resolve(), Path(args.out).resolve(), places)
    begun, load = time.monotonic(), machine()
    figures = rounded(step.figures(bench))
    facts = {"date": today(), "commit": bench.verbs.commit(), "machine": load, "seconds": round(time.monotonic() - begun), "commands": bench.commands}
    kept[step.name] = {"made": facts, "figures": figures}


def parser():
    parser = argparse.ArgumentParser(prog="./study", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("steps", nargs="*", metavar="STEP", help="steps to make anew (default: those without figures)")
    parser.add_argument("--real", type=Path, metavar="DIR", help="folder of real pairs")
    parser.add_argument("--other", type=Path, metavar="DIR", help="folder of cases with known truth by another simulator")
    parser.add_argument("--python", type=Path, metavar="PY", help="Python with open3d and small_gicp, the peers of the registration")
    parser.add_argument("--out", default=ROOT / "target" / "study", help="folder of what is made on the way (default: target/study)")
    parser.add_argument("--programs", default=ROOT / "target" / "release", help="folder of the programs (default: target/release)")
    parser.add_argument("--list", action="store_true", help="say which steps there are, how long each took and when, and make nothing")
    parser.add_argument("--pages", action="store_true", help="write the pages anew from the kept figures, and measure nothing")
    parser.add_argument("--check", action="store_true", help="fail where a page says another figure than the kept ones")
    return parser


def main():
    args, kept = parser().parse_args(), read(KEPT)
    # In the order of the steps, whenever each was made.
    steps = lambda: {step.name: kept[step.name]["figures"] for step in STEPS if step.name in kept}
    if args.list:
        return listed(kept)
    if args.check:
        said = pages.wrong(steps(), kept)
        print("\n".join(said) or "the pages say what was measured")
        return sys.exit(bool(said))
    unknown = set(args.steps) - {step.name for step in STEPS}
    if unknown:
        sys.exit(f"no step is named {', '.join(sorted(unknown))}; there are: {', '.join(step.name for step in STEPS)}")
    failed = False
    for step in () if args.pages else STEPS:
        if step.name not in args.steps and (args.steps or step.name in kept):
            continue
        missing = [need for need in step.needs if not getattr(args, need)]
        if missing:
            print(f"{step.name}: left out, it needs --{', --'.join(missing)}", flush=True)
            continue
        try:
            measure(step, args, kept)
        except Refused as why:
            print(f"{step.name}: {why}", file=sys.stderr, flush=True)
            failed = True
            continue
        # Another run may have added a step meanwhile.
        kept = read(KEPT) | {step.name: kept[step.name]}
        keep({s.name: kept[s.name] for s in STEPS if s.name in kept})
        print(f"{step.name}: {kept[step.name]['made']['seconds']} s", flush=True)
    pages.write(steps(), kept)
    sys.exit(failed)


if __name__ == "__main__":
    main()
