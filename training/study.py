"""Command line: `python -m training.study --out DIR --json FILE [--only SECTION ...] [--budgets N,N,N] [--equal N]`.

Trains every method on the same shards, with the same number of samples from the same seed in the same order, has the
product score it (`touch2touch evaluate`), and adds a row to FILE. Rows that are in FILE are not made again; what lies in DIR
is gone on from: stopped at any time, it loses two minutes at most. Tables of all rows lie beside FILE, as FILE.md.
"""

import argparse
import sys
import time
from pathlib import Path

import torch

from benches.program import commit, machine, today

from . import study_tables
from .place import keep_freed_memory
from .study_rows import Rows
from .study_runs import AUTOENCODER, SECTIONS
from .study_training import FALL, TURNED, exported
from .study_verbs import MODELS, Product, Refused

# Of the drawn sensors that count as another rig.
OTHER_SEED = 77


def made(row, args, program, rows):
    """Makes a row: trains, fits, evaluates. Puts it into the file, and that of the measured imprints of the same grasps."""
    bundle, cost, data = MODELS / "generator_ldm", None, row.test
    if row.test.startswith("other"):
        pairs, data = program.other(row.test, OTHER_SEED)
    if row.training:
        shards = program.shards(row.training.condition, args.grasps, args.seed)
        bundle, cost = exported(row.training, row.samples, shards, Path(args.out) / "runs", args.seed)
    if row.fit:
        place = Path(args.out) / "fitted" / row.test / (row.training.name() if row.training else "shipped")
        bundle = program.fitted(bundle, pairs, *row.fit, place / "_".join(map(str, (row.samples, *row.fit))))
    answer, command = program.evaluate(bundle, data, row.shift, args.test_grasps)
    if not answer["complete"] or answer["skipped"]:
        raise Refused(f"not every grasp could be scored: {answer['skipped'][:3]}")
    facts = {"date": today(), "commit": commit(), "program": program.version(), "machine": machine(), "torch": torch.__version__,
             "command": command, "runtime": answer["runtime"], "seconds": round(answer["seconds"])}
    for figures in answer["rows"]:
        if figures["upper_bound"] and not rows.find(measured(row, args)):
            rows.add({"settings": measured(row, args), "made": facts, "groups": figures["groups"]}, answer, [])
        elif not figures["upper_bound"]:
            own = {"settings": settings(row, args), "made": facts | {"training": cost}, "groups": figures["groups"]}
            rows.add(own, answer, rows.alike(own["settings"]))


def settings(row, args):
    common = scoring(args)
    if row.training:
        common |= {"seed": args.seed, "training_grasps": args.grasps, "turned": TURNED, "fall": FALL}
        common |= {"autoencoder": AUTOENCODER}
    return row.settings() | common


def measured(row, args):
    return {"method": "measured imprints", "test": row.test} | scoring(args)


def scoring(args):
    return {"test_grasps": args.test_grasps}


def parser():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, help="folder of shards, checkpoints and bundles")
    parser.add_argument("--json", required=True, help="file of the rows")
    parser.add_argument("--only", nargs="*", choices=tuple(SECTIONS), default=tuple(SECTIONS))
    parser.add_argument("--budgets", type=lambda text: [int(n) for n in text.split(",")], default=[10_000, 20_000, 40_000],
                        help="samples that every method is given")
    parser.add_argument("--equal", type=int, default=20_000, help="samples of each training in the tables of conditions and ablations")
    parser.add_argument("--grasps", type=int, default=1500, help="grasps of the training shards of each condition, both fingers")
    parser.add_argument("--test-grasps", type=int, help="score only so many grasps of each tool (default: all 46)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--touch2touch", default="target/release/touch2touch", help="the program")
    return parser


def main():
    args = parser().parse_args()
    rows = Rows(args.json, Path(args.out) / "rows")
    keep_freed_memory()
    torch.set_num_threads(1)
    program = Product(args.touch2touch, args.out)
    for name in args.only:
        for row in SECTIONS[name](args.budgets, args.equal):
            if rows.find(settings(row, args)):
                continue
            begun = time.monotonic()
            try:
                made(row, args, program, rows)
            except Refused as why:
                print(f"{name}: {row} is left out: {why}", file=sys.stderr, flush=True)
                continue
            print(f"{name}: {row} in {time.monotonic() - begun:.0f} s", flush=True)
    Path(f"{args.json}.md").write_text(study_tables.tables(rows.read()))


if __name__ == "__main__":
    main()
