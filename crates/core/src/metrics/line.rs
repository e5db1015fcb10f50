//! The line through prediction against truth, pixel by pixel.

use crate::grid::Grid;

/// Parts of the truth's range that count alike, however many pixels each has.
const PARTS: usize = 64;
/// Pixels that make a part's median worth something, where there are parts with so many.
const ENOUGH: usize = 10;
/// A spread below this share of the values' size is rounding.
const RELATIVE_NO_SPREAD: f64 = 1e-6;

/// `prediction = slope · truth + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Prediction per truth; 1 is right.
    pub slope: f64,
    /// Prediction where the truth is 0, in the unit of the images; 0 is right.
    pub offset: f64,
}

/// The line through the pixels that are finite in both images, as they lie beside each other: the median slope between the
/// medians of equal parts of the truth's range (Theil and Sen). Every depth counts alike, though most pixels are the untouched
/// background, and wild pixels do not move it. In f64.
///
/// `None` if the truth has no spread, or nothing is finite.
pub fn line(prediction: &Grid<f32>, truth: &Grid<f32>) -> Option<Line> {
    let pairs = truth.as_slice().iter().zip(prediction.as_slice());
    through(
        pairs.map(|(&t, &p)| [f64::from(t), f64::from(p)]).filter(|p| p[0].is_finite() && p[1].is_finite()).collect(),
    )
}

/// The line through finite `[truth, prediction]` pairs.
fn through(mut sorted: Vec<[f64; 2]>) -> Option<Line> {
    sorted.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let (first, last) = (sorted.first()?[0], sorted.last()?[0]);
    if last - first <= RELATIVE_NO_SPREAD * first.abs().max(last.abs()) {
        return None;
    }
    let part = |t: f64| (((t - first) / (last - first) * PARTS as f64) as usize).min(PARTS - 1);
    let mut knots: Vec<([f64; 2], usize)> = sorted
        .chunk_by(|a, b| part(a[0]) == part(b[0]))
        .filter_map(|chunk| {
            let of = |axis: usize| median(&mut chunk.iter().map(|p| p[axis]).collect::<Vec<_>>());
            Some(([of(0)?, of(1)?], chunk.len()))
        })
        .collect();
    if knots.iter().filter(|(_, pixels)| *pixels >= ENOUGH).count() >= 3 {
        knots.retain(|(_, pixels)| *pixels >= ENOUGH);
    }
    let mut slopes = Vec::new();
    for (i, (a, _)) in knots.iter().enumerate() {
        slopes.extend(knots[..i].iter().map(|(b, _)| (a[1] - b[1]) / (a[0] - b[0])).filter(|s| s.is_finite()));
    }
    let slope = median(&mut slopes)?;
    let offset = median(&mut knots.iter().map(|(p, _)| p[1] - slope * p[0]).collect::<Vec<_>>())?;
    [slope, offset].iter().all(|v| v.is_finite()).then_some(Line { slope, offset })
}

/// The middle value, or the mean of the two middle ones: then the medians of both coordinates of points on a line are
/// a point of the line.
fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    let odd = values.len() % 2 == 1;
    let (below, upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let upper = *upper;
    if odd { Some(upper) } else { below.iter().copied().reduce(f64::max).map(|lower| (lower + upper) / 2.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// An imprint's truth: mostly nothing, some depth.
    fn truth() -> Grid<f32> {
        Grid::from_fn(60, 50, |x, y| if x > 40 { 1e-4 * (x + y) as f32 } else { 1e-6 * ((x * 7 + y) % 11) as f32 })
    }

    #[test]
    fn a_fifth_of_wild_pixels_does_not_move_the_line() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let truth = truth();
        let prediction = truth.map(|d| {
            let noise = rng.random_range(-1e-4..1e-4);
            if rng.random_bool(0.2) { rng.random_range(-0.01..0.03) } else { 0.8 * d + 0.001 + noise }
        });
        let line = line(&prediction, &truth).unwrap();
        assert!((line.slope - 0.8).abs() < 0.02 && (line.offset - 0.001).abs() < 1e-4, "{line:?}");
    }

    #[test]
    fn images_without_a_slope_have_none() {
        let flat = Grid::filled(8, 8, 0.004f32);
        assert_eq!(line(&truth().map(|_| 0.1), &truth().map(|_| 0.004)), None);
        assert_eq!(line(&flat, &flat), None);
        // A flat prediction of a truth with depth has one: zero.
        let level = line(&truth().map(|_| 0.004), &truth()).unwrap();
        assert!(level.slope.abs() < 1e-9 && (level.offset - 0.004).abs() < 1e-6);
        assert_eq!(line(&Grid::filled(8, 8, f32::NAN), &flat), None);
        assert_eq!(through(vec![[0.001, 0.002]]), None);
    }
}
