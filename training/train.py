"""Command line: `python -m training.train NAME --data DIR --out DIR --minutes M`.

NAME: autoencoder, generator (after the autoencoder), sampler (after both), mask; the baselines l1unet, visgel, vqvae; classifier.

Each command stops after the given minutes (or `--steps`), writes `NAME.pt` every two minutes and goes on from it
when started again with the same folder, on whatever device. One thread by default. `torchrun --nproc-per-node N -m
training.train ...` shares each step by N processes.
"""

import argparse
import sys

import torch

from . import baselines, latent, mask, sampler
from .place import PRECISIONS, keep_freed_memory

WHAT = {
    "autoencoder": latent.autoencoder,
    "generator": latent.generator,
    "sampler": sampler.sampler,
    "mask": mask.mask,
    "l1unet": baselines.l1unet,
    "visgel": baselines.visgel,
    "vqvae": baselines.vqvae,
    "classifier": baselines.classifier,
}


def parser():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=tuple(WHAT))
    parser.add_argument("--data", nargs="+", default=["training/data/train"], help="folders of shards")
    parser.add_argument("--out", default="training/runs/demo", help="folder for checkpoints and logs")
    parser.add_argument("--minutes", type=float, default=10.0, help="wall-clock budget, earlier starts counted in")
    parser.add_argument("--steps", type=int, default=0, help="number of steps instead of the minutes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--device", choices=("auto", "cpu", "cuda", "mps"), default="auto",
                        help="auto: the first GPU that PyTorch can use, else the processor")
    parser.add_argument("--precision", choices=("auto", *PRECISIONS), default="auto",
                        help="of the networks' inner values; auto: bfloat16 on a GPU that has it")
    parser.add_argument("--batch", type=int, help="samples of a part of a step (default: each network's own, larger on a GPU)")
    parser.add_argument("--resident", choices=("auto", "yes", "no"), default="auto",
                        help="the data is kept on the device; auto: where it fits into half of the free memory")
    parser.add_argument("--parts", type=int, default=1,
                        help="parts of a step, each of a batch, that a process takes one after the other")
    parser.add_argument("--from", dest="start", help="bundle whose weights to begin with (default: from scratch)")
    parser.add_argument("--rate", type=float, help="peak learning rate (default: each network's own, by the batch)")
    parser.add_argument("--fall", type=float, default=0.6, help="last share of the budget, over which the learning rate falls")
    parser.add_argument("--turned", type=float, default=0.6, help="share of pairs turned or mirrored")
    parser.add_argument("--no-rotation", dest="rotation", action="store_false", help="ablation: never turn a pair")
    parser.add_argument("--no-flip", dest="flip", action="store_false", help="ablation: never mirror a pair")
    parser.add_argument("--geometry", choices=("full", "padding", "cropping"), default="full",
                        help="ablation: the GelSlim image padded to the bubble's view, or the imprint cropped to the GelSlim's")
    parser.add_argument("--frame", choices=("window", "bubble"), default="window",
                        help="pictures drawn so that both fingers' GelSlim windows coincide, or where each bubble's camera has them")
    parser.add_argument("--condition-noise", type=float, default=0.0,
                        help="white noise on the GelSlim image, in its standard deviations")
    parser.add_argument("--predicted-by", help="mask: generator bundle on whose predictions to learn as well")
    parser.add_argument("--predicted", type=int, default=2000, help="mask: number of touches to predict")
    return parser


def run(words):
    """Trains as the command line would with these words."""
    args = parser().parse_args([str(word) for word in words])
    torch.manual_seed(args.seed)
    torch.set_flush_denormal(True)
    WHAT[args.what](args)


def main():
    keep_freed_memory()
    torch.set_num_threads(parser().parse_args().threads)
    run(sys.argv[1:])


if __name__ == "__main__":
    main()
