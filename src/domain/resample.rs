//! Resampling that agrees with torchvision 0.12 on tensors (no antialias).
