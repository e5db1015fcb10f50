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


@torch.no_grad()
def ddim(denoiser, condition, steps=20, seed=42, shape=(4, 16, 16)):
    """Deterministic DDIM with trailing spacing; the last step goes to a clean latent."""
    bars = alpha_bar()
    times = [round(STEPS - i * STEPS / steps) - 1 for i in range(steps)]
    noise = np.random.default_rng(seed).standard_normal((condition.shape[0], *shape), dtype=np.float32)
    x = torch.from_numpy(noise)
    for i, t in enumerate(times):
        bar, after = bars[t], bars[times[i + 1]] if i + 1 < steps else 1.0
        v = denoiser(x, torch.full((x.shape[0],), t, dtype=torch.int64), condition).float()
        z = bar**0.5 * x - (1 - bar) ** 0.5 * v
        noise = (1 - bar) ** 0.5 * x + bar**0.5 * v
        x = after**0.5 * z + (1 - after) ** 0.5 * noise
    return x
