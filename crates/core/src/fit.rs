//! Fitting a generator's pictures to pairs of a real rig, in closed form: [`closed_form`].
//!
//! A generator that learnt on simulated touches draws a real imprint at the wrong place, on the wrong scale, and without
//! what the sensor adds to every picture. All of that is linear, so a few pairs and about a second find it. The recipe
//! was chosen by cross-validation on 36 published pairs: their PSNR (both pictures stretched to 0..1) goes from 16 to
//! 24 dB.

mod doubts;
mod fitted;
mod offset;
mod response;
pub mod sound;
mod validate;

use std::sync::Arc;

use super::blur::gaussian;
use super::grid::{DepthMap, Grid};
use super::postprocess::{Correction, CorrectionParts, Response};

pub use doubts::{Doubt, doubts};
pub use fitted::{FitSource, Fitted, PadFit};
pub use offset::offsets;
pub use validate::{folds, left_out};

/// Deviation of the targets' blur before places are compared, pixels: the sensor's grain has no place.
const GRAIN_PX: f64 = 1.0;
/// Deviation of the blur that parts the mean residual, pixels: what is finer is the sensor's own pattern and is
/// believed at once; the rest only as pairs add up.
const PATTERN_PX: f64 = 3.0;
/// Deviation of the blur of the gain map, pixels.
const GAIN_PX: f64 = 4.0;
/// Weight of the gain 1, in mean squared deviations.
const GAIN_PRIOR: f64 = 0.1;

/// A prediction with what was measured.
#[derive(Clone, Copy, Debug)]
pub struct FitPair<'a> {
    /// Depth picture that the generator drew, meters, at the decoder's size and in its orientation.
    pub prediction: &'a DepthMap,
    /// Measured picture, likewise; where it is not finite nothing is learnt.
    pub target: &'a DepthMap,
    /// The pad, counted from 0.
    pub pad: usize,
}

/// Why there is no fit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FitError(String);

/// A picture as numbers to reckon with, row by row.
type Pixels = Vec<f64>;

