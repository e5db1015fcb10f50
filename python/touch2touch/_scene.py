"""Notebook output: an interactive 3D view and a sortable table, as self-contained HTML without a server."""

import base64
import html
import json

import numpy as np

from ._many import table

# Most triangles and points that are drawn: every one is sorted for each picture.
_MOST_TRIANGLES, _MOST_POINTS = 6000, 5000
# Most bytes of the HTML.
_MOST = 2 << 20
# Meters to the whole numbers of the page: hundredths of a millimeter.
_UNIT = 1e-5

_VIEW = r"""<!doctype html><meta charset="utf-8"><style>body{margin:0;font:12px sans-serif;background:#fff;color:#222}
canvas{display:block;width:100%;height:340px;touch-action:none;cursor:grab}p{margin:2px 6px}i{display:inline-block;width:9px;height:9px;margin:0 4px 0 10px}</style>
<canvas></canvas><p id="legend"></p><script>
const scene = SCENE, canvas = document.querySelector("canvas"), pen = canvas.getContext("2d");
const numbers = (text) => new Int16Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
const solids = scene.solids.map((s) => ({ at: numbers(s.at), faces: new Uint16Array(numbers(s.faces).buffer), color: s.color }));
const clouds = scene.clouds.map((c) => ({ at: numbers(c.at), color: c.color, size: c.size }));
const low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9];
for (const { at } of [...solids, ...clouds]) for (let i = 0; i < at.length; i++) {
  low[i % 3] = Math.min(low[i % 3], at[i]); high[i % 3] = Math.max(high[i % 3], at[i]);
}
const middle = low.map((v, k) => (v + high[k]) / 2), reach = Math.hypot(...low.map((v, k) => high[k] - v)) / 2 || 1;
// Seen along the closing axis at first: y to the right, z up.
let turn = 0.6, tilt = 0.35, zoom = 1, held = null;
function draw() {
  const ratio = devicePixelRatio || 1, width = canvas.clientWidth * ratio, height = canvas.clientHeight * ratio;
  canvas.width = width; canvas.height = height;
  const [ct, st, ci, si] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
  const scale = (0.47 * zoom * Math.min(width, height)) / reach;
  const place = (at, i) => {
    const x = at[i] - middle[0], y = at[i + 1] - middle[1], z = at[i + 2] - middle[2];
    const right = y * ct - x * st, away = -y * st - x * ct;
    return [width / 2 + scale * right, height / 2 - scale * (z * ci + away * si), away * ci - z * si];
  };
  const parts = [];
  for (const { at, faces, color } of solids) {
    const corners = []; for (let i = 0; i < at.length; i += 3) corners.push(place(at, i));
    for (let f = 0; f < faces.length; f += 3) {
      const [a, b, c] = [corners[faces[f]], corners[faces[f + 1]], corners[faces[f + 2]]];
      const u = [b[0] - a[0], b[1] - a[1], (b[2] - a[2]) * scale], v = [c[0] - a[0], c[1] - a[1], (c[2] - a[2]) * scale];
      const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const light = 0.45 + 0.55 * Math.abs(0.3 * n[0] - 0.4 * n[1] + 0.87 * n[2]) / (Math.hypot(...n) || 1);
      parts.push([(a[2] + b[2] + c[2]) / 3, a, b, c, color.map((k) => Math.round(k * light)).join()]);
    }
  }
  for (const { at, color, size } of clouds) for (let i = 0; i < at.length; i += 3) {
    const p = place(at, i); parts.push([p[2], p, size * ratio, null, color.join()]);
  }
  parts.sort((a, b) => b[0] - a[0]);
  pen.clearRect(0, 0, width, height);
  for (const [, a, b, c, color] of parts) {
    pen.fillStyle = pen.strokeStyle = `rgb(${color})`;
    if (c === null) { pen.fillRect(a[0] - b / 2, a[1] - b / 2, b, b); continue; }
    pen.beginPath(); pen.moveTo(a[0], a[1]); pen.lineTo(b[0], b[1]); pen.lineTo(c[0], c[1]); pen.closePath(); pen.fill(); pen.stroke();
  }
}
canvas.onpointerdown = (e) => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); };
canvas.onpointermove = (e) => {
  if (!held) return;
  turn -= 0.01 * (e.clientX - held[0]); tilt = Math.max(-1.57, Math.min(1.57, tilt + 0.01 * (e.clientY - held[1])));
  held = [e.clientX, e.clientY]; draw();
};
canvas.onpointerup = canvas.onpointercancel = () => { held = null; };
canvas.addEventListener("wheel", (e) => { e.preventDefault(); zoom = Math.max(0.3, Math.min(20, zoom * Math.exp(-0.001 * e.deltaY))); draw(); }, { passive: false });
canvas.ondblclick = () => { [turn, tilt, zoom] = [0.6, 0.35, 1]; draw(); };
document.getElementById("legend").innerHTML = scene.legend.map(([c, text]) => `<i style="background:rgb(${c})"></i>${text}`).join("");
addEventListener("resize", draw); draw();
</script>"""

