"""Training of the generator as it is used: the sampler unrolled, condition encoder, denoiser and decoder together.

The diffusion's loss says how well noise is told from latents; what is used is the picture after one or two steps. So from zeros
or from noise one step is taken, or two, of the schedule that the bundle's manifest names (`ddpm`, two steps), and the decoded
picture is compared with the noise-free imprint itself.
"""

from pathlib import Path

import torch
import torch.nn.functional as F

from . import diffusion, export, models
from .run import Run
from .touches import PAIR, Touches, batches, pair

# Share of a batch that takes the second step.
SECOND = 0.3


def loss(drawn, clean):
    """Of pictures in [-1,1], as pictures in 0..1: squares, absolute differences, and those of edges three pixels wide."""
    difference = (drawn - clean) / 2
    wide = F.avg_pool2d(difference, 3, stride=1)
    square, l1 = (difference**2).mean(), difference.abs().mean()
    edge = wide.diff(dim=2).abs().mean() + wide.diff(dim=3).abs().mean()
    return 20 * square + l1 + 0.5 * edge, {"square": square, "l1": l1, "edge": edge}


def unrolled(denoiser, condition, of_two):
    """Latents as the two-step sampler leads to them: after the second step those of the first `of_two`, else after the first."""
    x = torch.randn(len(condition), models.LATENT, 16, 16, device=condition.device)
    x = x * (torch.rand(len(x), 1, 1, 1, device=x.device) < 0.5)
    first, second = diffusion.spaced(2, eta=1.0)

    def predicted(x, t):
        return denoiser(x, torch.full((len(x),), t, device=x.device), condition[:len(x)]).float()

    z, after = first.take(x, predicted(x, first.t))
    return z if not of_two else torch.cat([second.take(after[:of_two], predicted(after[:of_two], second.t))[0], z[of_two:]])


def sampler(args):
    encoder, denoiser, decoder = models.generator(args.geometry)
    nets = {"encoder": encoder, "denoiser": denoiser, "decoder": decoder}
    if not (Path(args.out) / "sampler.pt").exists():
        begun = export.bundle_nets(args.start) if args.start else export.generator_nets(args.out)[0]
        for net, known in zip(nets.values(), begun):
            net.load_state_dict(known.state_dict())
    run = Run(args, "sampler", nets, (16, 1e-4), (256, 3e-4), averaged=tuple(nets))
    touches = Touches(args, run.place, PAIR)
    for batch in batches(run, touches, pair):
        clean = batch["clean"]
        of_two = int(SECOND * len(clean) + torch.rand(1))
        with run.place.autocast():
            drawn = decoder(unrolled(denoiser, encoder(batch["gelslim"]), of_two)).float()
        total, figures = loss(drawn, clean)
        run.descend(total, len(clean), figures)
    run.end()
