"""Shortcuts for common tasks, built on `_native`."""

import numpy as np

from ._native import Recipe, estimate, estimate_many


def predict(pair, recipe=None):
    """The predicted imprint of both Soft Bubbles: (2, 140, 175) float32, meters."""
    return estimate(pair, recipe or Recipe("predicted"), stage="imprint").imprint


def predict_many(pairs, recipe=None, *, progress=None):
    """`predict` for many pairs on all cores: (N, 2, 140, 175) float32, meters."""
    result = estimate_many(list(pairs), recipe or Recipe("predicted"), stage="imprint", progress=progress)
    return np.stack([each.imprint for each in result]) if result else np.empty((0, 2, 140, 175), np.float32)


def table(scores, *, paper=False):
    """The rows of an evaluation as a list of dictionaries, one for each method and group: `pandas.DataFrame(table(scores))`.

    Confidence intervals are in `NAME_low` and `NAME_high`.
    """
    answer, rows = scores.json(paper=paper), []
    for row in answer["rows"] + answer.get("published", []):
        for group in row["groups"]:
            flat = {"method": row["method"], "published": row["published"], "upper_bound": row["upper_bound"]}
            for key, value in group.items():
                if isinstance(value, dict):
                    low, high = value["interval"] or (None, None)
                    flat |= {key: value["value"], f"{key}_low": low, f"{key}_high": high}
                else:
                    flat[key] = value
            rows.append(flat)
    return rows
