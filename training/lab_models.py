"""The networks of the lab's released checkpoints, with the names their state dicts use.

Written from the published layout (LDM naming for the latent diffusion), so that a checkpoint loads without renaming.
All widths can be made small for tests; the defaults are the released ones.
"""

import torch
import torch.nn.functional as F
from torch import nn

from .models import time_embedding


def grouped(channels, groups, eps=1e-5):
    return nn.GroupNorm(groups, channels, eps=eps)


def sides(x):
    """Height and width as plain numbers: only the batch of an exported graph is dynamic."""
    return int(x.shape[2]), int(x.shape[3])


# --- the UNet ---------------------------------------------------------------------------------------------------------


class ResBlock(nn.Module):
    """Residual block with scale and shift by the time, at the same, half or double size."""

    def __init__(self, inp, out, time, groups, resize=None):
        super().__init__()
        self.resize = resize
        self.in_layers = nn.Sequential(grouped(inp, groups), nn.SiLU(), nn.Conv2d(inp, out, 3, padding=1))
        self.emb_layers = nn.Sequential(nn.SiLU(), nn.Linear(time, 2 * out))
        # The third is where the released network has a dropout of 0.
        self.out_layers = nn.Sequential(grouped(out, groups), nn.SiLU(), nn.Identity(), nn.Conv2d(out, out, 3, padding=1))
        self.skip_connection = nn.Conv2d(inp, out, 1) if inp != out else nn.Identity()

    def resized(self, x):
        if self.resize == "down":
            return F.avg_pool2d(x, 2)
        return F.interpolate(x, scale_factor=2.0, mode="nearest") if self.resize == "up" else x

    def forward(self, x, time):
        h = self.in_layers[2](self.resized(self.in_layers[1](self.in_layers[0](x))))
        scale, shift = self.emb_layers(time)[:, :, None, None].chunk(2, dim=1)
        h = self.out_layers[0](h) * (1 + scale) + shift
        return self.skip_connection(self.resized(x)) + self.out_layers[3](self.out_layers[1](h))


class Attention(nn.Module):
    """Self-attention whose projection holds q, k, v of one head, then of the next."""

    def __init__(self, channels, heads, groups):
        super().__init__()
        self.heads, self.channels = heads, channels
        self.norm = grouped(channels, groups)
        self.qkv = nn.Conv1d(channels, 3 * channels, 1)
        self.proj_out = nn.Conv1d(channels, channels, 1)

    def forward(self, x, time):
        height, width = sides(x)
        cells, depth = height * width, self.channels // self.heads
        qkv = self.qkv(self.norm(x).reshape(-1, self.channels, cells)).reshape(-1, 3 * depth, cells)
        q, k, v = qkv.split(depth, dim=1)
        weights = ((q * depth**-0.25).transpose(1, 2) @ (k * depth**-0.25)).softmax(dim=-1)
        out = (v @ weights.transpose(1, 2)).reshape(-1, self.channels, cells)
        return x + self.proj_out(out).reshape(-1, self.channels, height, width)


class First(nn.Conv2d):
    """The entering convolution, called as the other layers are."""

    def forward(self, x, time):
        return super().forward(x)


class UNet(nn.Module):
    """Noise prediction from latent (N,latent,H,W), step (N,) and condition (N,condition,H,W), concatenated."""

    def __init__(self, latent=4, condition=64, width=192, mult=(1, 2, 2, 4, 4), blocks=2, attention=(1, 2, 4, 8), heads=8, groups=32):
        super().__init__()
        self.width, time = width, 4 * width

        def layers(inp, out, level, resize=None):
            made = [ResBlock(inp, out, time, groups, resize)]
            if resize is None and 2**level in attention:
                made.append(Attention(out, heads, groups))
            return nn.ModuleList(made)

        self.time_embed = nn.Sequential(nn.Linear(width, time), nn.SiLU(), nn.Linear(time, time))
        self.input_blocks = nn.ModuleList([nn.ModuleList([First(latent + condition, width, 3, padding=1)])])
        skips, c = [width], width
        for level, m in enumerate(mult):
            for _ in range(blocks):
                self.input_blocks.append(layers(c, m * width, level))
                c = m * width
                skips.append(c)
            if level + 1 < len(mult):
                self.input_blocks.append(layers(c, c, level, "down"))
                skips.append(c)
        self.middle_block = nn.ModuleList([ResBlock(c, c, time, groups), Attention(c, heads, groups), ResBlock(c, c, time, groups)])
        self.output_blocks = nn.ModuleList()
        for level, m in reversed(list(enumerate(mult))):
            for i in range(blocks + 1):
                made = layers(c + skips.pop(), m * width, level)
                c = m * width
                if level and i == blocks:
                    made.extend(layers(c, c, level, "up"))
                self.output_blocks.append(made)
        self.out = nn.Sequential(grouped(c, groups), nn.SiLU(), nn.Conv2d(c, latent, 3, padding=1))

    def forward(self, latent, timestep, condition):
        time = self.time_embed(time_embedding(timestep, self.width))
        h, skips = torch.cat([latent, condition], dim=1), []
        for block in self.input_blocks:
            for layer in block:
                h = layer(h, time)
            skips.append(h)
        for layer in self.middle_block:
            h = layer(h, time)
        for block in self.output_blocks:
            h = torch.cat([h, skips.pop()], dim=1)
            for layer in block:
                h = layer(h, time)
        return self.out(h)


