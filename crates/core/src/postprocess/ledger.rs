//! The depth chain with nothing hidden: every stage with its image and figures, the result against the truth, and what
//! is implausible.

use serde::Serialize;

use super::flags::{Flag, flags};
use super::record::{Against, Orientation, StageRecord, Stats};
use super::{DepthChain, Mapping, PostprocessError, RELATIVE_NO_SPREAD, RawPrediction, Shift, ShiftMode};
use crate::grid::{DepthMap, Grid};
use crate::metrics::{Joint, Line, mse, psnr};
use crate::resample::bilinear;

/// Bins per axis of the joint histogram.
pub(super) const JOINT_BINS: usize = 48;

/// The whole chain of one prediction.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger {
    /// Every step, in order.
    pub stages: Vec<StageRecord>,
    /// The result against the truth; `None` without a truth, or if they share no finite pixel.
    pub against: Option<Against>,
    /// Flags: what is implausible, the worst first.
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

/// Result that another way to meters would have made of the same picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChainReading {
    /// Name of that way.
    pub name: String,
    /// Mapping of the decoder's range to meters.
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

/// Readings of one picture in every way there is: by the correct mapping, and by the doubled one with each shift of
/// `modes`. `chain` is any of the bundle's; a mode that has no statistics is left out. `peak_m` is PSNR's peak.
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
