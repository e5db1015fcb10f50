"""The package as its users call it, on the built-in demo."""

import json
import multiprocessing
import os
import pickle
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
import touch2touch as t2t

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def demo():
    return t2t.open("demo")


@pytest.fixture(scope="module")
def pair(demo):
    return demo[0]


def verb(*words):
    """The JSON object of a verb of the program, where it is there to be compared with."""
    program = os.environ.get("TOUCH2TOUCH_PROGRAM")
    if not program:
        pytest.skip("TOUCH2TOUCH_PROGRAM names no program to compare with")
    done = subprocess.run([program, *words, "--json"], capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stderr
    return json.loads(done.stdout)


def test_a_data_set_is_a_sequence(demo):
    assert len(demo) > 20 and demo.names[0] == demo[0].name and demo[-1].name == demo.names[-1]
    assert demo[demo.names[3]].name == demo[3].name
    part = demo[2:8:2]
    assert part.names == demo.names[2:8:2] and len(part) == 3 and [pair.name for pair in part] == part.names
    rods = demo.filter("tool:pattern_31")
    assert 0 < len(rods) < len(demo) and all("pattern_31" in name for name in rods.tools)
    assert "pairs" in repr(demo) and demo.names[0] in repr(demo[0])
    with pytest.raises(IndexError):
        demo[len(demo)]
    with pytest.raises(KeyError, match="no pair is named"):
        demo["nothing"]
    with pytest.raises(TypeError):
        demo[1.5]
    with pytest.raises(t2t.Refused, match="angle>5"):
        demo.filter("angle>5")


def test_arrays_have_the_shapes_and_units_that_they_say(pair):
    assert pair.gelslim.shape == (2, 320, 427, 3) and pair.gelslim.dtype == np.float32
    assert pair.imprint.shape == (2, 140, 175) and pair.imprint.dtype == np.float32
    assert 0.003 < np.nanmax(pair.imprint) < 0.05, "meters"
    assert pair.true_contact.dtype == bool and pair.true_contact.any()
    assert np.allclose(pair.gelslim, pair.gelslim_touched - pair.gelslim_untouched)
    assert pair.K.shape == (2, 3, 3) and pair.grasp_from_camera.shape == (2, 4, 4)
    truth = pair.truth
    assert truth.shape == (4, 4) and np.allclose(truth[:3, :3] @ truth[:3, :3].T, np.eye(3))
    # `grasp_from_object` turns by the opposite of the lab's angle.
    assert np.isclose(np.arctan2(truth[2, 1], truth[1, 1]), -pair.true_angle)
    assert pair.drawn_mask is None and isinstance(pair.notes, list)


def test_contact_points_are_what_camera_and_pose_say(pair):
    """The arrays fit together: lifted by K and the camera's place, the mask's pixels are the points of `estimate`."""
    result = t2t.estimate(pair, t2t.Recipe(mask="truth"), stage="cloud")
    points = []
    for finger in range(2):
        rows, columns = np.nonzero(result.mask[finger])
        depth = (pair.depth_reference - result.imprint)[finger][rows, columns].astype(float)
        pixels = np.stack([columns, rows, np.ones_like(rows)]).astype(float)
        camera = np.linalg.inv(pair.K[finger]) @ pixels * depth
        place = pair.grasp_from_camera[finger]
        points.append((place[:3, :3] @ camera + place[:3, 3:]).T)
    assert np.allclose(np.concatenate(points), result.points, atol=1e-9)


def test_from_a_touch_to_its_pose(pair):
    result = t2t.estimate(pair)
    pose = result.pose
    assert result.why_not is None and np.degrees(pose.error) < 3
    assert pose.matrix.shape == (4, 4) and pose.sigma.shape == (3,) and pose.covariance.shape == (3, 3)
    assert np.allclose(pose.sigma**2, np.diag(pose.covariance)) and (pose.sigma > 0).all()
    assert result.verdict == pose.verdict in ("good", "check", "wrong") and pose.why
    assert np.isclose(abs(pose.angle - pair.true_angle), pose.error)
    assert result.pair.name == pair.name and "°" in repr(result)
    early = t2t.estimate(pair, stage="imprint")
    assert early.mask is None and early.pose is None and early.why_not is None
    assert np.array_equal(early.imprint, pair.imprint, equal_nan=True)
    predicted = t2t.estimate(pair, t2t.Recipe("predicted"))
    assert predicted.pose is not None and not np.array_equal(predicted.imprint, result.imprint)
    assert np.array_equal(t2t.predict(pair), predicted.imprint)
    another = t2t.estimate(pair, t2t.Recipe("predicted", seed=7), stage="imprint")
    assert not np.array_equal(another.imprint, predicted.imprint)


def test_without_contact_there_is_no_pose_and_it_is_said_why(pair):
    result = t2t.estimate(pair, t2t.Recipe(mask="threshold", threshold_mm=40.0, engine="distance_field"))
    assert result.pose is None and result.verdict is None and len(result.why_not) > 10 and "no pose" in repr(result)


def test_points_alone_are_registered(pair):
    points, tool = t2t.estimate(pair, stage="cloud").points, pair.tool
    pose = t2t.register(points, tool)
    assert pose.num_points == len(points) and pose.error is None
    assert abs(np.degrees(pose.angle - pair.true_angle)) < 3
    # A tool of arrays is the same tool, whatever order the points are in memory.
    again = t2t.Tool(tool.vertices, tool.faces, name=tool.name)
    assert np.allclose(t2t.register(np.asfortranarray(points), again).matrix, pose.matrix, rtol=0, atol=1e-9)
    bare = t2t.register(points, tool, evidence=False)
    assert np.array_equal(bare.matrix, pose.matrix) and bare.sigma is None and bare.verdict is None
    many = t2t.register_many([points, points[::3].copy(), points[:1].copy()], tool)
    assert np.array_equal(many[0].matrix, pose.matrix) and many[2] is None
    with pytest.raises(t2t.Refused, match="N x 3"):
        t2t.register(points[:, :2].copy(), tool)
    with pytest.raises(ValueError, match="unknown registration"):
        t2t.register(points, tool, engine="nearest")
    with pytest.raises(ValueError):
        t2t.register(np.full((20, 3), np.nan), tool)
    with pytest.raises(TypeError):
        t2t.register(points.astype(np.float32), tool)


def test_tools_come_from_files_and_arrays(tmp_path, pair):
    with pytest.raises(t2t.Refused, match="gone.stl"):
        t2t.Tool(tmp_path / "gone.stl")
    with pytest.raises(t2t.Refused, match="corner that is not there"):
        t2t.Tool(np.zeros((3, 3)), np.array([[0, 1, 3]]))
    with pytest.raises(t2t.Refused):
        t2t.Tool(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    assert pair.tool.name in repr(pair.tool) and "mm" in repr(pair.tool)


def test_what_is_not_known_is_refused_in_words(pair):
    for call, words in [
        (lambda: t2t.open("/nowhere/at/all"), "nowhere"),
        (lambda: t2t.Recipe("felt"), "measured, predicted"),
        (lambda: t2t.Recipe(mask="best"), "threshold"),
        (lambda: t2t.Recipe(colour="red"), "no choice colour"),
        (lambda: t2t.Recipe("predicted", bundle="/nowhere"), "nowhere"),
        (lambda: t2t.estimate(pair, stage="end"), "there is no"),
        (lambda: t2t.simulate("hammer"), "pattern_36"),
        (lambda: t2t.simulate("pattern_36", float("nan")), "finite"),
        (lambda: t2t.ssim(np.zeros((9, 9), np.float32), np.zeros((9, 8), np.float32)), "9x9"),
    ]:
        with pytest.raises(t2t.Refused, match=words):
            call()


def test_everything_pickles_by_what_it_is_made_of(demo, pair):
    recipe = t2t.Recipe("predicted", seed=3, mask="threshold")
    made = t2t.simulate("pattern_36", 0.2, 0.001, seed=5, gelslims=2)
    for thing in (demo, demo[3:9], pair, recipe, pair.tool, made):
        text = pickle.dumps(thing)
        assert repr(pickle.loads(text)) == repr(thing)
        assert len(text) < 2_000_000, "images are read again"
    assert pickle.loads(pickle.dumps(recipe)) == recipe and hash(recipe) == hash(t2t.Recipe(**recipe.choices))
    assert recipe != t2t.Recipe("predicted", seed=4, mask="threshold")
    again = pickle.loads(pickle.dumps(made))
    assert np.array_equal(again.gelslim, made.gelslim)
    points = t2t.estimate(pair, stage="cloud").points
    tool = pickle.loads(pickle.dumps(pair.tool))
    assert np.allclose(t2t.register(points, tool).matrix, t2t.register(points, pair.tool).matrix, rtol=0, atol=1e-9)


def felt_angle(given):
    pair, recipe = given
    return t2t.estimate(pair, recipe).pose.angle


def test_other_processes_feel_the_same(demo):
    """Workers of both kinds: forked ones have none of this process's threads."""
    pairs = [demo[at] for at in range(3)]
    for way, recipe in (("spawn", t2t.Recipe()), ("fork", t2t.Recipe(mask="threshold"))):
        here = [felt_angle((pair, recipe)) for pair in pairs]
        assert [result.pose.angle for result in t2t.estimate_many(pairs, recipe)] == here
        with multiprocessing.get_context(way).Pool(2) as pool:
            assert pool.map(felt_angle, [(pair, recipe) for pair in pairs]) == here, way
    # The built-in engine ran here, so it cannot in a fork, and says so instead of waiting for ever.
    recipe = t2t.Recipe(runtime="rten")
    felt_angle((pairs[0], recipe))
    with multiprocessing.get_context("fork").Pool(1) as pool, pytest.raises(t2t.Refused, match="spawn"):
        pool.map(felt_angle, [(pairs[0], recipe)])


def test_a_map_style_data_set_for_pytorch(demo):
    data = demo[:4].torch(("gelslim", "imprint", "true_contact"))
    item = data[2]
    assert len(data) == 4 and item["name"] == demo.names[2] and item["imprint"].shape == (2, 140, 175)
    assert repr(pickle.loads(pickle.dumps(data))) == repr(data)
    with pytest.raises(ValueError, match="has no drawn_mask"):
        demo.torch(["drawn_mask"])[0]
    torch = pytest.importorskip("torch")
    loader = torch.utils.data.DataLoader(data, batch_size=2, num_workers=2)
    batches = list(loader)
    assert [batch["gelslim"].shape for batch in batches] == [(2, 2, 320, 427, 3)] * 2
    assert np.array_equal(batches[1]["imprint"][0].numpy(), item["imprint"], equal_nan=True)


def test_progress_is_told_and_ctrl_c_stops(demo):
    pairs = [demo[at] for at in range(6)]
    news = []
    t2t.estimate_many(pairs, t2t.Recipe("predicted"), progress=lambda done, total, text: news.append((done, total)))
    assert all(total == 6 and done <= 6 for done, total in news)

    class Bar:
        made = []

        def __init__(self):
            self.n, self.total, self.closed = 0, 0, False
            Bar.made.append(self)

        def update(self, n=1):
            self.n += n

        def set_description_str(self, text):
            self.text = text

        def close(self):
            self.closed = True

    t2t.evaluate(demo, grasps=1, resamples=0, progress=Bar)
    assert len(Bar.made) == 1 and Bar.made[0].closed and Bar.made[0].total > 0

    def fail(done, total, text):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        t2t.evaluate("test-set", resamples=0, progress=fail)
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        t2t.evaluate("test-set", resamples=0)


def test_python_goes_on_while_the_program_works(demo):
    """The interpreter is free meanwhile: another thread counts."""
    counted, stop = [0], threading.Event()

    def count():
        while not stop.wait(0.001):
            counted[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    t2t.estimate_many([demo[at] for at in range(8)], t2t.Recipe("predicted"))
    stop.set()
    thread.join()
    assert counted[0] > 20


def test_measures_are_those_of_their_conventions():
    rng = np.random.default_rng(1)
    a, b = (rng.uniform(0, 0.02, (40, 50)).astype(np.float32) for _ in range(2))
    mse = np.mean((a.astype(float) - b) ** 2)
    assert np.isclose(t2t.psnr(a, b), 10 * np.log10(0.0225**2 / mse), atol=1e-6)
    assert t2t.psnr(np.asfortranarray(a), b) == t2t.psnr(a, b) == t2t.psnr(np.tile(a, 2)[:, :50], b)
    assert t2t.psnr(a, a) == np.inf and np.isclose(t2t.ssim(a, a), 1.0)
    assert t2t.ssim(a, b) == t2t.ssim(a, b, data_range=float(a.max()) - float(a.min())) < t2t.ssim(a, b, data_range=0.1)
    features = rng.normal(size=(64, 5)).astype(np.float32)
    assert abs(t2t.frechet(features, features)) < 1e-6
    assert np.isclose(t2t.frechet(features, features + 2), 20, atol=1e-4)


def test_scores_are_a_table_and_filter_the_data(demo):
    scores = t2t.evaluate(demo, grasps=1, resamples=40)
    rows = t2t.table(scores, paper=True)
    assert {row["method"] for row in rows} >= {"Measured (upper bound)", "Paper: VQ-VAE"}
    row = next(row for row in rows if row["upper_bound"])
    assert row["angle_deg_low"] <= row["angle_deg"] <= row["angle_deg_high"]
    assert "angle" in str(scores) and "iframe" in scores._repr_html_() and "grasps by" in repr(scores)
    worse = demo.filter("psnr<99", scores)
    assert 0 < len(worse) < len(demo), "only what was scored"
    assert len(demo.filter("measured:angle>90", scores)) == 0
    part = t2t.evaluate(demo[:4], resamples=0).json()
    assert [grasp["pair"] for grasp in part["pairs"][0]["grasps"]] == demo.names[:4]


@pytest.fixture
def written(tmp_path):
    """A data set of one's own, that labels can be stored beside."""
    folder = tmp_path / "lab"
    verb("simulate", "--tools", "pattern_36", "--grasps", "2", "--out", str(folder))
    return t2t.open(folder)


def test_masks_are_drawn_by_gestures_and_exported(written, tmp_path):
    pair = written[0]
    automatic = t2t.estimate(pair, stage="mask").mask
    assert pair.drawn_mask is None and pair.review == "todo" and pair.note == ""
    square = {"tool": "rectangle", "paint": "contact", "points": [[10, 20], [29, 39]]}
    t2t.label(pair, draw=[square], finger="right", note="a corner", person="Ada")
    right, left = pair.drawn_mask
    assert right[20:40, 10:30].all() and not left.any() and pair.review == "in_progress" and pair.note == "a corner"
    outside = np.ones_like(right)
    outside[20:40, 10:30] = False
    assert np.array_equal(right[outside], automatic[0][outside])
    # A mask that was drawn is what is felt from then on, unless it is not to be.
    assert np.array_equal(t2t.estimate(pair, stage="mask").mask[0], right)
    assert np.array_equal(t2t.estimate(pair, t2t.Recipe(hand=False), stage="mask").mask, automatic)
    t2t.label(pair, clean=["fill_holes", "grow=1.5"], finger="right")
    assert pair.drawn_mask[0].sum() > right.sum()
    t2t.label(pair, begin="cad_truth", over_drawn=True, accept=True, review="done")
    assert pair.review == "done" and pair.drawn_mask[1].any()
    counts = t2t.export_masks(written, tmp_path / "masks")
    assert counts["train"] + counts["val"] + counts["test"] == counts["by_hand"] == 2
    every = t2t.export_masks(written, tmp_path / "all", pairs="all", recipe=t2t.Recipe(mask="threshold"))
    assert every["train"] + every["val"] + every["test"] == 4 and every["by_hand"] == 2
    t2t.label(pair, begin="remove")
    assert pair.drawn_mask is None
    for call, words in [
        (lambda: t2t.label(pair, draw=[{"tool": "brush", "radius_px": -1, "points": [[1, 1]]}]), "radius"),
        (lambda: t2t.label(pair, draw=[square | {"points": [[900, 900], [901, 901]]}]), "touches no pixel"),
        (lambda: t2t.label(pair, begin="guess"), "cad_truth"),
        (lambda: t2t.label(pair, clean=["polish"]), "fill_holes"),
        (lambda: t2t.label(pair, finger="thumb"), "right, left or both"),
        (lambda: t2t.label(t2t.simulate("pattern_36"), note="x"), "simulate"),
        (lambda: t2t.export_masks(written, tmp_path / "none", pairs="some"), "begun"),
    ]:
        with pytest.raises(t2t.Refused, match=words):
            call()
    assert pair.drawn_mask is None, "nothing is stored of what cannot be done"


def test_labels_are_the_verbs(written, tmp_path):
    """The same words to the package and to the verb leave the same files."""
    other = tmp_path / "other"
    shutil.copytree(tmp_path / "lab", other)
    drawing = {"tool": "lasso", "paint": "free", "points": [[60, 40], [110, 45], [100, 90], [55, 80]]}
    t2t.label(written[1], draw=[drawing], clean=["grow=1"], review="done", note="looked at", person="Ada")
    verb("label", str(other), "--pair", written.names[1], "--draw", json.dumps(drawing), "--clean", "grow=1", "--review", "done",
         "--note", "looked at", "--person", "Ada")
    there = t2t.open(other)[1]
    assert np.array_equal(there.drawn_mask, written[1].drawn_mask) and (there.review, there.note) == ("done", "looked at")


def test_pictures_draw_themselves(pair):
    assert pair._repr_html_().count("data:image/png;base64,iVBOR") == 2
    result = t2t.estimate(pair, t2t.Recipe("predicted"))
    assert "Predicted" in result._repr_html_() and result.pose.verdict in result._repr_html_()


def test_the_numbers_are_the_verbs(demo):
    """To the last bit, for measured and predicted imprints and several masks and registrations."""
    for words, recipe in [
        (("--imprint", "measured"), t2t.Recipe()),
        (("--imprint", "predicted", "--seed", "11"), t2t.Recipe("predicted", seed=11)),
        (("--imprint", "measured", "--mask", "threshold", "--engine", "distance_field:gate=1.5"), t2t.Recipe(mask="threshold", engine="distance_field:gate=1.5")),
    ]:
        said = verb("pose", "demo", "--limit", "4", "--no-cache", *words)
        for case in said["cases"]:
            pose = t2t.estimate(demo[case["name"]], recipe).pose
            if pose is None:
                assert case["angle_deg"] is None
                continue
            assert np.degrees(pose.angle) == case["angle_deg"], case["name"]
            assert pose.verdict == case["verdict"]["grade"]


def test_evaluate_is_the_verbs(demo):
    said = verb("evaluate", "demo", "--grasps", "1", "--resamples", "50", "--no-cache", "--pairs")
    here = t2t.evaluate("demo", grasps=1, resamples=50).json()
    for answer in (said, here):
        for scores in answer["pairs"]:
            for grasp in scores["grasps"]:
                grasp["seconds"] = None
    assert here["rows"] == said["rows"] and here["pairs"] == said["pairs"]


def test_the_notebook_runs():
    """Every code cell of the example, in order."""
    book = json.loads((ROOT / "examples" / "touch2touch.ipynb").read_text())
    names = {}
    for cell in book["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), "touch2touch.ipynb", "exec"), names)
    assert names["result"].pose is not None


def test_the_page_runs():
    """Every Python block of docs/python.md, in order."""
    blocks = (ROOT / "docs" / "python.md").read_text().split("```python\n")[1:]
    names = {}
    for block in blocks:
        exec(compile(block.split("```")[0], "docs/python.md", "exec"), names)
    assert len(blocks) >= 3


if __name__ == "__main__":
    sys.exit(pytest.main([__file__, "-q"]))


def test_the_package_is_the_program_too(pair):
    """The command line gives the program's numbers; without a screen there is an error in place of a window."""
    words = ["pose", "demo", "--pair", pair.name]
    package = subprocess.run([sys.executable, "-m", "touch2touch", *words, "--json"], check=True, capture_output=True, text=True)
    # All but the milliseconds that it took.
    said, expected = ([case | {"ms": None} for case in answer["cases"]] for answer in (json.loads(package.stdout), verb(*words)))
    assert said == expected and said
    blind = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")}
    ended = subprocess.run([sys.executable, "-m", "touch2touch", "demo"], env=blind, capture_output=True, text=True, timeout=120)
    assert ended.returncode == 2 and "needs a display" in ended.stderr