/// The corrections of `pads` pads; `None` for a pad without a pair.
///
/// # Errors
/// [`FitError`].
///
/// # Cost
/// About 10 ms per pair of 128 x 128 pixels, and 16 bytes per pixel and pair.
pub fn closed_form(cases: &[FitPair<'_>], pads: usize) -> Result<Vec<Option<Correction>>, FitError> {
    let size = check(cases)?;
    let offsets = offsets(cases, pads);
    // Everything after the offset, before the line is known.
    let start = |pad: usize| Correction {
        offset_px: offsets[pad],
        line: [1.0, 0.0],
        mean: Grid::filled(size[0], size[1], 0.0),
        field: Grid::filled(size[0], size[1], 0.0),
        gain: Grid::filled(size[0], size[1], 1.0),
        response: None,
        parts: CorrectionParts::ALL,
    };
    let mut corrections: Vec<Option<Correction>> =
        (0..pads).map(|pad| cases.iter().any(|case| case.pad == pad).then(|| start(pad))).collect();
    let placed: Vec<DepthMap> = cases
        .iter()
        .map(|case| {
            corrections[case.pad].as_ref().map_or_else(|| case.prediction.clone(), |c| c.placed(case.prediction))
        })
        .collect();
    let line = line(placed.iter().zip(cases.iter().map(|case| case.target)));
    for one in corrections.iter_mut().flatten() {
        one.line = line;
    }
    let on_line: Vec<Pixels> = placed
        .iter()
        .map(|image| image.as_slice().iter().map(|&v| f64::from(v) * line[0] + line[1]).collect())
        .collect();
    let targets: Vec<Pixels> = cases.iter().zip(&on_line).map(|(case, own)| filled(case.target, own)).collect();
    for (pad, one) in corrections.iter_mut().enumerate() {
        let Some(one) = one else { continue };
        let own: Vec<usize> = (0..cases.len()).filter(|&i| cases[i].pad == pad).collect();
        shared(one, &own, &on_line, &targets);
    }
    let missing: Vec<Grid<f64>> = cases
        .iter()
        .zip(&placed)
        .zip(&targets)
        .map(|((case, placed), target)| {
            let Some(one) = &corrections[case.pad] else { return Grid::filled(size[0], size[1], 0.0) };
            let weighed = one.weighed(placed, &one.leveled(placed));
            let width = size[0];
            Grid::from_fn(size[0], size[1], |x, y| target[y * width + x] - f64::from(weighed[(x, y)]))
        })
        .collect();
    let response: Option<Arc<Response>> = response::response(&on_line, &missing).map(Arc::new);
    for one in corrections.iter_mut().flatten() {
        one.response.clone_from(&response);
    }
    Ok(corrections)
}

fn check(cases: &[FitPair<'_>]) -> Result<[usize; 2], FitError> {
    let refuse = |why: String| Err(FitError(why));
    let Some(first) = cases.first() else {
        return refuse("there is no pair to fit to; choose pairs with both images".into());
    };
    let expected = first.prediction.size();
    for (case, one) in cases.iter().enumerate() {
        for size in [one.prediction.size(), one.target.size()] {
            if size != expected || size.contains(&0) {
                return refuse(format!("pair {case} has a picture of {size:?} pixels instead of {expected:?}"));
            }
        }
        if one.prediction.as_slice().iter().any(|v| !v.is_finite()) {
            return refuse(format!("the prediction of pair {case} has values that are not finite"));
        }
    }
    Ok(expected)
}

/// The target, with what the prediction says where nothing was measured.
fn filled(target: &DepthMap, own: &[f64]) -> Pixels {
    target.as_slice().iter().zip(own).map(|(&t, &own)| if t.is_finite() { f64::from(t) } else { own }).collect()
}

/// Gain and offset of the straight line that brings predictions nearest to targets.
fn line<'a>(pairs: impl Iterator<Item = (&'a DepthMap, &'a DepthMap)>) -> [f64; 2] {
    let [mut n, mut x, mut y, mut xx, mut xy] = [0.0; 5];
    for (prediction, target) in pairs {
        for (&p, &t) in prediction.as_slice().iter().zip(target.as_slice()).filter(|(_, t)| t.is_finite()) {
            let (p, t) = (f64::from(p), f64::from(t));
            (n, x, y, xx, xy) = (n + 1.0, x + p, y + t, xx + p * p, xy + p * t);
        }
    }
    if n == 0.0 {
        return [1.0, 0.0];
    }
    let (spread, along) = (xx - x * x / n, xy - x * y / n);
    // A flat prediction has no slope; one that falls where the measurement rises is no scale.
    let gain = if spread > 1e-12 * xx.max(f64::MIN_POSITIVE) && along > 0.0 { along / spread } else { 1.0 };
    [gain, (y - gain * x) / n]
}

/// Parts of a correction that the pictures of one pad share: mean, mean residual, and gain of the deviation.
fn shared(one: &mut Correction, own: &[usize], on_line: &[Pixels], targets: &[Pixels]) {
    let [width, height] = one.mean.size();
    let n = own.len() as f64;
    let grid = |f: &dyn Fn(usize) -> f64| Grid::from_fn(width, height, |x, y| f(y * width + x));
    let mean = grid(&|i| own.iter().map(|&k| on_line[k][i]).sum::<f64>() / n);
    let residual = grid(&|i| own.iter().map(|&k| targets[k][i] - on_line[k][i]).sum::<f64>() / n);
    let smooth = gaussian(&residual, PATTERN_PX);
    let field = Grid::from_fn(width, height, |x, y| residual[(x, y)] - smooth[(x, y)] / (n + 1.0));
    let (m, r) = (mean.as_slice(), residual.as_slice());
    let both = grid(&|i| own.iter().map(|&k| (on_line[k][i] - m[i]) * (targets[k][i] - m[i] - r[i])).sum());
    let alone = grid(&|i| own.iter().map(|&k| (on_line[k][i] - m[i]).powi(2)).sum());
    let (both, alone) = (gaussian(&both, GAIN_PX), gaussian(&alone, GAIN_PX));
    let prior = GAIN_PRIOR * alone.as_slice().iter().sum::<f64>() / alone.len() as f64;
    let gain = |x: usize, y: usize| (both[(x, y)] + prior) / (alone[(x, y)] + prior);
    one.gain = Grid::from_fn(width, height, |x, y| if prior > 0.0 { gain(x, y) as f32 } else { 1.0 });
    (one.mean, one.field) = (mean.map(|&v| v as f32), field.map(|&v| v as f32));
}

#[cfg(test)]
mod tests;
