"""The networks. Only plain operators, so that every ONNX engine can run the exported graphs.

Shapes: GelSlim difference (N,3,128,128), standardised; imprint (N,1,128,128) in [-1,1]; latent (N,4,16,16);
condition (N,64,16,16); mask UNet (N,1,140,175) in [0,1] to (N,2,140,175) logits.
"""

import math

import torch
import torch.nn.functional as F
from torch import nn

from . import diffusion

LATENT = 4
CONDITION = 64


def norm(channels):
    return nn.GroupNorm(8, channels)


class ResBlock(nn.Module):
    """GroupNorm, SiLU, conv, twice; an optional embedding (N,E) scales and shifts the second norm."""

    def __init__(self, cin, cout, embedding=0):
        super().__init__()
        self.norm1, self.conv1 = norm(cin), nn.Conv2d(cin, cout, 3, padding=1)
        self.norm2, self.conv2 = norm(cout), nn.Conv2d(cout, cout, 3, padding=1)
        self.skip = nn.Conv2d(cin, cout, 1) if cin != cout else nn.Identity()
        self.embed = nn.Linear(embedding, 2 * cout) if embedding else None
        nn.init.zeros_(self.conv2.weight)
        nn.init.zeros_(self.conv2.bias)

    def forward(self, x, e=None):
        h = self.norm2(self.conv1(F.silu(self.norm1(x))))
        if self.embed is not None:
            scale, shift = self.embed(e)[:, :, None, None].chunk(2, dim=1)
            h = h * (1 + scale) + shift
        return self.skip(x) + self.conv2(F.silu(h))


class Attention(nn.Module):
    """Multi-head attention of tokens (N,T,D) on tokens (N,S,D), written with plain matrix products."""

    def __init__(self, dim, heads):
        super().__init__()
        self.heads = heads
        self.q, self.kv, self.out = nn.Linear(dim, dim), nn.Linear(dim, 2 * dim), nn.Linear(dim, dim)

    def forward(self, x, source):
        def split(t):
            return t.reshape(t.shape[0], t.shape[1], self.heads, -1).transpose(1, 2)

        k, v = self.kv(source).chunk(2, dim=-1)
        q, k, v = split(self.q(x)), split(k), split(v)
        weights = torch.softmax(q @ k.transpose(-1, -2) / math.sqrt(q.shape[-1]), dim=-1)
        return self.out((weights @ v).transpose(1, 2).reshape(x.shape))


class Transformer(nn.Module):
    """Pre-norm block: attention (to itself or to a source), then a two-layer perceptron."""

    def __init__(self, dim, heads):
        super().__init__()
        self.norm1, self.norm2 = nn.LayerNorm(dim), nn.LayerNorm(dim)
        self.attention = Attention(dim, heads)
        self.mlp = nn.Sequential(nn.Linear(dim, 2 * dim), nn.SiLU(), nn.Linear(2 * dim, dim))

    def forward(self, x, source=None):
        h = self.norm1(x)
        x = x + self.attention(h, h if source is None else source)
        return x + self.mlp(self.norm2(x))