_TABLE = r"""<!doctype html><meta charset="utf-8"><style>body{margin:0;font:13px sans-serif}table{border-collapse:collapse}
td,th{padding:3px 8px;border-bottom:1px solid #ddd;text-align:right;white-space:nowrap}th{cursor:pointer;background:#f4f4f4}
td:first-child,th:first-child{text-align:left}</style>TABLE<script>
const number = (text) => { const found = text.match(/-?\d+(\.\d+)?/); return found ? +found[0] : NaN; };
for (const head of document.querySelectorAll("th")) head.onclick = () => {
  const at = head.cellIndex, body = head.closest("table").tBodies[0], back = head.dataset.way === "up";
  for (const other of document.querySelectorAll("th")) delete other.dataset.way;
  head.dataset.way = back ? "down" : "up";
  const rows = [...body.rows], key = (row) => row.cells[at] ? row.cells[at].textContent : "";
  const numeric = at > 0 && rows.some((row) => !isNaN(number(key(row))));
  // What is no number comes last, whichever way.
  const value = (row) => { const found = number(key(row)); return isNaN(found) ? Infinity : back ? -found : found; };
  rows.sort((a, b) => numeric ? (value(a) === value(b) ? 0 : value(a) - value(b)) : (back ? -1 : 1) * key(a).localeCompare(key(b)));
  body.append(...rows);
};
</script>"""


def _frame(page, height):
    """A page in an iframe, isolated from the notebook."""
    return f'<iframe srcdoc="{html.escape(page)}" style="width:100%;height:{height}px;border:0" sandbox="allow-scripts"></iframe>'


def _numbers(values, kind="<i2"):
    limits = np.iinfo(kind)
    whole = np.clip(np.round(values), limits.min, limits.max).astype(kind)
    return base64.b64encode(whole.tobytes()).decode()


def _coarser(vertices, faces):
    """A mesh with few enough triangles, by merging nearby vertices."""
    size = np.ptp(vertices, axis=0).max() if len(vertices) else 0
    cells = 400
    while len(faces) > _MOST_TRIANGLES or len(vertices) > 65535:
        cell = np.round(vertices / (size / cells)).astype(int)
        _, first, of = np.unique(cell, axis=0, return_index=True, return_inverse=True)
        faces, vertices = of.reshape(-1)[faces], vertices[first]
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
        cells = int(cells * 0.8)
    return vertices, faces


def _solid(tool, grasp_from_object, color):
    vertices, faces = _coarser(tool.vertices, tool.faces)
    placed = vertices @ grasp_from_object[:3, :3].T + grasp_from_object[:3, 3]
    return {"at": _numbers(placed / _UNIT), "faces": _numbers(faces, "<u2"), "color": color}


