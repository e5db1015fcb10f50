"""Random checkpoints of exactly the lab's shapes and file formats: `python -m training.lab_random FOLDER [--kind KIND]`.

They predict nothing. They prove the way from a checkpoint to a bundle without the lab's files: nothing is zero (the
released networks begin with convolutions of zeros), no two networks are equal, and values stay of the size of one.
"""

import argparse
import pickle
import sys
import types
from pathlib import Path

import torch
from torch import nn

from . import lab_models as m
from .lab_checkpoint import empty


class KlEncoder(nn.Module):
    """The names and shapes of the first stage's encoder; prediction never runs it."""

    def __init__(self, latent=4, width=128, mult=(1, 2, 4, 4), blocks=2, channels=3, groups=32):
        super().__init__()
        self.conv_in, c = nn.Conv2d(channels, width, 3, padding=1), width
        self.down = nn.ModuleList()
        for level, k in enumerate(mult):
            made = nn.ModuleList()
            for _ in range(blocks):
                made.append(m.KlBlock(c, k * width, groups))
                c = k * width
            self.down.append(nn.ModuleDict({"block": made}))
            if level + 1 < len(mult):
                self.down[-1]["downsample"] = nn.ModuleDict({"conv": nn.Conv2d(c, c, 3, 2)})
        self.mid = m.kl_middle(c, groups)
        self.norm_out, self.conv_out = m.grouped(c, groups, 1e-6), nn.Conv2d(c, 2 * latent, 3, padding=1)


def randomise(net, seed, gains=()):
    """Random values for everything: `gains` scale the weights whose names end so."""
    noise = torch.Generator().manual_seed(seed)

    def normal(like, std, mean=0.0):
        return torch.randn(like.shape, generator=noise) * std + mean

    state = {}
    for name, value in net.state_dict().items():
        if name.endswith("num_batches_tracked"):
            state[name] = torch.tensor(1000)
        elif name.endswith("running_var"):
            state[name] = torch.rand(value.shape, generator=noise) + 0.5
        elif value.dim() < 2:
            state[name] = normal(value, 0.1, 1.0 if name.endswith("weight") else 0.0)
        else:
            # Of a transposed convolution with stride 2, a quarter of the taps meets each output.
            transposed = any(part in name for part in ("deconv", "up1.up.", "up2.up.", "up3.up.", "up4.up."))
            fan = value[:, 0].numel() / 4 if transposed else value[0].numel()
            gain = next((g for end, g in gains if name.endswith(end)), 1.0)
            state[name] = normal(value, gain * fan**-0.5)
    net.load_state_dict(state, assign=True)
    return net.eval().requires_grad_(False)


def prefixed(prefix, net):
    return {prefix + k: v for k, v in net.state_dict().items()}


def save(content, path):
    """As the lab's PyTorch 1.11 did; Lightning's callbacks are keyed by a class of a package that a reader may not have."""
    module = types.ModuleType("pytorch_lightning.callbacks.model_checkpoint")
    kind = type("ModelCheckpoint", (), {"__module__": module.__name__})
    module.ModelCheckpoint = kind
    parents = ["pytorch_lightning", "pytorch_lightning.callbacks", module.__name__]
    saved = {name: sys.modules.get(name) for name in parents}
    try:
        for name in parents:
            sys.modules[name] = module if name == module.__name__ else types.ModuleType(name)
        if "state_dict" in content:
            content = {**content, "callbacks": {kind: {"best_model_score": torch.tensor(0.1), "best_model_path": "last.ckpt"}}}
        torch.save(content, path, pickle_module=pickle)
    finally:
        for name, module in saved.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module


