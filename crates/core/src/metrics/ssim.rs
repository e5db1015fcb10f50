//! Structural similarity with a stated range, as the lab averages it.

use crate::grid::Grid;

use super::MetricError;
use super::image::check_size;

/// Pixels across the window.
const WINDOW: usize = 11;
/// Standard deviation of the window, pixels.
const SIGMA: f64 = 1.5;
const K1: f64 = 0.01;
const K2: f64 = 0.03;

/// The `L` of the formula; the score depends on it strongly (one pair: 0.13 or 0.82).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SsimRange {
    /// A stated range, in the unit of the images: 0.0225 m for the lab's depth, 1 for images scaled to 0..1.
    Explicit(f64),
    /// The lab's: largest minus smallest value of the *prediction*. Label it; a flat prediction has none.
    OfPrediction,
}

/// Structural similarity with an 11 × 11 Gaussian window (σ = 1.5), zero padding of 5 pixels, K1 = 0.01, K2 = 0.03: the mean
/// of its map, borders included. Pixels that are not finite in one of the images count as equal.
///
/// A common offset is taken out before the variances are formed, so that they do not cancel.
///
/// # Errors
/// [`MetricError::Size`], [`MetricError::Nothing`], and [`MetricError::Range`] for a range that is not positive
/// (a flat prediction with [`SsimRange::OfPrediction`]).
///
/// # Source
/// Wang et al. 2004; window, padding and borders as in the lab's `ssim.py` lines 9-210. Checked against an independent
/// implementation: `tests/data/ssim.json`.
pub fn ssim(prediction: &Grid<f32>, truth: &Grid<f32>, range: SsimRange) -> Result<f64, MetricError> {
    check_size(prediction, truth)?;
    let valid = |p: f32, t: f32| p.is_finite() && t.is_finite();
    let pairs = || prediction.as_slice().iter().zip(truth.as_slice()).map(|(&p, &t)| (p, t));
    let used = pairs().filter(|&(p, t)| valid(p, t)).count();
    if used == 0 {
        return Err(MetricError::Nothing);
    }
    let offset = pairs().filter(|&(p, t)| valid(p, t)).map(|(_, t)| f64::from(t)).sum::<f64>() / used as f64;
    let range = match range {
        SsimRange::Explicit(range) => range,
        SsimRange::OfPrediction => {
            let values = || pairs().filter(|&(p, t)| valid(p, t)).map(|(p, _)| f64::from(p));
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        }
    };
    if !(range > 0.0 && range.is_finite()) {
        return Err(MetricError::Range(range));
    }

    let (width, height) = (prediction.width(), prediction.height());
    // Ignored pixels take the truth's mean in both images.
    let centered = |pick: fn((f32, f32)) -> f32| -> Vec<f64> {
        pairs().map(|(p, t)| if valid(p, t) { f64::from(pick((p, t))) - offset } else { 0.0 }).collect()
    };
    let (p, t) = (centered(|(p, _)| p), centered(|(_, t)| t));
    let product = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
    // Outside the image the lab pads with zero, which is -offset once the offset is taken out.
    let blur = |values: &[f64], outside: f64| convolve(values, width, height, outside);
    let (mean_p, mean_t) = (blur(&p, -offset), blur(&t, -offset));
    let squared = offset * offset;
    let (pp, tt, pt) =
        (blur(&product(&p, &p), squared), blur(&product(&t, &t), squared), blur(&product(&p, &t), squared));

    let (c1, c2) = ((K1 * range).powi(2), (K2 * range).powi(2));
    let scores: Vec<f64> = (0..p.len())
        .map(|i| {
            let (mp, mt) = (mean_p[i], mean_t[i]);
            let (vp, vt, cov) = ((pp[i] - mp * mp).max(0.0), (tt[i] - mt * mt).max(0.0), pt[i] - mp * mt);
            let (mp, mt) = (mp + offset, mt + offset);
            (2.0 * mp * mt + c1) * (2.0 * cov + c2) / ((mp * mp + mt * mt + c1) * (vp + vt + c2))
        })
        .collect();
    Ok(scores.iter().sum::<f64>() / scores.len() as f64)
}

