"""The training data: folders ("shards") of .npy files written by `touch2touch-bench training-data`, memory-mapped.

gelslim.npy  (M,3,128,128) i16  difference image in 1/64 grey levels, resized bilinearly without antialias
imprint.npy  (M,140,175)   i16  measured imprint in micrometres, raw orientation; -32768 = no measurement
clean.npy    (M,140,175)   i16  the same without camera noise; of real touches the measured one with its holes filled
contact.npy  (M,140,175)   u8   1 where the membrane lies on the tool; 255 everywhere where that is not known
meta.npy     (M,8)         f32  grasp, finger, angle, y, z (NaN = not known), tool (-1 = not in the catalog), sensors (0 drawn,
                                1 the simulator's nominal ones, 2 drawn and of any depth, 3 real), unseen tool
"""

import hashlib
import json
from functools import lru_cache
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

# Standardisation of the difference image on the 0..1 scale: the lab's published statistics of its GelSlim data.
MEAN = (-0.0107, -0.0063, -0.0087)
STD = (0.0687, 0.0428, 0.0576)
# Range of the imprint that [-1, 1] stands for: the extremes of the lab's training data.
RANGE_M = (-0.0188, 0.0264)
# Range of the mask UNet's 8-bit input.
MASK_RANGE_M = (-0.0116, 0.0225)


# Centers of what the GelSlims see in the raw bubble image, pixels: right, left finger (`crates/core/src/rig/lab.rs`), for shards
# that do not say it.
WINDOWS_PX = ((64.5, 71.6), (74.8, 73.4))
# Where a generator's picture has the window of either finger: nothing in a GelSlim image of an unknown sensor says which
# finger it is of, so a network that drew each at its own place would have to draw the mean of both. In the middle of
# the two windows.
FRAME_PX = (69.5, 72.6)


class Shards:
    """All shards under one folder, or several, as one list of samples. `refresh` picks up shards added meanwhile."""

    def __init__(self, folders):
        self.roots = [Path(f) for f in ([folders] if isinstance(folders, (str, Path)) else folders)]
        self.folders, self.parts, self.windows = [], [], []
        self.refresh()
        if not self.parts:
            raise SystemExit(f"no shards in {folders}: write some with `touch2touch-bench training-data` (see README.md)")

    def refresh(self):
        known = set(self.folders)
        for done in sorted(done for root in self.roots for done in root.glob("*/done.json")):
            if done.parent not in known:
                self.folders.append(done.parent)
                self.parts.append({f.stem: np.load(f, mmap_mode="r") for f in done.parent.glob("*.npy")})
                self.windows.append(json.loads(done.read_text()).get("windows_px", WINDOWS_PX))
        self.starts = np.cumsum([0] + [len(p["meta"]) for p in self.parts])
        self.meta = np.concatenate([p["meta"] for p in self.parts]) if self.parts else np.zeros((0, 8), np.float32)

    def __len__(self):
        return int(self.starts[-1])

    def take(self, key, numbers):
        """An array of samples (numbers: an array of integers), as it is stored."""
        parts = np.searchsorted(self.starts, numbers, side="right") - 1
        taken = np.empty((len(numbers), *self.parts[0][key].shape[1:]), self.parts[0][key].dtype)
        for part in np.unique(parts):
            of_part = parts == part
            taken[of_part] = self.parts[part][key][numbers[of_part] - self.starts[part]]
        return torch.from_numpy(taken)

    def gelslim(self, numbers):
        """Standardised differences (N,3,128,128)."""
        return standardised(self.take("gelslim", numbers))

    def metres(self, key, numbers):
        """`imprint` or `clean` in metres (N,1,140,175), raw orientation; missing pixels from the clean image."""
        raw = self.take(key, numbers)
        return metres(filled(raw, self.take("clean", numbers)) if key == "imprint" else raw)

    def offsets(self, numbers):
        """How far each sample's window lies from the frame's, raw bubble pixels (N,2), along x and y."""
        parts = np.searchsorted(self.starts, numbers, side="right") - 1
        windows = np.array(self.windows)[parts, self.meta[numbers, 1].astype(int)]
        return torch.from_numpy(windows - np.array(FRAME_PX)).float()

    def contact(self, numbers):
        return self.take("contact", numbers).long()

    def contact_known(self, numbers):
        """Which of the samples say where contact is (N,)."""
        parts = np.searchsorted(self.starts, numbers, side="right") - 1
        return np.array([self.parts[p]["contact"][at, 0, 0] != 255 for p, at in zip(parts, numbers - self.starts[parts])], bool)

    def record(self):
        """Every shard's own description."""
        return [json.loads((folder / "done.json").read_text()) for folder in self.folders]


def standardised(raw):
    """Difference images as stored to standardised ones."""
    mean, std = (torch.tensor(v, device=raw.device)[:, None, None] for v in (MEAN, STD))
    return raw * (1 / (64 * 255 * std)) - mean / std


def filled(imprint, clean):
    """Imprints as stored, holes filled from the clean ones."""
    return torch.where(imprint == -32768, clean, imprint)


def metres(raw):
    """Imprints as stored (N,140,175) in metres (N,1,140,175)."""
    return raw[:, None] * 1e-6


def stored(picture):
    """Pictures (N,1,S,S) in [-1,1] in 16 bits: a step is a thousandth of a millimetre."""
    return torch.round(picture * 32767).to(torch.int16)


def restored(stored):
    return stored * (1 / 32767)