# --- the first stage --------------------------------------------------------------------------------------------------


class KlBlock(nn.Module):
    def __init__(self, inp, out, groups):
        super().__init__()
        self.norm1, self.conv1 = grouped(inp, groups, 1e-6), nn.Conv2d(inp, out, 3, padding=1)
        self.norm2, self.conv2 = grouped(out, groups, 1e-6), nn.Conv2d(out, out, 3, padding=1)
        if inp != out:
            self.nin_shortcut = nn.Conv2d(inp, out, 1)

    def forward(self, x):
        h = self.conv2(F.silu(self.norm2(self.conv1(F.silu(self.norm1(x))))))
        return h + (self.nin_shortcut(x) if hasattr(self, "nin_shortcut") else x)


class KlAttention(nn.Module):
    def __init__(self, channels, groups):
        super().__init__()
        self.channels = channels
        self.norm = grouped(channels, groups, 1e-6)
        self.q, self.k, self.v, self.proj_out = (nn.Conv2d(channels, channels, 1) for _ in range(4))

    def forward(self, x):
        height, width = sides(x)
        h = self.norm(x)
        q, k, v = (f(h).reshape(-1, self.channels, height * width) for f in (self.q, self.k, self.v))
        weights = (q.transpose(1, 2) @ k * self.channels**-0.5).softmax(dim=-1)
        return x + self.proj_out((v @ weights.transpose(1, 2)).reshape(-1, self.channels, height, width))


def kl_middle(channels, groups):
    return nn.ModuleDict({"block_1": KlBlock(channels, channels, groups), "attn_1": KlAttention(channels, groups),
                          "block_2": KlBlock(channels, channels, groups)})


class KlDecoder(nn.Module):
    """Latent to picture of eight times the side (with four levels)."""

    def __init__(self, latent=4, width=128, mult=(1, 2, 4, 4), blocks=2, channels=3, groups=32):
        super().__init__()
        c = mult[-1] * width
        self.conv_in = nn.Conv2d(latent, c, 3, padding=1)
        self.mid = kl_middle(c, groups)
        up = []
        for level, m in reversed(list(enumerate(mult))):
            made = nn.ModuleList()
            for _ in range(blocks + 1):
                made.append(KlBlock(c, m * width, groups))
                c = m * width
            up.insert(0, nn.ModuleDict({"block": made}))
            if level:
                up[0]["upsample"] = nn.ModuleDict({"conv": nn.Conv2d(c, c, 3, padding=1)})
        self.up = nn.ModuleList(up)
        self.norm_out, self.conv_out = grouped(c, groups, 1e-6), nn.Conv2d(c, channels, 3, padding=1)

    def forward(self, z):
        h = self.conv_in(z)
        for name in ("block_1", "attn_1", "block_2"):
            h = self.mid[name](h)
        for level in reversed(self.up):
            for block in level["block"]:
                h = block(h)
            if "upsample" in level:
                h = level["upsample"]["conv"](F.interpolate(h, scale_factor=2.0, mode="nearest"))
        return self.conv_out(F.silu(self.norm_out(h)))


class FirstStage(nn.Module):
    """What of the autoencoder is needed after sampling."""

    def __init__(self, embed=4, latent=4, **widths):
        super().__init__()
        self.post_quant_conv = nn.Conv2d(embed, latent, 1)
        self.decoder = KlDecoder(latent, **widths)

    def forward(self, latent):
        return self.decoder(self.post_quant_conv(latent))


# --- the condition encoder --------------------------------------------------------------------------------------------


class BasicBlock(nn.Module):
    def __init__(self, inp, out, stride):
        super().__init__()
        self.conv1, self.bn1 = nn.Conv2d(inp, out, 3, stride, 1, bias=False), nn.BatchNorm2d(out)
        self.conv2, self.bn2 = nn.Conv2d(out, out, 3, 1, 1, bias=False), nn.BatchNorm2d(out)
        if stride != 1 or inp != out:
            self.downsample = nn.Sequential(nn.Conv2d(inp, out, 1, stride, bias=False), nn.BatchNorm2d(out))

    def forward(self, x):
        h = self.bn2(self.conv2(F.relu(self.bn1(self.conv1(x)))))
        return F.relu(h + (self.downsample(x) if hasattr(self, "downsample") else x))


