"""The paper's baselines and its tool classifier: networks and training.

L1 UNet and VisGel (a conditional GAN) draw the imprint (N,1,128,128) from the standardised GelSlim image
(N,3,128,128) in one go; the VQ-VAE passes through 16 x 16 quantised codes. The classifier names the tool of an
imprint. Sized for a CPU, not the sizes of the papers.
"""

from pathlib import Path

import torch
import torch.nn.functional as F
from torch import nn

from . import weights
from .models import ResBlock, Transformer, norm
from .run import Run, edges
from .touches import PAIR, Touches, batches, pair, picture

# In the order of the simulator's list, which is what a shard's `meta` counts by.
NAMES = (
    "pattern_01_2_lines_angle_1", "pattern_02_2_lines_angle_2", "pattern_03_2_lines_angle_3",
    "pattern_04_3_lines_angle_1", "pattern_06_5_lines_angle_1", "pattern_31_rod", "pattern_32", "pattern_33",
    "pattern_37", "pattern_05_3_lines_angle_2", "pattern_35", "pattern_36")
TOOLS = len(NAMES)


def normalised(gelslim):
    """The strength of the colours differs from sensor to sensor: divided out, as the condition encoder does."""
    return gelslim / torch.sqrt((gelslim * gelslim).mean(dim=(1, 2, 3), keepdim=True) + 0.02)


def down(a, b):
    return nn.Sequential(nn.Conv2d(a, b, 4, stride=2, padding=1), ResBlock(b, b))


def mixed(block, x):
    """A transformer over the cells of a feature map."""
    n, c, h, w = x.shape
    return block(x.flatten(2).transpose(1, 2)).transpose(1, 2).reshape(n, c, h, w)


class Drawer(nn.Module):
    """Features (N,channels,16,16) to the picture (N,1,128,128)."""

    def __init__(self, channels):
        super().__init__()
        self.body = nn.Sequential(
            nn.Conv2d(channels, 112, 3, padding=1), ResBlock(112, 112),
            nn.Conv2d(112, 64, 1), nn.Upsample(scale_factor=2.0, mode="nearest"), ResBlock(64, 64),
            nn.Conv2d(64, 32, 1), nn.Upsample(scale_factor=2.0, mode="nearest"), ResBlock(32, 32),
            norm(32), nn.SiLU(), nn.Conv2d(32, 16, 3, padding=1), nn.Upsample(scale_factor=2.0, mode="nearest"),
            nn.Conv2d(16, 16, 3, padding=1), nn.SiLU(), nn.Conv2d(16, 1, 3, padding=1))

    def forward(self, x):
        return self.body(x)


class L1UNet(nn.Module):
    """UNet over 64, 32, 16 and 8 cells; attention at the bottom. Also VisGel's generator."""

    def __init__(self, widths=(32, 64, 112, 160)):
        super().__init__()
        self.enter = nn.Conv2d(3, widths[0], 8, stride=2, padding=3)
        self.down = nn.ModuleList(down(a, b) for a, b in zip(widths, widths[1:]))
        self.mix = nn.ModuleList(Transformer(widths[-1], 5) for _ in range(2))
        self.place = nn.Parameter(0.02 * torch.randn(1, widths[-1], 8, 8))
        self.lift = nn.ModuleList(nn.Conv2d(b, a, 1) for a, b in zip(widths, widths[1:]))
        self.up = nn.ModuleList(ResBlock(2 * a, a) for a in widths[:-1])
        self.out = nn.Sequential(norm(widths[0]), nn.SiLU(), nn.Conv2d(widths[0], 16, 3, padding=1),
                                 nn.Upsample(scale_factor=2.0, mode="nearest"), nn.SiLU(), nn.Conv2d(16, 1, 3, padding=1))

    def forward(self, gelslim):
        skips = [self.enter(normalised(gelslim))]
        for block in self.down:
            skips.append(block(skips[-1]))
        x = skips.pop() + self.place
        for block in self.mix:
            x = mixed(block, x)
        for lift, up, skip in zip(reversed(self.lift), reversed(self.up), reversed(skips)):
            x = up(torch.cat([F.interpolate(lift(x), scale_factor=2.0, mode="nearest"), skip], dim=1))
        return self.out(x)


class PatchCritic(nn.Module):
    """Real or drawn, per patch, given the GelSlim image beside the imprint."""

    def __init__(self):
        super().__init__()
        self.body = nn.Sequential(
            nn.Conv2d(4, 24, 4, stride=2, padding=1), nn.LeakyReLU(0.2),
            nn.Conv2d(24, 48, 4, stride=2, padding=1), norm(48), nn.LeakyReLU(0.2),
            nn.Conv2d(48, 96, 4, stride=2, padding=1), norm(96), nn.LeakyReLU(0.2), nn.Conv2d(96, 1, 4, padding=1))

    def forward(self, gelslim, image):
        return self.body(torch.cat([normalised(gelslim), image], dim=1))


