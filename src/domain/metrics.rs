//! Image and pose metrics.
