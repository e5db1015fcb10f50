"""Writes the tiny bundles of the tests: generator/, mask/, rounding/ and classifier/. Needs onnx and numpy.

The weights are fixed random numbers; the graphs use the operators of real ones (convolutions, group norm as instance
norm, a time embedding, nearest resizing, transposed convolution, pooling, softmax attention over pixels).
"""
import hashlib, json, pathlib
import numpy as np, onnx
from onnx import TensorProto as T, helper as h, numpy_helper as nh

HERE = pathlib.Path(__file__).parent
rng = np.random.default_rng(5)


class Graph:
    def __init__(self):
        self.nodes, self.weights, self.count = [], [], 0

    def weight(self, *shape, scale=None):
        scale = (1.0 / np.sqrt(np.prod(shape[1:]))) if scale is None else scale
        return self.const((rng.standard_normal(shape) * scale).astype(np.float32))

    def const(self, value):
        name = f"w{len(self.weights)}"
        self.weights.append(nh.from_array(np.asarray(value), name))
        return name

    def op(self, kind, *inputs, out=None, **attributes):
        self.count += 1
        out = out or f"t{self.count}"
        self.nodes.append(h.make_node(kind, list(inputs), [out], **attributes))
        return out

    def conv(self, x, cin, cout, k=3, stride=1, out=None):
        p = k // 2
        return self.op("Conv", x, self.weight(cout, cin, k, k), self.weight(cout, scale=0.1), out=out,
                       kernel_shape=[k, k], pads=[p] * 4, strides=[stride] * 2)

    def silu(self, x):
        return self.op("Mul", x, self.op("Sigmoid", x))

    def group_norm(self, x, channels, groups):
        shape = self.op("Shape", x)
        y = self.op("Reshape", x, self.const(np.array([0, groups, -1], np.int64)))
        y = self.op("InstanceNormalization", y, self.const(np.ones(groups, np.float32)), self.const(np.zeros(groups, np.float32)), epsilon=1e-5)
        y = self.op("Reshape", y, shape)
        return self.op("Mul", y, self.const(np.linspace(0.5, 1.5, channels, dtype=np.float32).reshape(1, channels, 1, 1)))

    def save(self, path, inputs, outputs):
        def info(name, kind, shape):
            return h.make_tensor_value_info(name, kind, ["N", *shape])
        graph = h.make_graph(self.nodes, "test", [info(*i) for i in inputs], [info(*o) for o in outputs], self.weights)
        model = h.make_model(graph, opset_imports=[h.make_opsetid("", 17)], producer_name="make_bundles.py")
        model.ir_version = 8
        onnx.checker.check_model(model, full_check=True)
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(model.SerializeToString())
        return {"path": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}


def condition_encoder(path, sensor="gelslim", channels=3):
    g = Graph()
    x = g.silu(g.conv(sensor, channels, 6, stride=2))
    g.conv(x, 6, 5, stride=2, out="condition")
    return g.save(path, [(sensor, T.FLOAT, [channels, 16, 16])], [("condition", T.FLOAT, [5, 4, 4])])


def denoiser(path):
    g = Graph()
    t = g.op("Unsqueeze", g.op("Cast", "timestep", to=T.FLOAT), g.const(np.array([1], np.int64)))
    angle = g.op("Mul", t, g.const(np.exp(-np.linspace(0, 9, 4)).astype(np.float32).reshape(1, 4)))
    emb = g.op("Concat", g.op("Cos", angle), g.op("Sin", angle), axis=1)
    emb = g.op("Gemm", emb, g.weight(8, 8), g.weight(8, scale=0.1))
    emb = g.op("Unsqueeze", g.silu(emb), g.const(np.array([2, 3], np.int64)))
    x = g.conv(g.op("Concat", "latent", "condition", axis=1), 9, 8)
    x = g.op("Add", x, emb)
    x = g.silu(g.group_norm(x, 8, 4))
    # Attention over the 16 pixels.
    q = g.op("Reshape", g.conv(x, 8, 8, k=1), g.const(np.array([0, 8, 16], np.int64)))
    score = g.op("Softmax", g.op("MatMul", g.op("Transpose", q, perm=[0, 2, 1]), q), axis=-1)
    a = g.op("Reshape", g.op("MatMul", q, score), g.const(np.array([0, 8, 4, 4], np.int64)))
    x = g.op("Add", x, a)
    g.conv(x, 8, 4, out="prediction")
    shape = [4, 4, 4]
    return g.save(path, [("latent", T.FLOAT, shape), ("timestep", T.INT64, []), ("condition", T.FLOAT, [5, 4, 4])],
                  [("prediction", T.FLOAT, shape)])


