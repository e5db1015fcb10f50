"""Rows of many touches: by two processes of a job array, and what other programs read in them."""

import re
import subprocess
import sys
from pathlib import Path

import duckdb
import pandas
import polars
import pyarrow.parquet as pq
import pytest
import touch2touch as t2t
import touch2touch.ray as many

PAGE = Path(__file__).parents[2] / "docs" / "python.md"


@pytest.fixture(scope="module")
def shares(tmp_path_factory):
    """The folder with the first and last of forty shares of the demo, and what the processes said."""
    folder = tmp_path_factory.mktemp("array") / "rows"
    run = [sys.executable, "-m", "touch2touch.ray", "demo", str(folder), "--batch", "4"]
    processes = [subprocess.Popen([*run, "--shard", f"{n}/40"], stdout=subprocess.PIPE, text=True) for n in (1, 40)]
    said = [process.communicate()[0] for process in processes]
    assert subprocess.run([*run, "--shard", "41/40"], capture_output=True, check=False).returncode == 2
    return folder, said


def test_a_job_array_makes_the_same_rows(shares):
    """As a cluster's scheduler starts it: a process for each share."""
    folder, said = shares
    data, recipe = t2t.open("demo"), t2t.Recipe()
    batches = [data.names[n:n + 4] for n in range(0, len(data), 4)]
    expected = [name for share in (0, 39) for batch in batches[share::40] for name in batch]
    made = {row["pair"]: row for row in pq.read_table(folder).to_pylist()}
    assert sorted(made) == sorted(expected) and all("rows in" in text for text in said)
    for name in (expected[0], expected[-1]):
        alone = many.row(data[name], recipe, recipe.id())
        assert all(alone[key] == made[name][key] or alone[key] != alone[key] for key in alone), name


def test_other_programs_read_the_rows_and_answer_the_query_of_the_page(shares, monkeypatch):
    folder, _ = shares
    rows = pq.read_table(folder).to_pylist()
    assert len(pandas.read_parquet(folder)) == len(polars.read_parquet(folder / "*.parquet")) == len(rows)
    monkeypatch.chdir(folder.parent)
    query = re.search('duckdb -c "(.*?)"', PAGE.read_text()).group(1)
    found = duckdb.sql(query).fetchall()
    assert {tool for tool, *_ in found} == {row["tool"] for row in rows} and sum(n for _, n, _ in found) == len(rows)
    worst = [error for *_, error in found]
    assert worst == sorted(worst, reverse=True) and all(0 <= error < 180 for error in worst)


def test_a_touch_that_fails_is_a_row_too():
    pair = t2t.open("demo")[0]
    recipe = t2t.Recipe(mask="threshold", threshold_mm=40.0, engine="distance_field")
    row = many.row(pair, recipe, recipe.id())
    assert row["verdict"] is None and row["angle_rad"] != row["angle_rad"] and len(row["why"]) > 10
    row = many.row(pair, t2t.Recipe(mask="unet", mask_bundle=None), "x")
    assert row["verdict"] == "good" or row["verdict"] in ("check", "wrong")
