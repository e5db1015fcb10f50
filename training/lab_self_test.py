"""`python -m training.lab_export --self-test`: tiny random checkpoints of every kind, converted, and refused when damaged."""

import json
import tempfile
from pathlib import Path

import numpy as np
import torch

from . import lab_export, lab_random
from .lab_checkpoint import READER, LabError

TINY = {
    "diffusion": {"unet": {"latent": 4, "condition": 8, "width": 16, "heads": 2, "groups": 4},
                  "first": {"width": 8, "groups": 4}, "condition": {"width": 8, "out": 8}},
    "vqvae": {"width": 8, "codes": 33},
    "mask": {"width": 4},
}
FILES = {"diffusion": "checkpoint.ckpt", "vqvae": "checkpoint.pt", "mask": "masking_random.pth"}


def made(kind, folder, *options):
    """The graphs and manifest of the checkpoint in `folder`."""
    args = lab_export.arguments().parse_args([kind, str(folder / FILES[kind]), *options])
    return lab_export.KINDS[kind](args, **TINY[kind])


def refused(kind, folder, change, words, *options):
    """The checkpoint, after `change` of its state dict, must be refused with an error that holds all of `words`."""
    path = folder / FILES[kind]
    good = path.read_bytes()
    content = torch.load(path, weights_only=False, pickle_module=READER)
    content.pop("callbacks", None)
    change(content.get("state_dict", content))
    torch.save(content, path)
    try:
        made(kind, folder, *options)
    except LabError as err:
        missing = [w for w in (*words, str(path)) if w not in str(err)]
        assert not missing, f"the error does not name {missing}: {err}"
    else:
        raise AssertionError(f"not refused: {words}")
    finally:
        path.write_bytes(good)


def run():
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for kind in lab_export.KINDS:
            lab_random.KINDS[kind](folder, **TINY[kind])
            for f16 in (False, True):
                # Exporting compares every graph with torch.
                graphs, manifest = made(kind, folder)
                lab_export.export(graphs, manifest, folder / f"{kind}_{f16}", f16)
                assert json.loads((folder / f"{kind}_{f16}" / "manifest.json").read_text())["files"].keys() == graphs.keys()
        diffusion(folder)
        vqvae(folder)
        mask(folder)
    print("self-test passed")


def diffusion(folder):
    options = ("--shift", str(folder / "stats.pt"))
    graphs, manifest = made("diffusion", folder, *options)
    assert manifest["input"]["mean"] == [-2.73, -1.61, -2.22] and manifest["input"]["std"] == [17.5, 10.9, 14.7]
    assert manifest["output"]["range_m"] == [-0.0188, 0.0392] and manifest["latent"]["scale_factor"] == 0.7310586
    assert manifest["schedule"] == {"kind": "scaled_linear", "steps": 1000, "beta_start": 0.0015, "beta_end": 0.0155}
    assert manifest["shift"] == {"pred_mean": 0.0219, "pred_std": 0.0024, "gt_mean": 0.0046, "gt_std": 0.0047}
    # The averages are taken, and they are not the weights as trained.
    raw, _ = made("diffusion", folder, "--no-ema")
    example = graphs["denoiser"].examples
    with torch.no_grad():
        gap = (graphs["denoiser"].net(*example) - raw["denoiser"].net(*example)).abs().max()
    assert gap > 0.1, gap
    # The lab's steps: 1, 6, …, 996.
    assert (manifest["defaults"]["steps"], manifest["defaults"]["spacing"]) == (200, "lab")

    weight = "model_ema.diffusion_modelinput_blocks10in_layers0weight"
    first = "first_stage_model.decoder.conv_in.weight"
    refused("diffusion", folder, lambda s: s.pop(weight), [weight, "missing"])
    refused("diffusion", folder, lambda s: s.update({first: torch.zeros(2, 2)}), [first, "(2, 2)", "shape"])
    refused("diffusion", folder, lambda s: s.update({first: s[first] * float("nan")}), [first, "not finite"])
    refused("diffusion", folder, lambda s: s.update({"cond_stage_model.extra": torch.zeros(1)}), ["cond_stage_model.extra", "--ignore"])
    for extra in ("model.diffusion_model.label_emb.weight", "model_ema.diffusion_modellabel_embweight"):
        refused("diffusion", folder, lambda s, extra=extra: s.update({extra: torch.zeros(1)}), [extra])
    refused("diffusion", folder, lambda s: s.pop("scale_factor"), ["scale_factor", "--scale-factor"])
    refused("diffusion", folder, lambda s: s["betas"].mul_(torch.rand(1000)), ["betas"])
    refused("diffusion", folder, lambda s: s.clear(), ["missing"])

    stats = folder / "training_stats.pt"
    good = stats.read_bytes()
    for change, word in (({"gelslim_std": [1, 1, 0]}, "gelslim_std"), ({"gelslim_mean": [1.0]}, "gelslim_mean"),
                         ({"bubbles_max": -1}, "bubbles_max"), ({"bubbles_min": float("nan")}, "bubbles_min")):
        torch.save({"gelslim_mean": np.zeros(3), "gelslim_std": [1.0, 1.0, 1.0], "bubbles_min": np.float64(-0.01),
                    "bubbles_max": 0.02, **change}, stats)
        try:
            made("diffusion", folder)
        except LabError as err:
            assert word in str(err) and str(stats) in str(err), err
        else:
            raise AssertionError(f"{word} was not refused")
    stats.write_bytes(b"not a file of PyTorch")
    try:
        made("diffusion", folder)
    except LabError as err:
        assert str(stats) in str(err)
    else:
        raise AssertionError("a damaged file was not refused")
    stats.write_bytes(good)


def vqvae(folder):
    graphs, manifest = made("vqvae", folder)
    net = lab_random.m.VqVae(**TINY["vqvae"])
    net.load_state_dict(torch.load(folder / "checkpoint.pt", weights_only=True))
    image = torch.randn(2, 3, 128, 128)
    with torch.no_grad():
        z = net.encoder(image)
        book = net.codebook["embedding"].weight
        far = ((z[:, None] - book[None, :, :, None, None]) ** 2).sum(dim=2)
        expected = net.decoder(book[far.argmin(dim=1)].permute(0, 3, 1, 2))
        codes = graphs["condition_encoder"].net(image)
        found = graphs["decoder"].net(graphs["denoiser"].net(torch.randn(codes.shape), torch.tensor([999, 999]), codes))
    assert len(torch.unique(far.argmin(dim=1))) > 3
    # In metres, as the lab's evaluation has it.
    low, high = manifest["output"]["range_m"]
    gap = ((found + 1) / 2 * (high - low) + low - (expected * 0.00424 + 0.00382)).abs().max().item()
    assert gap < 1e-7, gap
    assert manifest["provenance"]["test_tools"] == ["pattern_35"]
    refused("vqvae", folder, lambda s: s.pop("codebook.embedding.weight"), ["codebook.embedding.weight", "missing"])


def mask(folder):
    _, manifest = made("mask", folder)
    assert manifest["input"]["cast"] == "wrap" and manifest["input"]["range_m"] == [-0.0116, 0.0225]
    _, manifest = made("mask", folder, "--cast", "saturate")
    assert manifest["input"]["cast"] == "saturate"
    refused("mask", folder, lambda s: s.update({"up1.conv.double_conv.0.weight": torch.zeros(8, 8, 3, 3)}), ["up1.conv.double_conv.0.weight"])
