"""What a stage learns from, on the device: kept there whole, or read from the shards for each batch."""

import zlib
from functools import lru_cache

import numpy as np
import torch

from . import data

# Real imprints lie this far (deviation, pixels of the raw bubble image: a millimetre) from where the GelSlim image says: the
# two sensors touch the tool in two grasps. Whoever draws a sharp edge in a place that is not sure pays for it twice.
PLACEMENT_PX = 2.3
# Samples that are read and converted at once.
CHUNK = 256


class Touches:
    """Samples of the shards of `--data` that a stage can use, each with the stage's own `keys` alone:

    gelslim, imprint, clean, contact: as in the shards, holes of the imprint filled; clean_picture, imprint_picture: the
    generator's picture, in 16 bits; drawn: whether the sensors are the simulator's drawn ones; tool: its number.
    `usable(shards, numbers)` says which samples are taken. `refresh` picks up shards that were added meanwhile.
    """

    def __init__(self, args, place, keys, usable=None):
        self.shards, self.args, self.place, self.keys, self.usable = data.Shards(args.data), args, place, keys, usable
        self.numbers, self.moved, self.kept, self.seen = np.zeros(0, int), np.zeros((0, 2), np.float32), {}, 0
        one = sum(value.nbytes for value in self._read(np.zeros(1, int), torch.zeros(1, 2)).values())
        self.limit = place.free_bytes() / 2 / one
        self.resident = args.resident == "yes" or (args.resident == "auto" and len(self.shards) <= self.limit)
        self._take_up()

    def __len__(self):
        return len(self.numbers)

    def refresh(self):
        self.shards.refresh()
        self._take_up()

    def _take_up(self):
        """Takes up the shards that are new."""
        while self.seen < len(self.shards.parts):
            first, last = self.shards.starts[self.seen:self.seen + 2]
            numbers = np.arange(first, last)
            if self.usable:
                numbers = numbers[self.usable(self.shards, numbers)]
            if self.resident and self.args.resident == "auto" and len(self) + len(numbers) > self.limit:
                return
            # Each sample is always misplaced by the same; what real and nominal sensors say of the place is exact.
            rng = np.random.default_rng((self.args.seed, zlib.crc32(self.shards.folders[self.seen].name.encode())))
            moved = PLACEMENT_PX * rng.standard_normal((last - first, 2), dtype=np.float32)[numbers - first]
            moved[~np.isin(self.shards.meta[numbers, 6], (0, 2))] = 0
            if self.resident:
                self._keep(numbers, moved)
            self.numbers, self.moved = np.concatenate([self.numbers, numbers]), np.concatenate([self.moved, moved])
            self.seen += 1

    def _keep(self, numbers, moved):
        room, held = max(map(len, self.kept.values()), default=0), len(self)
        if held + len(numbers) > room:
            room = max(len(self.shards), int(1.3 * (held + len(numbers))) if room else 0)
        for at in range(0, len(numbers), CHUNK):
            part = slice(at, at + CHUNK)
            for key, value in self._read(numbers[part], torch.from_numpy(moved[part])).items():
                kept = self.kept.get(key)
                if kept is None or len(kept) < room:
                    self.kept[key] = torch.empty(room, *value.shape[1:], dtype=value.dtype, device=value.device)
                    if kept is not None:
                        self.kept[key][:held + at] = kept[:held + at]
                self.kept[key][held + at:held + at + len(value)] = value

    def _read(self, numbers, moved):
        """The stage's arrays of samples of the shards, on the device; `moved`: how far each picture is misplaced."""
        device, meta = self.place.device, self.shards.meta[numbers]
        names = {key.removesuffix("_picture") for key in self.keys} - {"drawn", "tool"}
        raw = {name: self.shards.take(name, numbers).to(device) for name in names | ({"clean"} if "imprint" in names else set())}
        if "imprint" in raw:
            raw["imprint"] = data.filled(raw["imprint"], raw["clean"])
        offsets = (self.shards.offsets(numbers) + moved).to(device) if self.args.frame == "window" else None
        made = {"drawn": torch.from_numpy(meta[:, 6] == 0).to(device), "tool": torch.from_numpy(meta[:, 5]).long().to(device)} | raw
        for name in names:
            if f"{name}_picture" in self.keys:
                made[f"{name}_picture"] = data.stored(data.to_model(data.metres(raw[name]), offsets))
        return {key: made[key] for key in self.keys}

    def get(self, places):
        """The arrays of the samples at some places of the list, on the device."""
        if not self.resident:
            return self._read(self.numbers[places], torch.from_numpy(self.moved[places]))
        places = torch.from_numpy(places).to(self.place.device, non_blocking=True)
        return {key: kept.index_select(0, places) for key, kept in self.kept.items()}


