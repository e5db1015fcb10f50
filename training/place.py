"""Where a training runs: on which device, in which number format, and in how many processes.

`torchrun --nproc-per-node 2 -m training.train ...` gives each of two processes a part of every step, of the usual size, with
its own samples and random numbers, and averages the gradients; one process with `--parts 2` takes the same parts one after
the other. Both do the same steps.
"""

import ctypes
import os
from pathlib import Path

import torch
import torch.distributed as dist

PRECISIONS = {"float32": None, "bfloat16": torch.bfloat16}


def keep_freed_memory():
    """Has glibc keep what is freed: else each large tensor's pages are asked for and cleared anew. A fifth of the time and more."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    for what, size in ((-3, 2_000_000_000), (-1, 2_000_000_000), (-2, 1 << 26)):  # mmap and trim threshold, top pad
        if mallopt:
            mallopt(what, size)


def device_called(name):
    """`auto` is the first GPU that PyTorch can use, else the processor."""
    there = {"cuda": torch.cuda.is_available(), "mps": torch.backends.mps.is_available(), "cpu": True}
    if name == "auto":
        return next(kind for kind in there if there[kind])
    if not there[name]:
        raise SystemExit(f"PyTorch finds no device {name} here; there is {', '.join(k for k in there if there[k])}")
    return name


class Place:
    """The device of this process, and its share of each step."""

    def __init__(self, args):
        self.processes, self.rank = int(os.environ.get("WORLD_SIZE", 1)), int(os.environ.get("RANK", 0))
        kind = device_called(args.device)
        self.device = torch.device(kind, int(os.environ.get("LOCAL_RANK", 0))) if kind == "cuda" else torch.device(kind)
        if kind == "cuda":
            torch.cuda.set_device(self.device)
            torch.set_float32_matmul_precision("high")
            torch.backends.cudnn.benchmark = True
        if self.processes > 1 and not dist.is_initialized():
            dist.init_process_group("nccl" if kind == "cuda" else "gloo")
        self.parts = self.processes * args.parts
        self.own = range(self.rank * args.parts, (self.rank + 1) * args.parts)
        self.low = PRECISIONS[self.precision(args.precision)]

    def precision(self, name):
        """`auto` is bfloat16 where the device computes in it: on a processor it would be slower, but for those with AMX."""
        if name != "auto":
            return name
        return "bfloat16" if self.device.type == "cuda" and torch.cuda.is_bf16_supported() else "float32"

    def first(self):
        """This process keeps the checkpoints and the log."""
        return self.rank == 0

    def autocast(self):
        return torch.autocast(self.device.type, self.low or torch.bfloat16, enabled=self.low is not None)

    def free_bytes(self):
        """Memory of the device that is free."""
        if self.device.type == "cuda":
            return torch.cuda.mem_get_info(self.device)[0]
        about = Path("/proc/meminfo")
        if not about.exists():
            return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
        return next(1024 * int(line.split()[1]) for line in about.read_text().splitlines() if line.startswith("MemAvailable"))

    def same(self, number):
        """The first process's number, so that all decide alike."""
        if self.processes > 1:
            told = torch.tensor([number], dtype=torch.float64 if self.device.type == "cpu" else torch.float32, device=self.device)
            dist.broadcast(told, 0)
            number = float(told)
        return number

    def average(self, parameters):
        """Averages the gradients over the processes, all in one message."""
        if self.processes > 1:
            gradients = [p.grad for p in parameters if p.grad is not None]
            flat = torch.cat([g.flatten() for g in gradients])
            dist.all_reduce(flat)
            flat /= self.processes
            for gradient, part in zip(gradients, flat.split([g.numel() for g in gradients])):
                gradient.copy_(part.view_as(gradient))

    def agree(self, tensors):
        """Gives every process the first one's values."""
        if self.processes > 1:
            for tensor in tensors:
                dist.broadcast(tensor.data, 0)

    def __str__(self):
        name = torch.cuda.get_device_name(self.device) if self.device.type == "cuda" else self.device.type
        shared = f", {self.processes} processes" if self.processes > 1 else ""
        return f"{name} in {'float32' if self.low is None else 'bfloat16'}{shared}"
