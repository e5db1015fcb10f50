//! Latent diffusion: schedule, seeded noise, DDIM.
