"""Arrays, containers and what a notebook shows."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import touch2touch as t2t

ROOT = Path(__file__).resolve().parents[2]


def arrays(count=2):
    rng = np.random.default_rng(3)
    color = rng.integers(0, 255, (count, 24, 32, 3), np.uint8)
    depth = rng.uniform(0, 0.004, (count, 12, 16)).astype(np.float32)
    return color, color[0] // 2 + 40, depth


@pytest.fixture(scope="module")
def page():
    """The functions that docs/python.md shows."""
    blocks = (ROOT / "docs" / "python.md").read_text().split("```python\n")[1:]
    names = {"t2t": t2t, "np": np}
    exec(next(block for block in blocks if "def from_hdf5" in block).split("```")[0], names)
    return names


def test_arrays_come_back_as_they_were(tmp_path):
    color, reference, depth = arrays()
    depth[0, 3, 4] = np.nan
    data = t2t.from_arrays(color, reference, depth, out=tmp_path / "set", names=["a", "b"], px_per_mm=(20, 5))
    assert data.names == ["a", "b"] and data.problems == []
    rig = json.loads((tmp_path / "set" / "rig.json").read_text())
    assert [sensor["px_per_m"] for sensor in rig["sensors"]] == [20000, 5000]
    for at in range(2):
        pair = data[at]
        assert np.array_equal(pair.gelslim_touched[0], color[at]) and np.array_equal(pair.gelslim_untouched[0], reference)
        assert np.array_equal(pair.imprint[0], depth[at], equal_nan=True)
    each = t2t.from_arrays(color.astype(float), color[::-1], out=tmp_path / "each", px_per_mm=20)
    assert np.array_equal(each[1].gelslim_untouched[0], color[0]) and each[1].imprint is None


def test_pictures_as_large_as_the_labs_are_registered(tmp_path):
    """A touch of the demo, as arrays of one finger: the same imprint to the last bit, and a pose by its tool."""
    pair = t2t.open("demo")[0]
    color, reference = np.round(pair.gelslim_touched[:1]), np.round(pair.gelslim_untouched[:1])
    data = t2t.from_arrays(color, reference, pair.imprint[:1], out=tmp_path / "lab", tool=pair.tool_name, finger="right")
    again = data[0]
    assert np.array_equal(again.imprint[0], pair.imprint[0], equal_nan=True) and again.tool_name == pair.tool_name
    assert not (tmp_path / "lab" / "rig.json").exists()
    result = t2t.estimate(again)
    assert result.pose is not None and abs(np.degrees(result.pose.angle - pair.true_angle)) < 5


def test_what_is_wrong_with_arrays_is_said(tmp_path):
    color, reference, depth = arrays()
    for change, words in [
        ({"color": color[..., :2]}, "red, green, blue"),
        ({"color": color[0]}, "of one touch or more"),
        ({"color": color.astype(float) - 300}, "0..255"),
        ({"reference": reference[:5]}, "reference must be"),
        ({"depth": depth[:1]}, "depth must be"),
        ({"depth": depth * 1000}, "in meters"),
        ({"px_per_mm": None}, "px_per_mm"),
        ({"names": ["a", "a"]}, "different file names"),
        ({"names": ["a", "../b"]}, "different file names"),
        ({"tool": ["a"]}, "one for all"),
    ]:
        given = {"color": color, "reference": reference, "depth": depth, "px_per_mm": 20} | change
        with pytest.raises(t2t.Refused, match=words):
            t2t.from_arrays(given.pop("color"), given.pop("reference"), given.pop("depth"), out=tmp_path / "new", **given)
        assert not (tmp_path / "new").exists(), change
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "x").write_text("x")
    with pytest.raises(t2t.Refused, match="not empty"):
        t2t.from_arrays(color, reference, out=tmp_path / "full", px_per_mm=20)


def test_depths_of_another_kind_are_refused_by_what_they_are(tmp_path):
    color, reference, depth = arrays(1)
    t2t.from_arrays(color, reference, depth, out=tmp_path / "set", px_per_mm=20)
    file = tmp_path / "set" / "0000_depth.npy"
    for array, words in [
        (depth[0, :5], "16 x 5 values"),
        (depth[0].astype(np.uint16), "whole numbers"),
        (np.full((12, 16), np.nan, np.float32), "100 %"),
        (np.zeros((3, 12, 16), np.float32), "shape"),
    ]:
        np.save(file, array)
        with pytest.raises(t2t.Refused, match=words):
            t2t.open(tmp_path / "set")[0]
    file.write_bytes(file.read_bytes()[:100])
    with pytest.raises(t2t.Refused, match="0000_depth.npy"):
        t2t.open(tmp_path / "set")[0]
    other = tmp_path / "other"
    other.mkdir()
    (other / "grasps.h5").write_bytes(b"x")
    with pytest.raises(t2t.Refused, match="HDF5.*from_arrays"):
        t2t.open(other)


def test_hdf5_of_the_page(tmp_path, page):
    h5py = pytest.importorskip("h5py")
    color, reference, depth = arrays()
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["color"], file["reference"], file["depth"] = color, reference, depth
    data = page["from_hdf5"](tmp_path / "a.h5", tmp_path / "out")
    assert len(data) == 2 and np.array_equal(data[1].imprint[0], depth[1])


def test_zarr_of_the_page(tmp_path, page):
    zarr = pytest.importorskip("zarr")
    color, reference, depth = arrays()
    group = zarr.open_group(tmp_path / "a.zarr", mode="w")
    group["color"], group["reference"], group["depth"] = color, reference, depth
    data = page["from_zarr"](tmp_path / "a.zarr", tmp_path / "out")
    assert len(data) == 2 and np.array_equal(data[1].imprint[0], depth[1])


def test_lerobot_of_the_page(tmp_path, page):
    pyarrow = pytest.importorskip("pyarrow")
    image = pytest.importorskip("PIL.Image")
    import io
    import pyarrow.parquet

    color, _, _ = arrays(3)
    cells = []
    for picture in color:
        file = io.BytesIO()
        image.fromarray(picture).save(file, "PNG")
        cells.append({"bytes": file.getvalue(), "path": None})
    (tmp_path / "data").mkdir()
    pyarrow.parquet.write_table(pyarrow.table({"observation.images.touch": cells}), tmp_path / "data" / "file-000.parquet")
    data = page["from_lerobot"](tmp_path / "data", tmp_path / "out")
    assert len(data) == 2 and np.array_equal(data[1].gelslim_touched[0], color[2])


def test_rosbags_of_the_page(tmp_path, page):
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    color, _, _ = arrays(3)
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    with Writer(tmp_path / "bag", version=9) as bag:
        kind = "sensor_msgs/msg/Image"
        link = bag.add_connection("/touch", kind, typestore=store)
        for at, picture in enumerate(color):
            time = types["builtin_interfaces/msg/Time"](sec=at, nanosec=0)
            header = types["std_msgs/msg/Header"](stamp=time, frame_id="")
            message = types[kind](header=header, height=24, width=32, encoding="rgb8", is_bigendian=0, step=96, data=picture.reshape(-1))
            bag.write(link, at, store.serialize_cdr(message, kind))
    data = page["from_rosbag"](tmp_path / "bag", tmp_path / "out")
    assert len(data) == 2 and np.array_equal(data[1].gelslim_touched[0], color[2])


STAND_IN = """
let drawn = 0;
const pen = new Proxy({}, { get: (_, name) => (...given) => { drawn++; for (const v of given) if (v !== v) throw "NaN"; }, set: () => true });
const canvas = { getContext: () => pen, clientWidth: 600, clientHeight: 340, addEventListener(name, f) { this[name] = f; }, setPointerCapture() {} };
const legend = {}, document = { querySelector: () => canvas, getElementById: () => legend };
const devicePixelRatio = 1, addEventListener = () => {};
"""


def script(shown):
    """The script of the frame in a notebook's HTML."""
    from html import unescape

    frame = unescape(re.search(r'srcdoc="(.*?)" style', shown, re.S)[1])
    assert "http" not in frame.replace("http://www.w3.org", ""), "nothing is fetched"
    return re.search(r"<script>(.*)</script>", frame, re.S)[1]