class ResnetCondition(nn.Module):
    """ResNet-18 without its head, then two transposed convolutions: (N,3,256,256) to (N,64,32,32)."""

    def __init__(self, width=64, out=64):
        super().__init__()
        w = [width, 2 * width, 4 * width, 8 * width]
        layers = [nn.Sequential(BasicBlock(a, b, 1 if b == width else 2), BasicBlock(b, b, 1)) for a, b in zip([width] + w, w)]
        self.features = nn.Sequential(nn.Conv2d(3, width, 7, 2, 3, bias=False), nn.BatchNorm2d(width), nn.ReLU(),
                                      nn.MaxPool2d(3, 2, 1), *layers)
        self.deconv1 = nn.ConvTranspose2d(w[3], w[2], 4, 2, 1)
        self.deconv2 = nn.ConvTranspose2d(w[2], out, 4, 2, 1)

    def forward(self, gelslim):
        return self.deconv2(F.relu(self.deconv1(F.relu(self.features(gelslim)))))


# --- the VQ-VAE -------------------------------------------------------------------------------------------------------


class VqBlock(nn.Module):
    """Its first ReLU works in place, so what is carried past the branch is relu(x)."""

    def __init__(self, width):
        super().__init__()
        self.block = nn.Sequential(nn.ReLU(), nn.Conv2d(width, width, 3, 1, 1), nn.ReLU(), nn.Conv2d(width, width, 1))

    def forward(self, x):
        return F.relu(x) + self.block(x)


class VqVae(nn.Module):
    """GelSlim image (N,3,128,128) to imprint (N,1,128,128), standardised, by way of (N,width,32,32) codes."""

    def __init__(self, width=256, codes=16385):
        super().__init__()
        self.encoder = nn.Sequential(nn.Conv2d(3, width, 4, 2, 1), nn.ReLU(), nn.Conv2d(width, width, 4, 2, 1),
                                     VqBlock(width), VqBlock(width))
        self.codebook = nn.ModuleDict({"embedding": nn.Embedding(codes, width)})
        self.decoder = nn.Sequential(VqBlock(width), VqBlock(width), nn.ReLU(), nn.ConvTranspose2d(width, width, 4, 2, 1),
                                     nn.ReLU(), nn.ConvTranspose2d(width, 1, 4, 2, 1))

    def codes(self, gelslim):
        """The nearest code of each cell."""
        book = self.codebook["embedding"].weight
        z = self.encoder(gelslim)
        height, width = sides(z)
        # |z|² is the same for all codes of a cell and left out.
        far = (book * book).sum(dim=1) - 2 * (z.permute(0, 2, 3, 1) @ book.t())
        return book[far.argmin(dim=3)].permute(0, 3, 1, 2).reshape(-1, book.shape[1], height, width)

    def forward(self, gelslim):
        return self.decoder(self.codes(gelslim))


# --- the mask UNet ----------------------------------------------------------------------------------------------------


class Double(nn.Module):
    def __init__(self, inp, out):
        super().__init__()
        self.double_conv = nn.Sequential(nn.Conv2d(inp, out, 3, padding=1, bias=False), nn.BatchNorm2d(out), nn.ReLU(),
                                         nn.Conv2d(out, out, 3, padding=1, bias=False), nn.BatchNorm2d(out), nn.ReLU())

    def forward(self, x):
        return self.double_conv(x)


class Up(nn.Module):
    def __init__(self, inp, out):
        super().__init__()
        self.up, self.conv = nn.ConvTranspose2d(inp, out, 2, 2), Double(inp, out)

    def forward(self, x, skip):
        x = self.up(x)
        (h, w), (height, width) = sides(x), sides(skip)
        left, top = (width - w) // 2, (height - h) // 2
        x = F.pad(x, (left, width - w - left, top, height - h - top))
        return self.conv(torch.cat([skip, x], dim=1))


class Single(nn.Module):
    def __init__(self, inp, out):
        super().__init__()
        self.conv = nn.Conv2d(inp, out, 1)

    def forward(self, x):
        return self.conv(x)


class MaskUNet(nn.Module):
    """Imprint (N,1,140,175), 0 to 1, to the logits of no contact and contact (N,2,140,175)."""

    def __init__(self, width=64):
        super().__init__()
        w = [width * 2**i for i in range(5)]
        self.inc = Double(1, w[0])
        for i in range(1, 5):
            setattr(self, f"down{i}", nn.ModuleDict({"maxpool_conv": nn.Sequential(nn.MaxPool2d(2), Double(w[i - 1], w[i]))}))
            setattr(self, f"up{i}", Up(w[5 - i], w[4 - i]))
        self.outc = Single(w[0], 2)

    def forward(self, imprint):
        skips = [self.inc(imprint)]
        for i in range(1, 5):
            skips.append(getattr(self, f"down{i}")["maxpool_conv"](skips[-1]))
        x = skips.pop()
        for i in range(1, 5):
            x = getattr(self, f"up{i}")(x, skips.pop())
        return self.outc(x)