@lru_cache(maxsize=2)
def order(seed, turn, total):
    """The samples in the order of pass `turn`."""
    return np.random.default_rng((seed, turn)).permutation(total)


def places(seed, first, count, total):
    """Places `first` to `first + count` of the endless list of passes that `seed` draws from `total` samples."""
    at = np.arange(first, first + count)
    return np.concatenate([order(seed, int(turn), total)[at[at // total == turn] % total] for turn in np.unique(at // total)])


def batches(run, touches, prepare):
    """What `prepare(touches, places, args)` makes of each of this process's parts until the budget is spent.

    Samples and random numbers are a function of seed, step and part alone: every method is given the same samples in the same
    order, and a run that was stopped goes on as if it had not been. New shards are looked for after each pass.
    """
    seed, size = run.args.seed, run.batch
    while not run.over():
        step = run.step
        for part in run.place.own:
            index, total = step * run.place.parts + part, len(touches)
            if total < size:
                raise SystemExit(f"{run.args.data} holds {total} samples that can be used, fewer than one batch of {size}")
            torch.manual_seed(seed * 1_000_003 + step + part * 500_009)
            yield prepare(touches, places(seed, index * size, size, total), run.args)
            if (index + 1) * size % total < size:
                touches.refresh()


def symmetries(args, count, device):
    """A symmetry for each of `count` pairs: plain, or one of the turns and mirrorings that the switches allow."""
    allowed = [k for k in range(1, 8) if (args.rotation or k % 4 == 0) and (args.flip or k < 4)] or [0]
    chosen = torch.tensor(allowed, device=device)[torch.randint(len(allowed), (count,), device=device)]
    return torch.where(torch.rand(count, device=device) < args.turned, chosen, 0)


def condition(batch, k, args):
    """Augmented, standardised GelSlim images (N,3,128,128), channels last, turned by `k`."""
    gelslim = data.standardised(batch["gelslim"])
    if args.geometry == "padding":
        gelslim = data.padded(gelslim)
    gelslim = data.augment_gelslim(data.turned(gelslim, k), batch["drawn"])
    if args.condition_noise:
        gelslim = gelslim + args.condition_noise * torch.randn_like(gelslim)
    return gelslim.contiguous(memory_format=torch.channels_last)


def picture(batch, name, k, args):
    """Imprints `name` (N,1,128,128) in [-1,1], turned by `k`."""
    image = data.restored(batch[f"{name}_picture"])
    if args.geometry == "cropping":
        image = data.cropped(image)
    return data.turned(image, k).contiguous(memory_format=torch.channels_last)


PAIR = ("gelslim", "clean_picture", "drawn")


def pair(touches, places, args):
    """GelSlim images and the noise-free imprints of the same touches.

    Both are turned and mirrored together, as the lab's own augmentation does: the colours tell which way up.
    """
    batch = touches.get(places)
    k = symmetries(args, len(places), touches.place.device)
    return {"gelslim": condition(batch, k, args), "clean": picture(batch, "clean", k, args)}