def sinusoids(x, y, dim):
    """Multi-scale sinusoids (1,T,dim) of places (T,) in bubble pixels."""
    rates = 2 * math.pi / torch.logspace(math.log10(12), math.log10(500), dim // 4)
    angles = torch.cat([x[:, None] * rates, y[:, None] * rates], dim=1)
    return torch.cat([angles.sin(), angles.cos()], dim=1)[None]


def raster(n, x0, x1, y0, y1):
    """Centres (n*n,), (n*n,) of an n x n raster over a rectangle, row by row."""
    t = (torch.arange(n) + 0.5) / n
    y, x = torch.meshgrid(y0 + t * (y1 - y0), x0 + t * (x1 - x0), indexing="ij")
    return x.flatten(), y.flatten()


# The bubble's view and what the GelSlim sees of it, in pixels of the rotated bubble image (data.FRAME_PX): x, then y.
VIEW, SEEN = (0.0, 175.0, 0.0, 140.0), (83.5, 126.0, 50.4, 82.4)


class ConditionEncoder(nn.Module):
    """GelSlim to a condition on the latent's grid.

    The GelSlim sees about a sixth of what the bubble sees, magnified four times: its pixels do not lie over the
    bubble's. So a convolutional trunk makes 64 tokens, attention mixes them, and one learnt query per latent cell
    reads from them. The first four channels are a direct estimate of the latent, supervised in training.
    `geometry` ("full", "padding", "cropping") says which of both the two pictures are of.
    """

    def __init__(self, dim=160, depth=3, geometry="full"):
        super().__init__()
        # Four GelSlim pixels of 128 are one bubble pixel of 128, so the trunk works from a quarter of the size.
        self.trunk = nn.Sequential(
            nn.Conv2d(3, 48, 8, stride=4, padding=2), ResBlock(48, 48),
            nn.Conv2d(48, 96, 3, stride=2, padding=1), ResBlock(96, 96),
            nn.Conv2d(96, dim, 3, stride=2, padding=1), ResBlock(dim, dim), norm(dim))
        # Learnt from this start, so that a cell first reads from what lies under it.
        self.place = nn.Parameter(sinusoids(*raster(8, *(VIEW if geometry == "padding" else SEEN)), dim))
        self.query = nn.Parameter(sinusoids(*raster(16, *(SEEN if geometry == "cropping" else VIEW)), dim))
        self.mix = nn.ModuleList(Transformer(dim, 5) for _ in range(depth))
        self.read = Transformer(dim, 5)
        with torch.no_grad():
            self.read.attention.kv.weight[:dim] = self.read.attention.q.weight
        self.norm = nn.LayerNorm(dim)
        self.narrow = nn.Linear(dim, CONDITION)
        self.refine = ResBlock(CONDITION, CONDITION)
        self.out = nn.Conv2d(CONDITION, CONDITION, 1)

    def forward(self, gelslim):
        # The strength of the colours differs from sensor to sensor and is lost in image folders: divide it out.
        power = (gelslim * gelslim).mean(dim=(1, 2, 3), keepdim=True)
        x = self.trunk(gelslim / torch.sqrt(power + 0.02))
        n = x.shape[0]
        tokens = x.flatten(2).transpose(1, 2) + self.place
        for block in self.mix:
            tokens = block(tokens)
        tokens = self.norm(tokens)
        cells = self.read(self.query.expand(n, -1, -1), tokens)
        return self.out(self.refine(self.narrow(cells).transpose(1, 2).reshape(n, -1, 16, 16)))


def time_embedding(t, dim=96):
    """Sinusoids of the training step index t (N,), int64 or float32."""
    rates = torch.exp(torch.arange(dim // 2, dtype=torch.float32, device=t.device) * (-math.log(10000.0) / (dim // 2)))
    angles = t.float()[:, None] * rates[None]
    return torch.cat([torch.cos(angles), torch.sin(angles)], dim=1)


# Variance assumed around the condition encoder's own estimate of the latent.
ESTIMATE_VARIANCE = 0.05


def base_weights():
    """Weights (1000,2) of the noisy latent and of the encoder's estimate in the best linear prediction of v.

    With the latent drawn from N(estimate, variance), its posterior mean is estimate + k (x - a estimate).
    """
    bars = torch.from_numpy(diffusion.alpha_bar())
    a, s = bars.sqrt(), (1 - bars).sqrt()
    k = a * ESTIMATE_VARIANCE / (a * a * ESTIMATE_VARIANCE + s * s)
    return torch.stack([(a - k) / s, (k * a - 1) / s], dim=1).float()


class Denoiser(nn.Module):
    """UNet on the latent (16, 8, 4 cells wide), conditioned by concatenation.

    Predicts v as a correction of what follows from the condition's estimate of the latent alone.
    """

    def __init__(self, widths=(96, 144, 160), embedding=160):
        super().__init__()
        a, b, c = widths
        e = embedding
        self.time = nn.Sequential(nn.Linear(96, e), nn.SiLU(), nn.Linear(e, e), nn.SiLU())
        self.enter = nn.Conv2d(LATENT + CONDITION, a, 3, padding=1)
        self.d1, self.down1 = ResBlock(a, a, e), nn.Conv2d(a, b, 3, stride=2, padding=1)
        self.d2, self.down2 = ResBlock(b, b, e), nn.Conv2d(b, c, 3, stride=2, padding=1)
        self.m1, self.m2 = ResBlock(c, c, e), ResBlock(c, c, e)
        self.mix = Transformer(c, 5)
        self.up2, self.u2 = nn.Conv2d(c, b, 1), ResBlock(2 * b, b, e)
        self.up1, self.u1 = nn.Conv2d(b, a, 1), ResBlock(2 * a, a, e)
        self.norm, self.out = norm(a), nn.Conv2d(a, LATENT, 3, padding=1)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)
        self.register_buffer("base", base_weights(), persistent=False)

    def forward(self, latent, timestep, condition):
        weights = self.base[timestep][:, :, None, None]
        base = weights[:, :1] * latent + weights[:, 1:] * condition[:, :LATENT]
        e = self.time(time_embedding(timestep))
        h1 = self.d1(self.enter(torch.cat([latent, condition], dim=1)), e)
        h2 = self.d2(self.down1(h1), e)
        h = self.m1(self.down2(h2), e)
        n, c = h.shape[:2]
        h = h + self.mix(h.flatten(2).transpose(1, 2)).transpose(1, 2).reshape(n, c, 4, 4)
        h = self.m2(h, e)
        h = self.u2(torch.cat([F.interpolate(self.up2(h), scale_factor=2.0, mode="nearest"), h2], dim=1), e)
        h = self.u1(torch.cat([F.interpolate(self.up1(h), scale_factor=2.0, mode="nearest"), h1], dim=1), e)
        return base + self.out(F.silu(self.norm(h)))


class Autoencoder(nn.Module):
    """KL autoencoder of the imprint. The decoder draws the membrane without camera noise."""

    def __init__(self):
        super().__init__()
        self.encoder = nn.Sequential(
            nn.Conv2d(1, 48, 8, stride=4, padding=2), ResBlock(48, 48),
            nn.Conv2d(48, 96, 3, stride=2, padding=1), ResBlock(96, 96), ResBlock(96, 96),
            norm(96), nn.SiLU(), nn.Conv2d(96, 2 * LATENT, 1))
        self.decoder = nn.Sequential(
            nn.Conv2d(LATENT, 112, 3, padding=1), ResBlock(112, 112), ResBlock(112, 112),
            nn.Conv2d(112, 64, 1), nn.Upsample(scale_factor=2.0, mode="nearest"), ResBlock(64, 64), ResBlock(64, 64),
            nn.Conv2d(64, 32, 1), nn.Upsample(scale_factor=2.0, mode="nearest"), ResBlock(32, 32),
            norm(32), nn.SiLU(), nn.Conv2d(32, 16, 3, padding=1),
            nn.Upsample(scale_factor=2.0, mode="nearest"), nn.Conv2d(16, 16, 3, padding=1), nn.SiLU(),
            nn.Conv2d(16, 1, 3, padding=1))

    def encode(self, image):
        mean, log_var = self.encoder(image).float().chunk(2, dim=1)
        return mean, log_var.clamp(-12, 6)

    def decode(self, latent):
        return self.decoder(latent)


class Decoder(nn.Module):
    """The autoencoder's decoder, with the whitening of the latents folded in."""

    def __init__(self, decoder, mean, std):
        super().__init__()
        self.decoder = decoder
        self.register_buffer("mean", mean)
        self.register_buffer("std", std)

    def forward(self, latent):
        return self.decoder(latent * self.std + self.mean)


def generator(geometry="full"):
    """Condition encoder, denoiser and decoder as a bundle has them."""
    decoder = Decoder(Autoencoder().decoder, torch.zeros(1, LATENT, 16, 16), torch.ones(1, LATENT, 1, 1))
    return ConditionEncoder(geometry=geometry), Denoiser(), decoder


class MaskUNet(nn.Module):
    """conv-BN-ReLU UNet, three levels down, padded to 144 x 176 inside."""

    def __init__(self, base=14):
        super().__init__()
        w = [base, 2 * base, 4 * base, 8 * base]

        def double(a, b):
            return nn.Sequential(nn.Conv2d(a, b, 3, padding=1, bias=False), nn.BatchNorm2d(b), nn.ReLU(),
                                 nn.Conv2d(b, b, 3, padding=1, bias=False), nn.BatchNorm2d(b), nn.ReLU())

        self.down = nn.ModuleList(double(a, b) for a, b in zip([1] + w[:3], w))
        self.lift = nn.ModuleList(nn.Conv2d(b, a, 1) for a, b in zip(w, w[1:]))
        self.up = nn.ModuleList(double(2 * a, a) for a in w[:3])
        self.out = nn.Conv2d(base, 2, 1)

    def forward(self, imprint):
        x = F.pad(imprint - 0.5, (0, 1, 2, 2))
        skips = []
        for i, block in enumerate(self.down):
            x = block(x if i == 0 else F.max_pool2d(x, 2))
            skips.append(x)
        for i in (2, 1, 0):
            x = F.interpolate(self.lift[i](x), scale_factor=2.0, mode="nearest")
            x = self.up[i](torch.cat([x, skips[i]], dim=1))
        return self.out(x)[:, :, 2:142, :175]
