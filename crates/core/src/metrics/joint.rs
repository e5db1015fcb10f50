//! Prediction against truth, pixel by pixel: the joint histogram and the line through it.

use crate::grid::Grid;

use super::MetricError;
use super::image::check_size;

/// Parts of the truth's range that count alike, however many pixels each has.
const PARTS: usize = 64;
/// Pixels that make a part's median worth something, where there are parts with so many.
const ENOUGH: usize = 10;
/// A normal distribution's deviation in median absolute deviations.
const MAD: f64 = 1.4826;
/// A spread below this share of the values' size is rounding.
const RELATIVE_NO_SPREAD: f64 = 1e-6;
/// Half the range of a histogram of equal values, meters.
const HALF_RANGE_M: f64 = 5e-4;

/// Joint histogram: number of pixels by truth and prediction.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// `counts[(truth bin, prediction bin)]`, from [`Joint::lo`] to [`Joint::hi`] on both axes.
    pub counts: Grid<u32>,
    /// Lower end of both axes, in the unit of the images.
    pub lo: f64,
    /// Upper end of both axes.
    pub hi: f64,
    /// Pixels that are finite in both images.
    pub pixels: usize,
    /// The line; `None` where the truth has no spread to fit a slope to.
    pub line: Option<Line>,
}

/// `prediction = slope · truth + offset`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Line {
    /// Prediction per truth; 1 is right.
    pub slope: f64,
    /// Prediction where the truth is 0, in the unit of the images; 0 is right.
    pub offset: f64,
    /// Robust deviation of the pixels from the line, in the unit of the images.
    pub deviation: f64,
}

impl Joint {
    /// Of the pixels that are finite in both images, with `bins × bins` bins.
    ///
    /// # Errors
    /// [`MetricError::Size`]; [`MetricError::Nothing`] without a pixel, or without bins.
    pub fn of(prediction: &Grid<f32>, truth: &Grid<f32>, bins: usize) -> Result<Self, MetricError> {
        check_size(prediction, truth)?;
        let pairs: Vec<[f64; 2]> = truth
            .as_slice()
            .iter()
            .zip(prediction.as_slice())
            .filter(|(t, p)| t.is_finite() && p.is_finite())
            .map(|(&t, &p)| [f64::from(t), f64::from(p)])
            .collect();
        if pairs.is_empty() || bins == 0 {
            return Err(MetricError::Nothing);
        }
        let values = || pairs.iter().flatten().copied();
        let (mut lo, mut hi) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        if hi - lo <= RELATIVE_NO_SPREAD * hi.abs().max(lo.abs()) {
            (lo, hi) = (lo - HALF_RANGE_M, hi + HALF_RANGE_M);
        }
        let mut counts = Grid::filled(bins, bins, 0u32);
        let bin = |v: f64| (((v - lo) / (hi - lo) * bins as f64) as usize).min(bins - 1);
        for [t, p] in &pairs {
            counts[(bin(*t), bin(*p))] += 1;
        }
        Ok(Self { counts, lo, hi, pixels: pairs.len(), line: line(&pairs) })
    }
}

