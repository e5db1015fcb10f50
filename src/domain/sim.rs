//! Simulator of both sensors and their ground truth.
