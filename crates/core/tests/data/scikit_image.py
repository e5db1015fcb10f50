"""Writes scikit_image.json: PSNR and SSIM by scikit-image, and Fréchet distances by pytorch-fid's function, of stored arrays.

Needs numpy, scikit-image, scipy, and the source of pytorch-fid 0.3.0 (its distance alone is taken: neither torch nor weights).
Usage: scikit_image.py PATH/pytorch_fid/fid_score.py
"""
import ast
import json
import pathlib
import sys

import numpy as np
import scipy
import skimage
from scipy import linalg
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

RANGE_M = 0.0225


def distance_of(path):
    """pytorch-fid's function, without what else its module imports."""
    tree = ast.parse(pathlib.Path(path).read_text())
    tree.body = [node for node in tree.body if getattr(node, "name", "") == "calculate_frechet_distance"]
    # SciPy has no `disp` any more; the root it gives is the same.
    found = {"np": np, "linalg": type("linalg", (), {"sqrtm": staticmethod(lambda m, disp=False: (linalg.sqrtm(m), 0.0))})}
    exec(compile(tree, path, "exec"), found)
    return found["calculate_frechet_distance"]


rng = np.random.default_rng(3)
images = []
for h, w in [(16, 21), (12, 30)]:
    y, x = np.mgrid[:h, :w]
    truth = (0.01 * np.exp(-((x - w / 2) ** 2 + (y - h / 2) ** 2) / 30) + 0.0004 * rng.standard_normal((h, w))).astype(np.float32)
    drawn = (truth + 0.001 * rng.standard_normal((h, w)) + 0.0003).astype(np.float32)
    a, b = drawn.astype(float), truth.astype(float)
    images.append({
        "width": w, "height": h, "range": RANGE_M,
        "psnr": peak_signal_noise_ratio(b, a, data_range=RANGE_M),
        "ssim": structural_similarity(b, a, data_range=RANGE_M, gaussian_weights=True, sigma=1.5, use_sample_covariance=False),
        "prediction": [float(v) for v in drawn.ravel()], "truth": [float(v) for v in truth.ravel()],
    })
distance = distance_of(sys.argv[1])
sets = []
for n, d in [(40, 6), (9, 20)]:
    a = (rng.standard_normal((n, d)) * np.linspace(0.5, 2, d)).astype(np.float32)
    b = (rng.standard_normal((n, d)) * np.linspace(1, 1.5, d) + 0.3).astype(np.float32)
    moments = [(s.astype(float).mean(axis=0), np.cov(s.astype(float), rowvar=False)) for s in (a, b)]
    sets.append({"features": d, "first": [float(v) for v in a.ravel()], "second": [float(v) for v in b.ravel()],
                 "distance": float(distance(*moments[0], *moments[1]))})
pathlib.Path(__file__).with_name("scikit_image.json").write_text(json.dumps({
    "made_by": f"tests/data/scikit_image.py with scikit-image {skimage.__version__}, scipy {scipy.__version__}, pytorch-fid 0.3.0",
    "images": images, "sets": sets}) + "\n")
