"""Command line: `python -m training.realism --real DIR... --simulated DIR...`: how alike real and simulated touches look.

Both are folders of shards (`touch2touch-bench training-data`), best of the same tools. Prints a table of statistics of imprints and
GelSlim difference images; what differs by more than a fifth is marked. Only shape and noise are compared, not where the tool is.
"""

import argparse

import numpy as np
import torch
import torch.nn.functional as F

from . import data

# Pixels of a GelSlim difference image and of an imprint in a millimetre.
GELSLIM_PX_PER_MM, BUBBLE_PX_PER_MM = 128 / 13.5, 2.36
TOLERANCE = 0.2


def smoothed(images, sigma):
    """Images (N,1,H,W) blurred by a Gaussian of `sigma` pixels."""
    reach = int(3 * sigma + 1)
    line = torch.exp(-0.5 * (torch.arange(-reach, reach + 1) / sigma) ** 2)
    line = (line / line.sum()).to(images)
    wide = F.pad(images, (reach, reach, reach, reach), mode="reflect")
    return F.conv2d(F.conv2d(wide, line[None, None, None]), line[None, None, :, None])


def slopes(images):
    """Magnitude of the gradient (N,H-2,W-2) by central differences, per pixel."""
    across, down = images[:, 0, 1:-1, 2:] - images[:, 0, 1:-1, :-2], images[:, 0, 2:, 1:-1] - images[:, 0, :-2, 1:-1]
    return torch.hypot(across, down) / 2


def autocorrelation(images):
    """Mean autocorrelation of images (N,1,H,W), 1 at the middle."""
    power = torch.fft.fft2(images - images.mean(dim=(2, 3), keepdim=True)).abs() ** 2
    found = torch.fft.fftshift(torch.fft.ifft2(power).real, dim=(2, 3)).mean(dim=(0, 1))
    return found / found.max()


