"""The networks of `lab_models` against diffusers' own, where diffusers is installed: `python -m training.lab_diffusers`.

diffusers converts the autoencoder itself. It has no conversion for this UNet (condition by concatenation, resizing in
residual blocks, eight heads at every width), but its blocks can be put together to the same function.
Tiny widths unless `--full`.
"""

import argparse

import torch
from diffusers import AutoencoderKL, UNet2DModel
from diffusers.loaders.single_file_utils import convert_ldm_vae_checkpoint

from . import lab_models as m
from . import lab_random
from .lab_checkpoint import empty


def autoencoder(**widths):
    """Largest difference of the decoded picture, and its deviation."""
    net = lab_random.randomise(empty(lambda: m.FirstStage(**widths)), 3)
    encoder = lab_random.randomise(empty(lambda: lab_random.KlEncoder(**widths)), 4)
    latent, decoder = net.post_quant_conv.in_channels, net.decoder
    quant = lab_random.randomise(torch.nn.Conv2d(2 * latent, 2 * latent, 1), 5)
    state = {"first_stage_model." + k: v for part in (net.state_dict(), lab_random.prefixed("encoder.", encoder),
                                                      lab_random.prefixed("quant_conv.", quant)) for k, v in part.items()}
    outs = [level["block"][-1].conv2.out_channels for level in decoder.up]
    config = {"sample_size": 256, "in_channels": 3, "out_channels": 3, "block_out_channels": outs, "latent_channels": latent,
              "down_block_types": ["DownEncoderBlock2D"] * len(outs), "up_block_types": ["UpDecoderBlock2D"] * len(outs),
              "layers_per_block": 2, "norm_num_groups": decoder.norm_out.num_groups}
    other = AutoencoderKL(**config)
    other.load_state_dict(convert_ldm_vae_checkpoint(state, config))
    z = torch.randn(1, latent, 32, 32, generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        ours, theirs = net(z), other.eval().decode(z).sample
    return (ours - theirs).abs().max().item(), ours.std().item()


def put(target, source, heads):
    """Copies one of our layers into its counterpart."""
    if isinstance(source, m.Attention):
        c = source.channels
        for i, name in enumerate(("to_q", "to_k", "to_v")):
            part = {k: v.reshape(heads, 3, c // heads, *v.shape[1:])[:, i].reshape(c, *v.shape[1:]) for k, v in source.qkv.state_dict().items()}
            getattr(target, name).load_state_dict({"weight": part["weight"][..., 0], "bias": part["bias"]})
        target.group_norm.load_state_dict(source.norm.state_dict())
        out = source.proj_out.state_dict()
        target.to_out[0].load_state_dict({"weight": out["weight"][..., 0], "bias": out["bias"]})
        # diffusers fixes the width of a head, this network their number.
        target.heads, target.scale = heads, (c // heads) ** -0.5
        return
    pairs = {"norm1": source.in_layers[0], "conv1": source.in_layers[2], "time_emb_proj": source.emb_layers[1],
             "norm2": source.out_layers[0], "conv2": source.out_layers[3]}
    for name, layer in pairs.items():
        getattr(target, name).load_state_dict(layer.state_dict())
    assert (target.conv_shortcut is None) == isinstance(source.skip_connection, torch.nn.Identity)
    if target.conv_shortcut is not None:
        target.conv_shortcut.load_state_dict(source.skip_connection.state_dict())


def unet(latent=4, condition=64, width=192, mult=(1, 2, 2, 4, 4), heads=8, groups=32):
    """Largest difference of the predicted noise, and its deviation."""
    net = lab_random.randomise(empty(lambda: m.UNet(latent, condition, width, mult, heads=heads, groups=groups)), 2)
    down = ["AttnDownBlock2D"] * (len(mult) - 1) + ["ResnetDownsampleBlock2D"]
    other = UNet2DModel(
        in_channels=latent + condition, out_channels=latent, block_out_channels=[k * width for k in mult], layers_per_block=2,
        down_block_types=down, up_block_types=[n.replace("Downsample", "Upsample").replace("Down", "Up") for n in reversed(down)],
        downsample_type="resnet", upsample_type="resnet", attention_head_dim=width // heads, norm_num_groups=groups, attn_norm_num_groups=groups,
        norm_eps=1e-5, resnet_time_scale_shift="scale_shift", flip_sin_to_cos=True, freq_shift=0)
    other.time_embedding.linear_1.load_state_dict(net.time_embed[0].state_dict())
    other.time_embedding.linear_2.load_state_dict(net.time_embed[2].state_dict())
    other.conv_in.load_state_dict(net.input_blocks[0][0].state_dict())
    other.conv_norm_out.load_state_dict(net.out[0].state_dict())
    other.conv_out.load_state_dict(net.out[2].state_dict())

    def parts(block, resizers):
        """diffusers' layers of one level in the order of ours."""
        for i, resnet in enumerate(block.resnets):
            yield resnet
            if getattr(block, "attentions", None):
                yield block.attentions[i]
        yield from (getattr(block, resizers) or [])

    theirs = [p for block in other.down_blocks for p in parts(block, "downsamplers")]
    theirs += [other.mid_block.resnets[0], other.mid_block.attentions[0], other.mid_block.resnets[1]]
    theirs += [p for block in other.up_blocks for p in parts(block, "upsamplers")]
    ours = [layer for block in list(net.input_blocks)[1:] for layer in block] + list(net.middle_block)
    ours += [layer for block in net.output_blocks for layer in block]
    assert len(ours) == len(theirs), (len(ours), len(theirs))
    for target, source in zip(theirs, ours):
        put(target, source, heads)
    noise = torch.Generator().manual_seed(1)
    x, c = torch.randn(2, latent, 32, 32, generator=noise), torch.randn(2, condition, 32, 32, generator=noise)
    t = torch.tensor([1, 801])
    with torch.no_grad():
        found, expected = net(x, t, c), other.eval()(torch.cat([x, c], dim=1), t).sample
    return (found - expected).abs().max().item(), found.std().item()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="the released widths (8 GB of memory, minutes)")
    full = parser.parse_args().full
    for name, found in (("autoencoder", autoencoder(**({} if full else {"width": 8, "groups": 4}))),
                        ("unet", unet(**({} if full else {"condition": 8, "width": 16, "heads": 2, "groups": 4})))):
        print(f"{name}: largest difference {found[0]:.2g}, deviation of the output {found[1]:.2g}", flush=True)
        if not found[0] < 1e-4 * found[1]:
            raise SystemExit(f"{name}: our network is not diffusers'")


if __name__ == "__main__":
    main()
