"""Writes resample.json: what torch.nn.functional.interpolate makes of a few images. Needs torch."""
import json, pathlib, torch

torch.manual_seed(1)
cases = []
for mode in ("bilinear", "bicubic", "area"):
    for (w, h), (w2, h2) in (((7, 5), (3, 4)), ((6, 4), (13, 9)), ((11, 8), (8, 11)), ((1, 1), (2, 3)), ((9, 1), (4, 1))):
        image = (torch.randn(1, 1, h, w) * 60).round(decimals=3)
        options = {} if mode == "area" else {"align_corners": False}
        out = torch.nn.functional.interpolate(image, size=(h2, w2), mode=mode, **options)
        cases.append({"mode": mode, "input": image[0, 0].tolist(), "output": out[0, 0].tolist()})
text = json.dumps({"made_by": f"tests/data/resample.py with torch {torch.__version__}", "cases": cases}, indent=0)
pathlib.Path(__file__).with_name("resample.json").write_text(text.replace(",\n", ",") + "\n")