/// The line through `[truth, prediction]` pairs: the median slope between the medians of equal parts of the truth's
/// range (Theil and Sen). Every depth counts alike, though most pixels are the untouched background, and wild pixels
/// do not move it. In f64.
///
/// `None` if the truth has no spread, or nothing is finite.
pub fn line(pairs: &[[f64; 2]]) -> Option<Line> {
    let mut sorted: Vec<[f64; 2]> = pairs.iter().copied().filter(|p| p[0].is_finite() && p[1].is_finite()).collect();
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
    let deviation = MAD * median(&mut sorted.iter().map(|p| (p[1] - slope * p[0] - offset).abs()).collect::<Vec<_>>())?;
    [slope, offset, deviation].iter().all(|v| v.is_finite()).then_some(Line { slope, offset, deviation })
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
    use proptest::prelude::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// An imprint's truth: mostly nothing, some depth.
    fn truth() -> Grid<f32> {
        Grid::from_fn(60, 50, |x, y| if x > 40 { 1e-4 * (x + y) as f32 } else { 1e-6 * ((x * 7 + y) % 11) as f32 })
    }

    #[test]
    fn the_doubled_mapping_shows_as_slope_and_offset() {
        let truth = truth();
        let joint = Joint::of(&truth.map(|d| d / 2.0 + 0.01125), &truth, 64).unwrap();
        let line = joint.line.unwrap();
        assert!((line.slope - 0.5).abs() < 1e-4 && (line.offset - 0.01125).abs() < 1e-6, "{line:?}");
        assert!(line.deviation < 1e-7);
        assert_eq!(joint.counts.as_slice().iter().sum::<u32>() as usize, joint.pixels);
        // Below the diagonal of the histogram nothing lies: every prediction is too deep.
        let below = (0..64).flat_map(|t| (0..t).map(move |p| (t, p))).map(|bins| joint.counts[bins]).sum::<u32>();
        assert_eq!(below, 0);
    }

    #[test]
    fn a_fifth_of_wild_pixels_does_not_move_the_line() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let truth = truth();
        let prediction = truth.map(|d| {
            let noise = rng.random_range(-1e-4..1e-4);
            if rng.random_bool(0.2) { rng.random_range(-0.01..0.03) } else { 0.8 * d + 0.001 + noise }
        });
        let line = Joint::of(&prediction, &truth, 16).unwrap().line.unwrap();
        assert!((line.slope - 0.8).abs() < 0.02 && (line.offset - 0.001).abs() < 1e-4, "{line:?}");
    }

    #[test]
    fn images_without_a_slope_have_none() {
        let flat = Grid::filled(8, 8, 0.004f32);
        let joint = Joint::of(&truth().map(|_| 0.1), &truth().map(|_| 0.004), 8).unwrap();
        assert!(joint.line.is_none() && joint.pixels == 3000);
        let same = Joint::of(&flat, &flat, 8).unwrap();
        assert!(same.line.is_none() && same.lo < same.hi);
        // A flat prediction of a truth with depth has one: zero.
        let line = Joint::of(&truth().map(|_| 0.004), &truth(), 8).unwrap().line.unwrap();
        assert!(line.slope.abs() < 1e-9 && (line.offset - 0.004).abs() < 1e-6);
        let holes = Grid::filled(8, 8, f32::NAN);
        assert_eq!(Joint::of(&holes, &flat, 8), Err(MetricError::Nothing));
        assert_eq!(Joint::of(&flat, &flat, 0), Err(MetricError::Nothing));
        assert!(matches!(Joint::of(&flat, &truth(), 8), Err(MetricError::Size { .. })));
        assert_eq!(line_of_one(), None);
    }

    fn line_of_one() -> Option<Line> {
        line(&[[0.001, 0.002]])
    }

    proptest! {
        #[test]
        fn whatever_comes_the_line_is_finite(values in prop::collection::vec(any::<(f32, f32)>(), 0..60)) {
            let pairs: Vec<[f64; 2]> = values.iter().map(|&(a, b)| [f64::from(a), f64::from(b)]).collect();
            if let Some(line) = line(&pairs) {
                prop_assert!(line.slope.is_finite() && line.offset.is_finite() && line.deviation.is_finite());
            }
        }

        #[test]
        fn an_exact_line_is_found(slope in -3.0f64..3.0, offset in -0.05f64..0.05) {
            let pairs: Vec<[f64; 2]> = (0..500).map(|i| { let t = 2e-5 * f64::from(i); [t, slope * t + offset] }).collect();
            let line = line(&pairs).unwrap();
            prop_assert!((line.slope - slope).abs() < 1e-9 && (line.offset - offset).abs() < 1e-9, "{:?}", line);
        }
    }
}