def sampled(image, x, y):
    """Bilinear values of images (N,1,H,W) at columns x (N,w) and rows y (N,h); beyond the border the border's value."""
    height, width = image.shape[2:]
    x, y = (2 * x + 1) / width - 1, (2 * y + 1) / height - 1
    at = torch.stack([x[:, None, :].expand(-1, y.shape[1], -1), y[:, :, None].expand(-1, -1, x.shape[1])], dim=3)
    return F.grid_sample(image, at, mode="bilinear", padding_mode="border", align_corners=False)


def to_model(metres, offsets=None):
    """Imprint in metres, raw orientation, to the generator's image: rotated by 180 degrees, 128 x 128, [-1,1].

    With `offsets` (N,2) moved so that the windows come to lie where the frame has them.
    """
    height, width = metres.shape[2:]
    offsets = torch.zeros(len(metres), 2, device=metres.device) if offsets is None else offsets
    at = (torch.arange(128, device=metres.device) + 0.5)[None] / 128
    x = width - 0.5 - at * width + offsets[:, :1]
    y = height - 0.5 - at * height + offsets[:, 1:]
    image = sampled(metres, x, y)
    return ((image - RANGE_M[0]) / (RANGE_M[1] - RANGE_M[0]) * 2 - 1).clamp(-1, 1)


def from_model(image, offsets=None):
    """The inverse of `to_model`, up to resampling: (N,1,140,175) metres in the raw orientation."""
    metres = (image.clamp(-1, 1) + 1) / 2 * (RANGE_M[1] - RANGE_M[0]) + RANGE_M[0]
    metres = torch.flip(F.interpolate(metres, size=(140, 175), mode="bilinear", align_corners=False), dims=(2, 3))
    if offsets is None:
        return metres
    x, y = (torch.arange(size, device=metres.device)[None] - by for size, by in zip((175.0, 140.0), offsets.split(1, dim=1)))
    return sampled(metres, x, y)


def to_mask_input(metres):
    """Imprint in metres to the mask UNet's 8-bit input in [0,1]: saturating, truncated."""
    unit = (metres - MASK_RANGE_M[0]) / (MASK_RANGE_M[1] - MASK_RANGE_M[0])
    return torch.floor(unit.clamp(0, 1) * 255) / 255


def turned(images, k):
    """Images (N,C,S,S), each by its own of the 8 symmetries of the square, k (N,): k % 4 quarter turns, mirrored from 4 on."""
    k = k[:, None, None, None]
    turns, mirrored = k % 4, k >= 4
    images = torch.where(turns % 2 == 1, images.transpose(2, 3), images)
    images = torch.where((turns == 1) | (turns == 2), images.flip(2), images)
    return torch.where((turns >= 2) ^ mirrored, images.flip(3), images)


# The GelSlim's window in the generator's image (128 x 128, rotated bubble), both fingers' in the frame: rows, then columns.
WINDOW = (slice(47, 76), slice(61, 92))


@lru_cache
def shrunk():
    """Matrices A, B (128,128): A x B is the picture x made small, where the GelSlim's window lies, and zero around."""
    eye, factors = torch.eye(128)[None, None], []
    for part in WINDOW:
        factor = torch.zeros(128, 128)
        factor[part] = F.interpolate(eye, size=(part.stop - part.start, 128), mode="bilinear", align_corners=False,
                                     antialias=True)[0, 0]
        factors.append(factor)
    return factors[0], factors[1].T.contiguous()


def padded(gelslim):
    """GelSlim images (N,3,128,128) drawn where the sensor lies in the bubble's view, nothing around."""
    rows, columns = (matrix.to(gelslim.device) for matrix in shrunk())
    return rows @ gelslim @ columns


def cropped(image):
    """The part of the generator's image that the GelSlim sees, enlarged to 128 x 128."""
    return F.interpolate(image[:, :, *WINDOW], size=(128, 128), mode="bilinear", align_corners=False)


@lru_cache
def uneven():
    """Matrix (128,3): U g U' is a 3 x 3 raster g drawn smoothly over a picture."""
    return F.interpolate(torch.eye(3)[None, None], size=(128, 3), mode="bicubic", align_corners=True)[0, 0]


def augment_gelslim(x, randomised):
    """Sensor variety for standardised differences (N,3,128,128): strong where `randomised` (N,) is true.

    Mixed colours, gain, uneven light, blur and noise; and now and then the negative half cut off, as the lab's
    own colour jitter does to the images that it feeds to its networks.
    """
    n, device = len(x), x.device
    strong = randomised.float()[:, None, None, None]

    def uniform(lo, hi):
        return lo + (hi - lo) * torch.rand(n, 1, 1, 1, device=device)

    def normal(*shape):
        return torch.randn(n, *shape, device=device)

    mix = torch.eye(3, device=device) + strong[:, :, :, 0] * 0.2 * normal(3, 3)
    mix = torch.exp(strong[:, :, :, 0] * 0.4 * normal(3, 1)) * mix
    light = uneven().to(device)
    x = (mix @ x.flatten(2)).view_as(x) + light @ (strong * 0.15 * normal(3, 3, 3)) @ light.T
    blurred = F.avg_pool2d(F.pad(x, (1, 1, 1, 1), mode="replicate"), 3, stride=1)
    x = torch.lerp(x, blurred, uniform(0, 1) * (0.3 + 0.7 * strong))
    x = x + uniform(0, 0.06) * (1 + 3 * strong) * torch.randn_like(x)
    cut = (uniform(0, 1) < 0.35) & (strong > 0)
    return torch.where(cut, (x * uniform(0.4, 3) + uniform(0, 0.15)).clamp(0, 1), x)


def sha256(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()