/// The normalized Gaussian of the window, one axis.
fn window() -> [f64; WINDOW] {
    let mut weights = std::array::from_fn(|i| {
        let x = i as f64 - (WINDOW / 2) as f64;
        (-x * x / (2.0 * SIGMA * SIGMA)).exp()
    });
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= sum);
    weights
}

/// The windowed mean of each pixel, with `outside` beyond the borders.
fn convolve(values: &[f64], width: usize, height: usize, outside: f64) -> Vec<f64> {
    let weights = window();
    let pass = |source: &[f64], length: usize, stride: usize, start: usize, out: &mut [f64]| {
        for i in 0..length {
            out[start + i * stride] = weights
                .iter()
                .enumerate()
                .map(|(k, w)| {
                    let j = (i + k).wrapping_sub(WINDOW / 2);
                    w * if j < length { source[start + j * stride] } else { outside }
                })
                .sum();
        }
    };
    let mut rows = vec![0.0; values.len()];
    for y in 0..height {
        pass(values, width, 1, y * width, &mut rows);
    }
    let mut out = vec![0.0; values.len()];
    for x in 0..width {
        pass(&rows, height, width, x, &mut out);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn textured(offset: f32) -> (Grid<f32>, Grid<f32>) {
        let truth = Grid::from_fn(31, 24, |x, y| offset + 0.01 * ((x as f32 * 0.4).sin() + (y as f32 * 0.3).cos()));
        let prediction = Grid::from_fn(31, 24, |x, y| truth[(x, y)] + 0.002 * ((x * 7 + y * 5) % 11) as f32 - 0.01);
        (prediction, truth)
    }

    fn grid(case: &Value, key: &str) -> Grid<f32> {
        let data = case[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap() as f32).collect();
        let size = |k: &str| case[k].as_u64().unwrap() as usize;
        Grid::from_vec(size("width"), size("height"), data).unwrap()
    }

    #[test]
    fn agrees_with_an_independent_implementation() {
        let reference: Value = serde_json::from_str(include_str!("../../tests/data/ssim.json")).unwrap();
        for case in reference["cases"].as_array().unwrap() {
            let range = match case["range"].as_f64() {
                Some(range) => SsimRange::Explicit(range),
                None => SsimRange::OfPrediction,
            };
            let similarity = ssim(&grid(case, "prediction"), &grid(case, "truth"), range).unwrap();
            let expected = case["ssim"].as_f64().unwrap();
            // Both sides work in f64 on the same f32 pixels.
            assert!((similarity - expected).abs() < 1e-9, "{similarity} for {expected}");
        }
    }

    #[test]
    fn the_psnr_is_that_of_scikit_image() {
        let reference: Value = serde_json::from_str(include_str!("../../tests/data/scikit_image.json")).unwrap();
        for case in reference["images"].as_array().unwrap() {
            let value = |key: &str| case[key].as_f64().unwrap();
            let (prediction, truth, range) = (grid(case, "prediction"), grid(case, "truth"), value("range"));
            let db = super::super::psnr(&prediction, &truth, range).unwrap().unwrap();
            assert!((db - value("psnr")).abs() < 1e-6, "{db} for {}", value("psnr"));
        }
    }

    #[test]
    fn invalid_pixels_count_as_equal() {
        let (mut prediction, truth) = textured(0.0);
        prediction[(3, 3)] = f32::NAN;
        let similarity = ssim(&prediction, &truth, SsimRange::Explicit(0.0225)).unwrap();
        assert!(similarity.is_finite());
        let none = Grid::filled(31, 24, f32::NAN);
        assert_eq!(ssim(&none, &truth, SsimRange::Explicit(1.0)), Err(MetricError::Nothing));
    }
}