class VqVae(nn.Module):
    """Encoder, nearest code of a learnt book, decoder. `forward` returns (picture, features, codes)."""

    def __init__(self, codes=512, dim=64):
        super().__init__()
        self.encoder = nn.Sequential(nn.Conv2d(3, 48, 8, stride=4, padding=2), ResBlock(48, 48), down(48, 96), ResBlock(96, 96))
        self.place = nn.Parameter(0.02 * torch.randn(1, 96, 16, 16))
        self.mix = nn.ModuleList(Transformer(96, 4) for _ in range(2))
        self.narrow = nn.Conv2d(96, dim, 1)
        self.book = nn.Parameter(torch.randn(codes, dim) * 0.5)
        self.decoder = Drawer(dim)

    def features(self, gelslim):
        x = self.encoder(normalised(gelslim)) + self.place
        for block in self.mix:
            x = mixed(block, x)
        return self.narrow(x)

    def quantise(self, z):
        n, c, h, w = z.shape
        flat = z.permute(0, 2, 3, 1).reshape(-1, c)
        distance = (self.book * self.book).sum(dim=1) - 2 * flat @ self.book.t()
        chosen = self.book[distance.argmin(dim=1)]
        return chosen.reshape(n, h, w, c).permute(0, 3, 1, 2)

    def forward(self, gelslim):
        z = self.features(gelslim)
        q = self.quantise(z)
        return self.decoder(z + (q - z).detach()), z, q


class Classifier(nn.Module):
    """Which of the lab's twelve tools made the imprint (N,1,128,128): logits (N,12)."""

    def __init__(self):
        super().__init__()
        self.body = nn.Sequential(nn.Conv2d(1, 24, 8, stride=4, padding=2), ResBlock(24, 24), down(24, 48), down(48, 96),
                                  norm(96), nn.SiLU(), nn.Flatten(), nn.Linear(96 * 64, TOOLS))

    def forward(self, image):
        return self.body(image)


def pairs(run):
    """Batches of (GelSlim, clean imprint) until the budget is spent."""
    for batch in batches(run, Touches(run.args, run.place, PAIR), pair):
        yield batch["gelslim"], batch["clean"]


def l1unet(args):
    net = L1UNet()
    run = Run(args, "l1unet", {"l1unet": net}, (16, 1e-3), (256, 1e-3))
    for gelslim, clean in pairs(run):
        with run.place.autocast():
            loss = (net(gelslim).float() - clean).abs().mean()
        run.descend(loss, len(gelslim), {"l1": loss})
    run.end()


def visgel(args):
    """L1 and a least-squares GAN; the critic has its own optimiser, and a step in each part."""
    net, critic = L1UNet(), PatchCritic()
    optimiser = torch.optim.AdamW(critic.parameters(), lr=3e-4, betas=(0.5, 0.99))
    critic.requires_grad_(False)
    run = Run(args, "visgel", {"visgel": net, "critic": critic}, (16, 7e-4), (256, 7e-4), others={"critic": optimiser})
    for gelslim, clean in pairs(run):
        with run.place.autocast():
            drawn = net(gelslim).float()
        critic.requires_grad_(True)
        real, fake = critic(gelslim, clean), critic(gelslim, drawn.detach())
        judged = ((real - 1) ** 2).mean() + (fake**2).mean()
        optimiser.zero_grad()
        judged.backward()
        run.place.average(critic.parameters())
        optimiser.step()
        critic.requires_grad_(False)
        l1, fooled = (drawn - clean).abs().mean(), ((critic(gelslim, drawn) - 1) ** 2).mean()
        run.descend(20 * l1 + 0.1 * fooled, len(gelslim), {"l1": l1, "critic": judged})
    run.end()


def vqvae(args):
    net = VqVae()
    run = Run(args, "vqvae", {"vqvae": net}, (16, 1e-3), (256, 1e-3))
    for gelslim, clean in pairs(run):
        with run.place.autocast():
            drawn, z, q = net(gelslim)
        l1, edge = (drawn.float() - clean).abs().mean(), edges(drawn.float(), clean)
        book = F.mse_loss(q, z.detach()) + 0.25 * F.mse_loss(z, q.detach())
        stepped = run.descend(10 * l1 + 10 * edge + book, len(gelslim), {"l1": l1, "edge": edge, "book": book})
        if stepped and run.step % 100 == 0 and not run.fallen():
            revive(net, z.detach().float())
            run.place.agree([net.book])
    run.end()


@torch.no_grad()
def revive(net, z):
    """Moves codes that no feature of the batch chose to random features."""
    flat = z.permute(0, 2, 3, 1).reshape(-1, z.shape[1])
    distance = (net.book * net.book).sum(dim=1) - 2 * flat @ net.book.t()
    unused = torch.ones(len(net.book), dtype=torch.bool, device=z.device)
    unused[distance.argmin(dim=1).unique()] = False
    net.book[unused] = flat[torch.randint(len(flat), (int(unused.sum()),)).to(z.device)]


def named_imprints(touches, places, args):
    batch = touches.get(places)
    name = "imprint" if torch.rand(1) < 0.5 else "clean"
    plain = torch.zeros(len(places), dtype=torch.int64, device=touches.place.device)
    return {"image": picture(batch, name, plain, args), "tool": batch["tool"]}


def classifier(args):
    # A real imprint is named where the bubble's camera has it.
    args.frame, net = "bubble", Classifier()
    if args.start:
        weights.load(net, Path(args.start) / "tool_classifier.onnx", "net.")
    run = Run(args, "classifier", {"classifier": net}, (32, 1e-3), (256, 1e-3))
    touches = Touches(args, run.place, ("imprint_picture", "clean_picture", "tool"), usable=lambda shards, n: shards.meta[n, 5] >= 0)
    for batch in batches(run, touches, named_imprints):
        with run.place.autocast():
            loss = F.cross_entropy(net(batch["image"]).float(), batch["tool"])
        run.descend(loss, len(batch["tool"]), {"cross": loss})
    run.end()