def by_radius(picture):
    """Mean of a picture (H,W) over rings of whole pixels around its middle."""
    height, width = picture.shape
    y, x = torch.meshgrid(torch.arange(height) - height // 2, torch.arange(width) - width // 2, indexing="ij")
    ring = torch.hypot(x.float(), y.float()).round().long().flatten()
    return torch.bincount(ring, picture.flatten().double()) / torch.bincount(ring)


def falls_below(curve, level):
    """Where a curve that begins at 1 first falls below a level, in its steps, linearly between them."""
    after = int((curve < level).nonzero()[0])
    above, below = float(curve[after - 1]), float(curve[after])
    return after - 1 + (above - level) / (above - below)


def bands(images, px_per_mm):
    """Deviation of images (N,1,H,W) by octaves of wavelength, those shorter than two pixels left out: {(mm, mm): deviation}."""
    height, width = images.shape[2:]
    window = torch.hann_window(height)[:, None] * torch.hann_window(width)
    flat = (images - images.mean(dim=(2, 3), keepdim=True)) * window / window.square().mean().sqrt()
    power = torch.fft.fft2(flat).abs().square().mean(dim=(0, 1)) / (height * width) ** 2
    frequency = torch.hypot(torch.fft.fftfreq(height)[:, None], torch.fft.fftfreq(width)[None])
    edges = [2.0 * 2**k for k in range(6)]
    return {(low / px_per_mm, 2 * low / px_per_mm): power[(frequency <= 1 / low) & (frequency > 0.5 / low)].sum().sqrt().item() for low in edges}


def quantiles(values, shares):
    values = values.flatten()[:: max(1, values.numel() // 1_000_000)]
    return np.quantile(values.numpy(), shares)


def of_imprints(shards, numbers):
    """Statistics of the imprints as measured: {name: (value, unit)}."""
    mm = 1e3 * shards.metres("imprint", numbers)
    found = {f"depth, {share:.0%} quantile": (value, "mm") for share, value in
             zip((0.05, 0.25, 0.5, 0.75, 0.95), quantiles(mm, (0.05, 0.25, 0.5, 0.75, 0.95)))}
    shape = smoothed(mm, 1.5)
    slope = slopes(shape) * BUBBLE_PX_PER_MM
    found |= {f"slope, {share:.0%} quantile": (value, "mm/mm") for share, value in zip((0.5, 0.9, 0.99), quantiles(slope, (0.5, 0.9, 0.99)))}
    wide = smoothed(mm, 2.5)
    bend = torch.hypot(wide[:, :, 1:-1, 2:] - 2 * wide[:, :, 1:-1, 1:-1] + wide[:, :, 1:-1, :-2],
                       wide[:, :, 2:, 1:-1] - 2 * wide[:, :, 1:-1, 1:-1] + wide[:, :, :-2, 1:-1]) * BUBBLE_PX_PER_MM**2
    found["share of facets (bent less than 0.05 / mm)"] = ((bend < 0.05).double().mean().item(), "")
    found["share of steps (steeper than 0.5)"] = ((slope > 0.5).double().mean().item(), "")
    # Where the shape is straight, what is left of a light blur is noise.
    noise = mm - smoothed(mm, 2.5)
    calm = F.pad(bend, (1, 1, 1, 1), value=1.0) < 0.1
    found["noise, deviation"] = (1.4826 * noise[calm].abs().median().item(), "mm")
    found["noise, 99 % quantile"] = (float(quantiles(noise[calm].abs(), 0.99)), "mm")
    found["noise, correlation length"] = (falls_below(by_radius(autocorrelation(torch.where(calm, noise, 0))), 1 / np.e), "px")
    # Mean of all touches: what is the same in each is the sensor's own.
    fingers = shards.meta[numbers, 1]
    fixed = [torch.where(calm, noise, 0)[fingers == finger].mean(dim=0) for finger in np.unique(fingers)]
    found["noise that stays, share of its deviation"] = (float(np.mean([f.std() for f in fixed]) / noise[calm].std()), "")
    for (low, high), value in bands(mm, BUBBLE_PX_PER_MM).items():
        found[f"structure of {low:.1f} to {high:.1f} mm"] = (value, "mm")
    return found


def cut(images):
    """Which images (N,3,H,W) lost their negative half, as the lab's color jitter leaves them."""
    return images.flatten(1).quantile(0.1, dim=1) > -0.5


def of_gelslims(images):
    """Statistics of GelSlim difference images (N,3,128,128) in grey levels: {name: (value, unit)}."""
    bright = images.mean(dim=1, keepdim=True)
    found = {f"{name}, deviation": (images[:, c].std().item(), "levels") for c, name in enumerate(("red", "green", "blue"))}
    strength = smoothed(images.flatten(0, 1)[:, None], 1.0).view_as(images).norm(dim=1)
    found |= {f"streaks, {share:.0%} quantile": (value, "levels") for share, value in zip((0.5, 0.9, 0.99), quantiles(strength, (0.5, 0.9, 0.99)))}
    found["streaks, width"] = (2 * falls_below(by_radius(autocorrelation(smoothed(bright, 1.0))), 0.5) / GELSLIM_PX_PER_MM, "mm")
    found["steepness, 99 % quantile"] = (float(quantiles(slopes(smoothed(bright, 1.0)), 0.99)), "levels/px")
    strong = strength > strength.flatten(1).quantile(0.9, dim=1)[:, None, None]
    colors = images.movedim(1, -1)[strong].double().numpy()
    for a, b, name in ((0, 1, "red and green"), (0, 2, "red and blue"), (1, 2, "green and blue")):
        found[f"correlation of {name} in streaks"] = (float(np.corrcoef(colors[:, a], colors[:, b])[0, 1]), "")
    for (low, high), value in bands(bright, GELSLIM_PX_PER_MM).items():
        found[f"structure of {low:.2f} to {high:.2f} mm"] = (value, "levels")
    return found


def rows(real, simulated):
    """Lines of a table of both sets' statistics."""
    found = []
    for shards in map(data.Shards, (real, simulated)):
        numbers = np.arange(0, len(shards), max(1, len(shards) // 400))
        images = shards.take("gelslim", numbers).float() / 64
        images = images[~cut(images)]
        found.append({"imprint": (len(numbers), of_imprints(shards, numbers)), "GelSlim, whole": (len(images), of_gelslims(images))})
    yield "| | real | simulated | ratio |"
    yield "| --- | --: | --: | --- |"
    for title, (count, measured) in found[0].items():
        others, drawn = found[1][title]
        yield f"| **{title}** | {count} | {others} | |"
        for name, (value, unit) in measured.items():
            other = drawn[name][0]
            ratio = other / value if value else np.nan
            mark = "" if abs(ratio - 1) <= TOLERANCE else " !"
            yield f"| {name} | {value:.3g} {unit} | {other:.3g} {unit} | {ratio:.2f}{mark} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--real", nargs="+", required=True, help="shards of real pairs")
    parser.add_argument("--simulated", nargs="+", required=True, help="shards of simulated touches")
    args = parser.parse_args()
    print(*rows(args.real, args.simulated), sep="\n")


if __name__ == "__main__":
    main()
