//! Record of one step of the depth chain, and how its result compares with the truth.

use serde::Serialize;

use super::{CorrectionPart, RELATIVE_NO_SPREAD};
use crate::grid::Grid;
use crate::metrics::Joint;

/// Bars of a stage's histogram.
pub(super) const BARS: usize = 48;
/// A step of the depth chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// One channel of the decoder's picture, counted from 1.
    Channel(u8),
    /// The channels made one. (For meters each channel is clamped and mapped first, as the lab does.)
    Reduced,
    /// De-normalized.
    Meters,
    /// After the shift.
    Shifted,
    /// Moved to where the rig has the pad's window; only of models that draw all pads' windows in one place.
    Placed,
    /// After a part of the fit to a rig.
    Corrected(CorrectionPart),
    /// At the imprint's size.
    Resized,
    /// In the raw orientation of the lab's files: the result.
    Turned,
}

impl Stage {
    /// The name on screen and in JSON.
    pub fn name(self) -> String {
        match self {
            Stage::Channel(n) => format!("Decoder channel {n}"),
            Stage::Reduced => "Channels to one".into(),
            Stage::Meters => "De-normalized".into(),
            Stage::Shifted => "Shift".into(),
            Stage::Placed => "Placed".into(),
            Stage::Corrected(part) => format!("Fit: {}", part.label().to_lowercase()),
            Stage::Resized => "Resized".into(),
            Stage::Turned => "Rotated".into(),
        }
    }

    /// True where the image is in meters; before that it is in the decoder's -1 to 1.
    pub fn is_meters(self) -> bool {
        !matches!(self, Stage::Channel(_) | Stage::Reduced)
    }
}

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

/// Histogram of an image's values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Histogram {
    /// Value at the left end of the first bar.
    pub lo: f64,
    /// Value at the right end of the last bar.
    pub hi: f64,
    /// Pixels per bar.
    pub counts: Vec<u32>,
}

impl Histogram {
    /// Of the finite pixels from the smallest to the largest; no bars without a pixel, one bar for equal ones.
    pub fn of(image: &Grid<f32>, stats: &Stats) -> Self {
        let (lo, hi) = (stats.min, stats.max);
        let bars = if stats.count == 0 {
            0
        } else if stats.is_flat() {
            1
        } else {
            BARS
        };
        let mut counts = vec![0; bars];
        for v in image.as_slice().iter().filter(|v| v.is_finite()) {
            let bar = (f64::from(*v) - lo) / (hi - lo) * bars as f64;
            counts[(bar as usize).min(bars - 1)] += 1;
        }
        Self { lo, hi, counts }
    }
}

/// Record of one step of the chain.
#[derive(Clone, Debug, PartialEq)]
pub struct StageRecord {
    /// The step.
    pub stage: Stage,
    /// Description of the step, with its numbers.
    pub how: String,
    /// The image after it.
    pub image: Grid<f32>,
    /// Figures of the image.
    pub stats: Stats,
    /// Pixels of the image that are not finite.
    pub invalid: usize,
    /// Histogram of the image's values.
    pub histogram: Histogram,
    /// Something the user should know, e.g. that a spread of zero was not divided by.
    pub note: Option<String>,
}

impl StageRecord {
    pub(super) fn new(stage: Stage, how: String, image: Grid<f32>, note: Option<String>) -> Self {
        let stats = Stats::of(&image);
        let histogram = Histogram::of(&image, &stats);
        Self { stage, how, invalid: image.len() - stats.count, image, stats, histogram, note }
    }
}

/// Likeness of prediction and truth, as they lie and turned: Pearson's correlation, `None` for a flat image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Orientation {
    /// As they lie.
    pub as_is: Option<f64>,
    /// With the truth turned by 180 degrees.
    pub turned_180: Option<f64>,
    /// With the truth's rows in reverse order (the mirror image that the other finger sees).
    pub rows_reversed: Option<f64>,
}

/// The result against the measured imprint.
#[derive(Clone, Debug, PartialEq)]
pub struct Against {
    /// The joint histogram (truth to the right, prediction up) with its line, meters.
    pub joint: Joint,
    /// Correlations.
    pub orientation: Orientation,
}
