//! Where a pad's predictions belong in its pictures.

use super::{Case, GRAIN_PX};
use crate::domain::blur::gaussian;
use crate::domain::grid::{DepthMap, Grid};
use crate::domain::postprocess::moved;
use crate::domain::resample;

/// Farthest offset looked for, pixels of 128: three times what the rigs seen so far have.
const REACH_PX: isize = 24;
/// Finest step, pixels.
const FINEST_PX: f64 = 1.0 / 16.0;
/// Least correlation of predictions and measurements at which their offset means something.
const LEAST_CORRELATION: f64 = 0.2;

/// The offset `[right, down]` that makes predictions and measurements most alike, pixels; zero where nothing tells.
pub(super) fn offset(cases: &[&Case<'_>]) -> [f64; 2] {
    let Some(first) = cases.first() else { return [0.0; 2] };
    let [width, height] = first.prediction.size();
    if width < 16 || height < 16 {
        return [0.0; 2];
    }
    let targets: Vec<DepthMap> = cases.iter().map(|case| blurred(case)).collect();
    let predictions: Vec<&DepthMap> = cases.iter().map(|case| case.prediction).collect();
    // First all whole steps at half the size, then ever finer ones around the best.
    let half = |image: &DepthMap| resample::area(image, width / 2, height / 2);
    let small: (Vec<DepthMap>, Vec<DepthMap>) =
        (predictions.iter().map(|p| half(p)).collect(), targets.iter().map(half).collect());
    let small_refs: Vec<&DepthMap> = small.0.iter().collect();
    let reach = REACH_PX * width.min(height) as isize / 256;
    let whole = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| [dx as f64, dy as f64]));
    let scored = whole.map(|at| (likeness(&small_refs, &small.1, at, reach as usize), at));
    let Some((best, [dx, dy])) = scored.max_by(|a, b| a.0.total_cmp(&b.0)) else { return [0.0; 2] };
    if best < LEAST_CORRELATION {
        return [0.0; 2];
    }
    let border = 2 * reach as usize;
    let mut at = [2.0 * dx, 2.0 * dy];
    let mut score = likeness(&predictions, &targets, at, border);
    let mut step = 1.0;
    while step >= FINEST_PX {
        let around = [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]].map(|d| [at[0] + d[0], at[1] + d[1]]);
        let tried = around.map(|next| (likeness(&predictions, &targets, next, border), next));
        match tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((better, next)) if better > score => (score, at) = (better, next),
            _ => step /= 2.0,
        }
    }
    at
}

/// The target without the sensor's grain; where nothing was measured, the mean of the rest.
fn blurred(case: &Case<'_>) -> DepthMap {
    let finite = || case.target.as_slice().iter().filter(|v| v.is_finite());
    let mean = finite().map(|&v| f64::from(v)).sum::<f64>() / finite().count().max(1) as f64;
    let whole: Grid<f64> = case.target.map(|&v| if v.is_finite() { f64::from(v) } else { mean });
    gaussian(&whole, GRAIN_PX).map(|&v| v as f32)
}

/// Correlation of moved predictions with targets over all pictures, `border` pixels left out at each side.
fn likeness(predictions: &[&DepthMap], targets: &[DepthMap], by: [f64; 2], border: usize) -> f64 {
    let [mut n, mut x, mut y, mut xx, mut yy, mut xy] = [0.0; 6];
    for (prediction, target) in predictions.iter().zip(targets) {
        let there = moved(prediction, by);
        let [width, height] = target.size();
        for v in border..height - border {
            for u in border..width - border {
                let (p, t) = (f64::from(there[(u, v)]), f64::from(target[(u, v)]));
                (n, x, y, xx, yy, xy) = (n + 1.0, x + p, y + t, xx + p * p, yy + t * t, xy + p * t);
            }
        }
    }
    let (a, b) = (xx - x * x / n, yy - y * y / n);
    let found = (xy - x * y / n) / (a * b).sqrt();
    if found.is_finite() { found } else { -1.0 }
}