def ran(text):
    node = shutil.which("node")
    if not node:
        pytest.skip("no node to run the page's script")
    done = subprocess.run([node, "-"], input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-900:]
    return done.stdout


def test_pairs_and_results_are_a_view_that_turns():
    pair = t2t.open("demo")[0]
    for shown, words in ((pair._repr_html_(), "true pose"), (t2t.estimate(pair)._repr_html_(), "contact")):
        assert len(shown) <= 2 << 20 and "srcdoc" in shown and words in shown
        turned = STAND_IN + "{" + script(shown) + "}" + """
            const before = drawn; canvas.onpointerdown({clientX: 0, clientY: 0}); canvas.onpointermove({clientX: 30, clientY: 9});
            canvas.wheel({ preventDefault() {}, deltaY: 99 }); console.log(before, drawn);"""
        before, after = map(int, ran(turned).split())
        assert before > 5000 and after > 2 * before
    assert "iframe" in t2t.estimate(t2t.simulate("pattern_36"))._repr_html_()


def test_scores_sort_by_a_click():
    scores = t2t.evaluate(t2t.open("demo")[:2], resamples=0)
    shown = scores._repr_html_()
    assert "Measured" in shown and "<th>" not in shown, "it is in a frame of its own"
    page = """
        const row = (...texts) => ({ cells: texts.map((textContent) => ({ textContent })) });
        const body = { rows: [row("a", "3.2 ± 1"), row("c", "–"), row("b", "-10.1")], append(...rows) { this.rows = rows; } };
        const heads = [0, 1].map((cellIndex) => ({ cellIndex, dataset: {}, closest: () => ({ tBodies: [body] }) }));
        const document = { querySelectorAll: () => heads };{""" + script(shown) + "}" + """
        const order = () => body.rows.map((row) => row.cells[0].textContent).join("");
        heads[1].onclick(); const up = order(); heads[1].onclick(); console.log(up, order());"""
    assert ran(page).split() == ["bac", "abc"]


def test_a_set_of_gelslims_with_their_own_depth(tmp_path):
    import os

    program = os.environ.get("TOUCH2TOUCH_PROGRAM")
    if not program:
        pytest.skip("TOUCH2TOUCH_PROGRAM names no program that writes one")
    command = [program, "simulate", "--form", "gelslim-depth", "--tools", "pattern_36", "--grasps", "3", "--out", tmp_path / "set"]
    subprocess.run(command, check=True, capture_output=True)
    data = t2t.open(tmp_path / "set")
    pair = data[1]
    assert len(data) == 3 and pair.gelslim.shape == (2, 320, 427, 3) and pair.imprint.shape == (2, 320, 427)
    result = t2t.estimate(pair)
    assert np.degrees(result.pose.error) < 0.2 and result.verdict == "good" and len(pair._repr_html_()) < 2 << 20
    # The shipped generator predicts a bubble, which is not compared with a gel.
    with pytest.raises(t2t.Refused, match="predicts bubble"):
        t2t.predict(pair)
    assert {row["method"] for row in t2t.table(t2t.evaluate(data, resamples=0))} == {"Measured (upper bound)"}