def diffusion(folder, seed=0, unet=None, first=None, condition=None):
    """`checkpoint.ckpt`, `training_stats.pt` and the evaluation's `stats.pt`."""
    unet, first, condition = unet or {}, first or {}, condition or {}
    state = {"model_ema.decay": torch.tensor(0.9999), "model_ema.num_updates": torch.tensor(12345, dtype=torch.int32)}
    betas = torch.linspace(0.0015**0.5, 0.0155**0.5, 1000, dtype=torch.float64) ** 2
    bars = torch.cumprod(1 - betas, dim=0)
    state |= {k: v.float() for k, v in {"betas": betas, "alphas_cumprod": bars, "alphas_cumprod_prev": bars.roll(1),
                                        "sqrt_alphas_cumprod": bars.sqrt(), "sqrt_one_minus_alphas_cumprod": (1 - bars).sqrt(),
                                        "log_one_minus_alphas_cumprod": (1 - bars).log(), "sqrt_recip_alphas_cumprod": bars**-0.5,
                                        "sqrt_recipm1_alphas_cumprod": (1 / bars - 1).sqrt(), "posterior_variance": betas,
                                        "posterior_log_variance_clipped": betas.log(), "posterior_mean_coef1": betas,
                                        "posterior_mean_coef2": betas}.items()}
    state["scale_factor"] = torch.tensor(0.7310586)
    net = randomise(empty(lambda: m.UNet(**unet)), seed + 1)
    state |= prefixed("model.diffusion_model.", net)
    averages = randomise(empty(lambda: m.UNet(**unet)), seed + 2)
    state |= {"model_ema." + ("diffusion_model." + k).replace(".", ""): v for k, v in averages.named_parameters()}
    net = randomise(m.FirstStage(**first), seed + 3, [("conv_out.weight", 0.4)])
    state |= prefixed("first_stage_model.", net)
    state |= prefixed("first_stage_model.encoder.", randomise(KlEncoder(**{k: v for k, v in first.items() if k != "embed"}), seed + 4))
    latent = net.post_quant_conv.in_channels
    state |= prefixed("first_stage_model.quant_conv.", randomise(nn.Conv2d(2 * latent, 2 * latent, 1), seed + 5))
    # The released encoder keeps its backbone under two names; the second branch of each block is kept small because
    # nothing normalises the sum.
    net = randomise(m.ResnetCondition(**condition), seed + 6, [("conv2.weight", 0.5)])
    own = prefixed("cond_stage_model.", net)
    state |= own
    backbone = dict(zip("014567", ("conv1", "bn1", "layer1", "layer2", "layer3", "layer4")))
    for key, value in own.items():
        parts = key.split(".")
        if parts[1] == "features":
            state[".".join(["cond_stage_model.resnet", backbone[parts[2]], *parts[3:]])] = value
    head = nn.Linear(net.features[7][1].conv2.out_channels, 1000)
    state |= prefixed("cond_stage_model.resnet.fc.", randomise(head, seed + 7))
    save({"epoch": 29, "global_step": 8820, "pytorch-lightning_version": "1.4.2", "state_dict": state, "optimizer_states": [],
          "lr_schedulers": []}, folder / "checkpoint.ckpt")
    torch.save({"gelslim_mean": torch.tensor([-2.73, -1.61, -2.22]), "gelslim_std": torch.tensor([17.5, 10.9, 14.7]),
                "bubbles_min": torch.tensor(-0.0188), "bubbles_max": torch.tensor(0.0392)}, folder / "training_stats.pt")
    torch.save({"gt_stats": (torch.tensor(0.0046), torch.tensor(0.0047)), "pred_stats": (0.0219, 0.0024)}, folder / "stats.pt")


def vqvae(folder, seed=0, **widths):
    """`checkpoint.pt` and `tools.pt`. Codes are drawn as the encoder's output is, so that many of them are chosen."""
    net = randomise(m.VqVae(**widths), seed + 11)
    with torch.no_grad():
        z = net.encoder(torch.randn(2, 3, 128, 128, generator=torch.Generator().manual_seed(seed)))
        mean, std = z.mean(dim=(0, 2, 3)), z.std(dim=(0, 2, 3))
        book = net.codebook["embedding"].weight
        book.mul_(std / book.std()).add_(mean)
    torch.save(net.state_dict(), folder / "checkpoint.pt")
    torch.save({"train_tools": ["pattern_01_2_lines_angle_1", "pattern_31_rod"], "test_tools": ["pattern_35"]}, folder / "tools.pt")


def mask(folder, seed=0, **widths):
    """The mask UNet's file; its name says how it was trained."""
    state = randomise(m.MaskUNet(**widths), seed + 21, [(".3.weight", 1.4), (".0.weight", 1.4)]).state_dict()
    torch.save({**state, "mask_values": [0, 255]}, folder / "masking_random.pth")


KINDS = {"diffusion": diffusion, "vqvae": vqvae, "mask": mask}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="gets a folder for each kind")
    parser.add_argument("--kind", choices=tuple(KINDS), action="append", help="only this one")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    for kind in args.kind or KINDS:
        folder = args.folder / kind
        folder.mkdir(parents=True, exist_ok=True)
        KINDS[kind](folder, args.seed)
        print(f"{folder}: {sum(f.stat().st_size for f in folder.iterdir()) / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
