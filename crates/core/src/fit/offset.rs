//! Offset of a pad's predictions from where they belong in its pictures.

use super::{FitPair, GRAIN_PX};
use crate::blur::gaussian;
use crate::grid::{DepthMap, Grid};
use crate::resample;
use crate::resample::moved;

/// Farthest offset of all pads together, share of the picture's side: three times what the rigs seen so far have.
const REACH: f64 = 24.0 / 128.0;
/// Farthest offset of one pad from that of all: twice what was seen. A few pairs of one pad alone mislead.
const APART: f64 = 8.0 / 128.0;
/// Finest step, pixels.
const FINEST_PX: f64 = 1.0 / 16.0;
/// Least correlation of predictions and measurements at which their offset means something.
const LEAST_CORRELATION: f64 = 0.2;

/// The offset `[right, down]` of each pad, pixels: what makes its predictions and measurements most alike, near what does
/// so for all pads together.
pub fn offsets(cases: &[FitPair<'_>], pads: usize) -> Vec<[f64; 2]> {
    let all: Vec<&FitPair<'_>> = cases.iter().collect();
    let together = offset(&all, [0.0; 2], REACH);
    let of_pad = |pad: usize| cases.iter().filter(|case| case.pad == pad).collect::<Vec<_>>();
    (0..pads).map(|pad| offset(&of_pad(pad), together, APART)).collect()
}

/// The best offset within `reach` (share of the side) of `start`; the start itself where nothing tells.
fn offset(cases: &[&FitPair<'_>], start: [f64; 2], reach: f64) -> [f64; 2] {
    let Some(first) = cases.first() else { return start };
    let [width, height] = first.prediction.size();
    let side = width.min(height) as f64;
    if side < 16.0 {
        return start;
    }
    let targets: Vec<DepthMap> = cases.iter().map(|case| blurred(case)).collect();
    let predictions: Vec<&DepthMap> = cases.iter().map(|case| case.prediction).collect();
    // First all whole steps at half the size, then ever finer ones around the best.
    let half = |image: &DepthMap| resample::area(image, width / 2, height / 2);
    let small: (Vec<DepthMap>, Vec<DepthMap>) =
        (predictions.iter().map(|p| half(p)).collect(), targets.iter().map(half).collect());
    let small_refs: Vec<&DepthMap> = small.0.iter().collect();
    let steps = (reach * side / 2.0) as isize;
    let from = start.map(|v| (v / 2.0).round());
    let whole =
        (-steps..=steps).flat_map(|dy| (-steps..=steps).map(move |dx| [from[0] + dx as f64, from[1] + dy as f64]));
    let border = (REACH * side / 2.0) as usize;
    let scored = whole.map(|offset| (likeness(&small_refs, &small.1, offset, border), offset));
    let Some((best, [dx, dy])) = scored.max_by(|a, b| a.0.total_cmp(&b.0)) else { return start };
    if best < LEAST_CORRELATION {
        return start;
    }
    let border = 2 * border;
    let mut offset = [2.0 * dx, 2.0 * dy];
    let mut score = likeness(&predictions, &targets, offset, border);
    let mut step = 1.0;
    while step >= FINEST_PX {
        let around =
            [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]].map(|d| [offset[0] + d[0], offset[1] + d[1]]);
        let tried = around.map(|next| (likeness(&predictions, &targets, next, border), next));
        let near = |offset: &[f64; 2]| offset.iter().zip(start).all(|(a, b)| (a - b).abs() <= reach * side);
        match tried.into_iter().filter(|(_, offset)| near(offset)).max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((better, next)) if better > score => (score, offset) = (better, next),
            _ => step /= 2.0,
        }
    }
    offset
}

/// The target without the sensor's grain; where nothing was measured, the mean of the rest.
fn blurred(case: &FitPair<'_>) -> DepthMap {
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
    let correlation = (xy - x * y / n) / (a * b).sqrt();
    if correlation.is_finite() { correlation } else { -1.0 }
}
