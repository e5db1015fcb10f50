"""Noise schedule, v-prediction and DDIM, as the bundle's manifest describes them."""

import numpy as np
import torch

STEPS, BETA_START, BETA_END = 1000, 0.0015, 0.0155


def alpha_bar():
    """Cumulative signal power of the "scaled linear" schedule, float64 (1000,)."""
    betas = np.linspace(BETA_START**0.5, BETA_END**0.5, STEPS) ** 2
    return np.cumprod(1 - betas)


def noised(z, noise, t, bars):
    """x_t and the v target for latents z (N,C,H,W), steps t (N,)."""
    a = bars[t].sqrt()[:, None, None, None]
    s = (1 - bars[t]).sqrt()[:, None, None, None]
    return a * z + s * noise, a * noise - s * z


class Step:
    """One step of a sampler from step `t` of the schedule to signal power `after`: DDIM for eta 0, DDPM for eta 1."""

    def __init__(self, t, bar, after, eta):
        self.t, self.sigma = t, eta * ((1 - after) / (1 - bar) * (1 - bar / after)) ** 0.5
        self.signal, self.noise = bar**0.5, (1 - bar) ** 0.5
        self.signal_after, self.noise_after = after**0.5, max(1 - after - self.sigma**2, 0) ** 0.5

    def take(self, x, v):
        """The clean latent that prediction `v` at `x` means, and where the step leads."""
        z, noise = self.signal * x - self.noise * v, self.noise * x + self.signal * v
        after = self.signal_after * z + self.noise_after * noise
        return z, after + self.sigma * torch.randn_like(x) if self.sigma else after


def spaced(steps, eta=0.0):
    """The steps of a sampler with trailing spacing; the last one goes to a clean latent."""
    bars = [float(bar) for bar in alpha_bar()]
    times = [round(STEPS - i * STEPS / steps) - 1 for i in range(steps)]
    return [Step(t, bars[t], after, eta) for t, after in zip(times, [bars[t] for t in times[1:]] + [1.0])]


@torch.no_grad()
def ddim(denoiser, condition, steps=20, seed=42, shape=(4, 16, 16)):
    """Deterministic DDIM."""
    noise = np.random.default_rng(seed).standard_normal((condition.shape[0], *shape), dtype=np.float32)
    x = torch.from_numpy(noise).to(condition.device)
    for step in spaced(steps):
        x = step.take(x, denoiser(x, torch.full((x.shape[0],), step.t, device=x.device), condition).float())[1]
    return x