def _cloud(points, color, size):
    points = points[np.isfinite(points).all(axis=1)]
    step = -(-len(points) // _MOST_POINTS) or 1
    return {"at": _numbers(points[::step] / _UNIT), "color": color, "size": size}


def _surface(pair, imprint):
    """The points of the imprints of all fingers, grasp frame."""
    if imprint is None or pair.K is None:
        return None
    points = []
    for finger in range(len(imprint)):
        depth = pair.depth_reference[finger].astype(float) - imprint[finger]
        height, width = depth.shape
        step = max(1, round((height * width / (_MOST_POINTS / 2)) ** 0.5))
        rows, columns = np.mgrid[0:height:step, 0:width:step].reshape(2, -1)
        z = depth[rows, columns]
        camera = np.linalg.inv(pair.K[finger]) @ np.stack([columns, rows, np.ones_like(rows)]) * z
        points.append((pair.grasp_from_camera[finger] @ np.vstack([camera, np.ones_like(z)]))[:3].T)
    return np.concatenate(points)


_GRAY, _BLUE, _RED, _GREEN = [150, 150, 155], [90, 130, 200], [200, 30, 110], [60, 150, 70]


def _view(pair, imprint, points, pose):
    """The page of a pair or result; `None` if it has no 3D content."""
    solids, clouds, legend = [], [], []
    for matrix, color, text in ((pair.truth, _GREEN, "true pose"), (pose, _BLUE, "pose")):
        # The true pose only where there is no other.
        if matrix is None or (color is _GREEN and pose is not None):
            continue
        try:
            tool = pair.tool
        except ValueError:
            continue
        if color is _GREEN:
            matrix = matrix.copy()
            matrix[:3, 3] -= matrix[:3, :3] @ [np.ptp(tool.vertices[:, 0]) / 2 + tool.vertices[:, 0].min(), 0, 0]
        solids.append(_solid(tool, matrix, color))
        legend.append([color, f"{tool.name}, {text}"])
    surface = _surface(pair, imprint)
    for cloud, color, size, text in ((surface, _GRAY, 2, "surface felt"), (points, _RED, 3, "contact")):
        if cloud is not None and len(cloud):
            clouds.append(_cloud(cloud, color, size))
            legend.append([color, text])
    if not solids and not clouds:
        return None
    legend = [[",".join(map(str, color)), html.escape(text)] for color, text in legend]
    scene = json.dumps({"solids": solids, "clouds": clouds, "legend": legend}).replace("</", "<\\/")
    return _VIEW.replace("SCENE", scene)


def _shown(title, page, caption, pngs):
    parts = [f"<div>{title}</div>"] + ([_frame(page, 365)] if page else [])
    tags = (f'<img style="margin-right:4px" src="data:image/png;base64,{base64.b64encode(png).decode()}">' for png in pngs)
    images = f"<div>{caption} imprint</div>" + "".join(tags)
    if sum(map(len, parts)) + len(images) < _MOST:
        parts.append(images)
    return "".join(parts)


def pair_html(pair, pngs):
    return _shown(html.escape(repr(pair)), _view(pair, pair.imprint, None, None), "Measured", pngs)


def estimate_html(result, source, pngs):
    pair, pose = result.pair, result.pose
    title = pose._repr_html_() if pose else html.escape(repr(result))
    return _shown(title, _view(pair, result.imprint, result.points, pose.matrix if pose else None), source, pngs)


def scores_html(scores):
    """The rows of an evaluation as a table that sorts by a click on a column header."""
    rows = table(scores)
    keys = [key for key in dict.fromkeys(key for row in rows for key in row) if not key.endswith(("_low", "_high"))]
    keys = [key for key in keys if any(isinstance(row.get(key), (str, int, float)) and row.get(key) is not False for row in rows)]

    def text(value):
        return "–" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)

    def line(cells, kind):
        return "<tr>" + "".join(f"<{kind}>{html.escape(cell)}</{kind}>" for cell in cells) + "</tr>"

    body = "".join(line([text(row.get(key)) for key in keys], "td") for row in rows)
    page = _TABLE.replace("TABLE", f"<table><thead>{line(keys, 'th')}</thead><tbody>{body}</tbody></table>")
    return _frame(page, 60 + 26 * len(rows))