def decoder(path):
    g = Graph()
    x = g.op("Resize", "latent", "", g.const(np.array([1, 1, 2, 2], np.float32)), mode="nearest",
             coordinate_transformation_mode="asymmetric", nearest_mode="floor")
    x = g.silu(g.conv(x, 4, 6))
    x = g.op("ConvTranspose", x, g.weight(6, 6, 2, 2), kernel_shape=[2, 2], strides=[2, 2])
    g.op("Tanh", g.conv(g.silu(x), 6, 3), out="image")
    return g.save(path, [("latent", T.FLOAT, [4, 4, 4])], [("image", T.FLOAT, [3, 16, 16])])


def mask_unet(path):
    # No trained weights: logits = (imprint - 0.5) * 40, so that the mask is the half of the range, whatever is near.
    g = Graph()
    x = g.op("MaxPool", "imprint", kernel_shape=[1, 1], strides=[1, 1])
    kernel = np.zeros((2, 1, 3, 3), np.float32)
    kernel[:, 0, 1, 1] = [-20, 20]
    g.op("Conv", x, g.const(kernel), g.const(np.array([10, -10], np.float32)), kernel_shape=[3, 3], pads=[1] * 4, out="logits")
    return g.save(path, [("imprint", T.FLOAT, [1, 14, 18])], [("logits", T.FLOAT, [2, 14, 18])])


def rounding(path):
    # The same product in two orders, subtracted: what is left is how an engine rounds, and no other rounds so.
    g, rng = Graph(), np.random.default_rng(2)
    first, second = ((rng.standard_normal((18, 18)) / 4).astype(np.float32) for _ in range(2))
    stepwise = g.op("MatMul", g.op("Tanh", g.op("MatMul", "imprint", g.const(first))), g.const(second))
    halves = [g.op("MatMul", g.op("Tanh", g.op("MatMul", "imprint", g.const(first[:, part]))), g.const(second[part]))
              for part in (slice(0, 9), slice(9, 18))]
    left = g.op("Mul", g.op("Sub", stepwise, g.op("Add", *halves)), g.const(np.float32(1e7)))
    g.op("Concat", "imprint", left, axis=1, out="logits")
    return g.save(path, [("imprint", T.FLOAT, [1, 14, 18])], [("logits", T.FLOAT, [2, 14, 18])])


def tool_classifier(path):
    # No trained weights: the features are the means of the four quarters, and the class is the deepest of the first three.
    g = Graph()
    x = g.op("AveragePool", "imprint", kernel_shape=[7, 9], strides=[7, 9])
    g.op("Flatten", x, out="features")
    g.op("MatMul", "features", g.const(np.eye(4, 3, dtype=np.float32) * 10), out="logits")
    return g.save(path, [("imprint", T.FLOAT, [1, 14, 18])], [("logits", T.FLOAT, [3]), ("features", T.FLOAT, [4])])


def reference():
    """What onnx's own (numpy) evaluator makes of the generator's graphs, batch of two."""
    from onnx.reference import ReferenceEvaluator
    run = lambda role, **inputs: ReferenceEvaluator(str(HERE / "generator" / f"{role}.onnx")).run(None, inputs)[0]
    gelslim = np.sin(np.arange(2 * 3 * 16 * 16) * 0.37).astype(np.float32).reshape(2, 3, 16, 16)
    latent = np.cos(np.arange(2 * 4 * 4 * 4) * 0.71).astype(np.float32).reshape(2, 4, 4, 4)
    condition = run("condition_encoder", gelslim=gelslim)
    prediction = run("denoiser", latent=latent, timestep=np.array([700, 700], np.int64), condition=condition)
    image = run("decoder", latent=latent)
    text = json.dumps({"made_by": f"tests/data/bundles/make_bundles.py with onnx {onnx.__version__}",
                       "condition": [round(float(v), 7) for v in condition.ravel()],
                       "prediction": [round(float(v), 7) for v in prediction.ravel()],
                       "image": [round(float(v), 7) for v in image.ravel()[::7]]})
    (HERE / "reference.json").write_text(text + "\n")


