"""Writes ssim.json: SSIM by its definition, one window at a time, in numpy float64. Needs numpy."""
import json, pathlib, numpy as np

def ssim(p, t, L):
    h, w = p.shape
    g = np.exp(-(np.arange(11) - 5.0) ** 2 / (2 * 1.5 ** 2)); W = np.outer(g, g); W /= W.sum()
    pad = lambda a: np.pad(a, 5)
    P, T = pad(p), pad(t)
    total = 0.0
    for y in range(h):
        for x in range(w):
            a, b = P[y:y + 11, x:x + 11], T[y:y + 11, x:x + 11]
            ma, mb = (W * a).sum(), (W * b).sum()
            va, vb, cov = (W * (a - ma) ** 2).sum(), (W * (b - mb) ** 2).sum(), (W * (a - ma) * (b - mb)).sum()
            c1, c2 = (0.01 * L) ** 2, (0.03 * L) ** 2
            total += (2 * ma * mb + c1) * (2 * cov + c2) / ((ma ** 2 + mb ** 2 + c1) * (va + vb + c2))
    return total / (h * w)

rng = np.random.default_rng(1)
cases = []
for (h, w), scale, offset, noise, L in [((9, 14), 0.004, 0.005, 0.001, 0.0225), ((9, 14), 0.004, 0.005, 0.001, None),
                                        ((12, 8), 0.3, 0.5, 0.2, 1.0), ((3, 5), 0.01, 0.09, 0.01, 0.0341)]:
    t = (offset + scale * rng.standard_normal((h, w))).astype(np.float32)
    p = (t + noise * rng.standard_normal((h, w))).astype(np.float32)
    used = float(p.max()) - float(p.min()) if L is None else L
    cases.append({"width": w, "height": h, "range": L, "ssim": ssim(p.astype(float), t.astype(float), used),
                  "prediction": [float(v) for v in p.ravel()], "truth": [float(v) for v in t.ravel()]})
pathlib.Path(__file__).with_name("ssim.json").write_text(
    json.dumps({"made_by": f"tests/data/ssim.py with numpy {np.__version__}", "cases": cases}) + "\n")
