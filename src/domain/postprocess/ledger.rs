//! The depth chain with nothing hidden: every stage with its image and figures, the result against the truth, and what
//! is implausible.

use serde::Serialize;

use super::flags::{Flag, flags};
use super::{DepthChain, Mapping, PostprocessError, RawPrediction, Shift, ShiftMode};
use crate::domain::grid::{DepthMap, Grid};
use crate::domain::metrics::{Joint, Line, mse, psnr};
use crate::domain::resample::bilinear;

/// Bars of a stage's histogram.
pub(super) const BARS: usize = 48;
/// Bins per axis of the joint histogram.
pub(super) const JOINT_BINS: usize = 48;
/// A spread below this share of the values' size is rounding.
const RELATIVE_NO_SPREAD: f64 = 1e-6;

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
            Stage::Resized => "Resized".into(),
            Stage::Turned => "Rotated".into(),
        }
    }

    /// Whether the image is in meters; before that it is in the decoder's -1 to 1.
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

    /// Whether the spread is no more than rounding.
    pub fn is_flat(&self) -> bool {
        self.count > 0 && self.std <= RELATIVE_NO_SPREAD * self.min.abs().max(self.max.abs())
    }
}

/// How many pixels have which value.
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
            let at = (f64::from(*v) - lo) / (hi - lo) * bars as f64;
            counts[(at as usize).min(bars - 1)] += 1;
        }
        Self { lo, hi, counts }
    }
}

/// What one step of the chain left behind.
#[derive(Clone, Debug, PartialEq)]
pub struct StageRecord {
    /// The step.
    pub stage: Stage,
    /// What it does, with its numbers.
    pub how: String,
    /// The image after it.
    pub image: Grid<f32>,
    /// Its numbers.
    pub stats: Stats,
    /// Its pixels that are not finite.
    pub invalid: usize,
    /// Its values.
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

/// How alike prediction and truth are, as they lie and turned: Pearson's correlation, `None` for a flat image.
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

/// The whole chain of one prediction.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger {
    /// Every step, in order.
    pub stages: Vec<StageRecord>,
    /// The result against the truth; `None` without a truth, or if they share no finite pixel.
    pub against: Option<Against>,
    /// What is implausible, the worst first.
    pub flags: Vec<Flag>,
}

impl Ledger {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let images: usize = self.stages.iter().map(|s| 4 * (s.image.len() + s.histogram.counts.len())).sum();
        images + self.against.as_ref().map_or(0, |a| 4 * a.joint.counts.len()) + size_of::<Self>()
    }
}

/// Runs the chain and tells everything about it. `truth` is the measured imprint (meters, raw orientation); a result of
/// another size is resized to it for the comparison.
///
/// # Errors
/// See [`PostprocessError`].
pub fn ledger(chain: &DepthChain, raw: &RawPrediction, truth: Option<&DepthMap>) -> Result<Ledger, PostprocessError> {
    let (result, stages) = chain.run_with_ledger(raw)?;
    let against = truth.and_then(|truth| {
        let result = fitted(&result, truth);
        let joint = Joint::of(&result, truth, JOINT_BINS).ok()?;
        let orientation = Orientation {
            as_is: correlation(&result, truth),
            turned_180: correlation(&result, &truth.rotated_180()),
            rows_reversed: correlation(&result, &truth.rows_reversed()),
        };
        Some(Against { joint, orientation })
    });
    let flags = flags(chain, raw, &stages, against.as_ref());
    Ok(Ledger { stages, against, flags })
}

fn fitted(result: &DepthMap, truth: &DepthMap) -> DepthMap {
    match result.size() == truth.size() {
        true => result.clone(),
        false => bilinear(result, truth.width(), truth.height()),
    }
}

/// Pearson's correlation over the pixels that are finite in both images, in f64. `None` for images of different size,
/// and where one of them is flat.
pub fn correlation(a: &Grid<f32>, b: &Grid<f32>) -> Option<f64> {
    if a.size() != b.size() {
        return None;
    }
    let pairs = || {
        let both = a.as_slice().iter().zip(b.as_slice()).filter(|(a, b)| a.is_finite() && b.is_finite());
        both.map(|(&a, &b)| (f64::from(a), f64::from(b)))
    };
    let count = pairs().count() as f64;
    if count == 0.0 {
        return None;
    }
    let (mean_a, mean_b) = (pairs().map(|p| p.0).sum::<f64>() / count, pairs().map(|p| p.1).sum::<f64>() / count);
    let (mut aa, mut bb, mut ab, mut size_a, mut size_b) = (0.0, 0.0, 0.0, 0.0f64, 0.0f64);
    for (a, b) in pairs() {
        (size_a, size_b) = (size_a.max(a.abs()), size_b.max(b.abs()));
        let (a, b) = (a - mean_a, b - mean_b);
        (aa, bb, ab) = (aa + a * a, bb + b * b, ab + a * b);
    }
    let spread = |sum: f64, size: f64| (sum / count).sqrt() > RELATIVE_NO_SPREAD * size;
    (spread(aa, size_a) && spread(bb, size_b)).then(|| ab / (aa.sqrt() * bb.sqrt())).filter(|r| r.is_finite())
}

/// What another way to meters would have made of the same picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChainReading {
    /// Its name.
    pub name: String,
    /// How the decoder's range is read.
    pub mapping: Mapping,
    /// Gain and offset (meters) of the shift after it.
    pub shift: [f64; 2],
    /// Figures of the result, meters.
    pub stats: Stats,
    /// The line through the joint histogram.
    pub line: Option<Line>,
    /// Peak signal-to-noise ratio against the truth, decibels.
    pub psnr_db: Option<f64>,
    /// Root mean square error, meters.
    pub rms_m: Option<f64>,
}

/// The same picture read in every way there is: the correct mapping, and the doubled one with each shift of `modes`.
/// `chain` is any of the bundle's; a mode that has no statistics is left out. `peak_m` is PSNR's peak.
pub fn readings(
    chain: &DepthChain,
    modes: &[(ShiftMode, DepthChain)],
    raw: &RawPrediction,
    truth: Option<&DepthMap>,
    peak_m: f64,
) -> Vec<ChainReading> {
    let correct = DepthChain { mapping: Mapping::Correct, shift: Shift::None, ..chain.clone() };
    let named = modes.iter().map(|(mode, chain)| (mode.label().to_owned(), chain));
    std::iter::once(("Correct mapping".to_owned(), &correct))
        .chain(named)
        .filter_map(|(name, chain)| {
            let result = chain.run(raw).ok()?;
            let fitted = truth.map(|truth| (fitted(&result, truth), truth));
            let line = fitted.as_ref().and_then(|(p, t)| Joint::of(p, t, 1).ok()?.line);
            let psnr_db = fitted.as_ref().and_then(|(p, t)| psnr(p, t, peak_m).ok()?.db());
            let rms_m = fitted.as_ref().and_then(|(p, t)| Some(mse(p, t).ok()?.sqrt()));
            let shift = match chain.shift {
                Shift::None => [1.0, 0.0],
                Shift::ExactInverse => [2.0, -chain.range.max_m],
                Shift::PaperMeanStd(stats) => stats.affine(chain.range.max_m),
            };
            Some(ChainReading { name, mapping: chain.mapping, shift, stats: Stats::of(&result), line, psnr_db, rms_m })
        })
        .collect()
}