def write(folder, manifest, version=1):
    manifest = {"format": "touch2touch-bundle", "format_version": version, **manifest,
                "provenance": {"made_by": f"tests/data/bundles/make_bundles.py with onnx {onnx.__version__}"}}
    (HERE / folder / "manifest.json").write_text(json.dumps(manifest, indent=2) + "\n")


d = HERE / "generator"
write("generator", {
    "kind": "generator", "name": "Tiny generator of the tests",
    "files": {"condition_encoder": condition_encoder(d / "condition_encoder.onnx"),
              "denoiser": denoiser(d / "denoiser.onnx"), "decoder": decoder(d / "decoder.onnx")},
    "input": {"sensor": "gelslim", "size": [16, 16], "scale": "0..1", "mean": [-0.01, -0.006, -0.009],
              "std": [0.07, 0.04, 0.06], "resampling": "bilinear", "rotation_deg": 0},
    "condition": {"shape": [5, 4, 4]}, "latent": {"shape": [4, 4, 4], "scale_factor": 0.8},
    "schedule": {"kind": "scaled_linear", "steps": 1000, "beta_start": 0.0015, "beta_end": 0.0155},
    "prediction": "v",
    "output": {"size": [16, 16], "channels": 3, "range_m": [-0.0116, 0.0225], "reduction": "mean",
               "rotation_deg": 180, "imprint_size": [18, 14], "resampling": "bilinear"},
    "shift": {"pred_mean": 0.0126, "pred_std": 0.0015, "gt_mean": 0.0027, "gt_std": 0.0033},
    "defaults": {"steps": 6, "sampler": "ddim", "spacing": "trailing", "eta": 0.0, "seed": 42}})
for folder, name, graph in (("mask", "Tiny mask UNet of the tests", mask_unet), ("rounding", "Rounding of the tests", rounding)):
    write(folder, {
        "kind": "mask_unet", "name": name, "files": {"mask_unet": graph(HERE / folder / "mask_unet.onnx")},
        "input": {"sensor": "bubble", "size": [18, 14], "range_m": [0.0, 0.01], "cast": "none", "rotation_deg": 180},
        "output": {"classes": 2, "threshold": 0.5}})
write_classifier = tool_classifier(HERE / "classifier" / "tool_classifier.onnx")
write("classifier", {
    "kind": "tool_classifier", "name": "Tiny tool classifier of the tests", "files": {"tool_classifier": write_classifier},
    "input": {"sensor": "bubble", "size": [18, 14], "range_m": [0.0, 0.01], "rotation_deg": 180},
    "output": {"classes": ["pattern_31_rod", "pattern_35", "pattern_36"], "features": 4}})
reference()


def between(folder, name, source, target, output):
    """A generator of manifest version 2, which declares its sensors."""
    d, color = HERE / folder, source["kind"] == "color"
    write(folder, {
        "kind": "generator", "name": name,
        "files": {"condition_encoder": condition_encoder(d / "condition_encoder.onnx", source["key"], 3 if color else 1),
                  "denoiser": denoiser(d / "denoiser.onnx"), "decoder": decoder(d / "decoder.onnx")},
        "input": {"sensor": source, "size": [16, 16], "resampling": "bilinear", "rotation_deg": 0 if color else 180,
                  **({"scale": "0..255", "mean": [0, 0, 0], "std": [20, 20, 20]} if color else
                     {"scale": "m", "mean": [0.003], "std": [0.004]})},
        "condition": {"shape": [5, 4, 4]}, "latent": {"shape": [4, 4, 4], "scale_factor": 0.8},
        "schedule": {"kind": "scaled_linear", "steps": 1000, "beta_start": 0.0015, "beta_end": 0.0155},
        "prediction": "v",
        "output": {"sensor": target, "size": [16, 16], "channels": 3, "imprint_size": target["size"], **output},
        "defaults": {"steps": 4, "sampler": "ddim", "spacing": "trailing", "eta": 0.0, "seed": 42}}, version=2)


gelslim = {"key": "gelslim", "kind": "color", "size": [427, 320]}
bubble = {"key": "bubble", "kind": "depth", "size": [175, 140]}
digit = {"key": "digit", "kind": "color", "size": [240, 320]}
between("bubble_to_gelslim", "Tiny generator from Soft Bubble to GelSlim", bubble, gelslim, {"range": [-120, 120]})
between("digit_to_bubble", "Tiny generator from DIGIT to Soft Bubble", digit, bubble,
        {"range_m": [-0.0116, 0.0225], "reduction": "mean", "rotation_deg": 180})
