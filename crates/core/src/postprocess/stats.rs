//! Numbers about an image of the depth chain.

use serde::Serialize;

use super::RELATIVE_NO_SPREAD;
use crate::grid::Grid;

/// Numbers about the finite pixels of an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stats {
    /// Smallest value; NaN if there is no finite pixel (so for the next three).
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Population deviation.
    pub std: f64,
    /// Finite pixels.
    pub count: usize,
}

impl Stats {
    /// Two passes in f64, so that a large mean does not swallow a small spread.
    pub fn of(image: &Grid<f32>) -> Self {
        let values = || image.as_slice().iter().filter(|v| v.is_finite()).map(|&v| f64::from(v));
        let count = values().count();
        if count == 0 {
            return Self { min: f64::NAN, max: f64::NAN, mean: f64::NAN, std: f64::NAN, count };
        }
        let mean = values().sum::<f64>() / count as f64;
        let variance = values().map(|v| (v - mean).powi(2)).sum::<f64>() / count as f64;
        Self {
            min: values().fold(f64::INFINITY, f64::min),
            max: values().fold(f64::NEG_INFINITY, f64::max),
            mean,
            std: variance.sqrt(),
            count,
        }
    }

    /// True where the spread is no more than rounding.
    pub(crate) fn is_flat(&self) -> bool {
        self.count > 0 && self.std <= RELATIVE_NO_SPREAD * self.min.abs().max(self.max.abs())
    }
}
