//! Metrics of a prediction apart for what the GelSlim saw and for what the model made up.

use serde::{Deserialize, Serialize};

use crate::grid::{Grid, Mask};

use super::image::{check_size, psnr_of_mse};
use super::{MetricError, SsimRange, ssim};

/// Metrics over some of an image's pixels; those that are not finite in both images are left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PixelMetrics {
    /// Pixels compared.
    pub pixels: usize,
    /// Peak signal-to-noise ratio, decibels; `None` without a pixel, or if they are all equal.
    pub psnr_db: Option<f64>,
    /// Mean of the structural similarity's map over these pixels; `None` if it is not defined.
    pub ssim: Option<f64>,
    /// Mean absolute error, in the unit of the images (written out, these are meters); `None` without a pixel.
    #[serde(rename = "mae_m")]
    pub mae: Option<f64>,
    /// Mean error (prediction minus truth), in the unit of the images (written out, meters); `None` without a pixel.
    #[serde(rename = "bias_m")]
    pub bias: Option<f64>,
}

/// Figures over the whole image, and over its two parts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Split {
    /// All pixels.
    pub whole: PixelMetrics,
    /// Inside the GelSlim's footprint: the model saw this.
    pub seen: PixelMetrics,
    /// Outside: the model made this up.
    pub invented: PixelMetrics,
}

/// The figures of a prediction (raw orientation) whole and by parts. `peak` is PSNR's peak and SSIM's range.
///
/// # Errors
/// [`MetricError::Size`]; [`MetricError::Nothing`] if no pixel is finite in both; [`MetricError::Range`] for a peak that
/// is not positive.
pub fn split(prediction: &Grid<f32>, truth: &Grid<f32>, seen: &Mask, peak: f64) -> Result<Split, MetricError> {
    check_size(prediction, truth)?;
    if seen.size() != truth.size() {
        return Err(MetricError::Size(seen.size(), truth.size()));
    }
    let map = ssim(prediction, truth, SsimRange::Explicit(peak))?.map;
    let figures = |wanted: &dyn Fn(bool) -> bool| -> Result<PixelMetrics, MetricError> {
        let (mut pixels, mut squares, mut sizes, mut sum, mut similarity) = (0usize, 0.0, 0.0, 0.0, 0.0);
        let places = prediction.as_slice().iter().zip(truth.as_slice()).zip(map.as_slice()).zip(seen.as_slice());
        for (((&p, &t), &s), _) in places.filter(|(_, seen)| wanted(**seen)) {
            let error = f64::from(p) - f64::from(t);
            if error.is_finite() {
                pixels += 1;
                squares += error * error;
                sizes += error.abs();
                sum += error;
                similarity += f64::from(s);
            }
        }
        let mean = |total: f64| (pixels > 0).then(|| total / pixels as f64);
        let psnr_db = mean(squares).map(|mse| psnr_of_mse(mse, peak)).transpose()?.flatten();
        Ok(PixelMetrics { pixels, psnr_db, ssim: mean(similarity), mae: mean(sizes), bias: mean(sum) })
    };
    Ok(Split { whole: figures(&|_| true)?, seen: figures(&|seen| seen)?, invented: figures(&|seen| !seen)? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::{Rig, lab};

    const SIZE: [usize; 2] = [lab::BUBBLE.width, lab::BUBBLE.height];

    #[test]
    fn the_footprint_is_where_the_paper_draws_it() {
        let rig = Rig::lab();
        for finger in rig.pads() {
            let mask = rig.seen_mask(finger, SIZE).unwrap();
            let [_, _, w, h] = rig.color_window(finger).unwrap().rectangle();
            let count = mask.as_slice().iter().filter(|s| **s).count() as f64;
            assert!((count / (w * h) - 1.0).abs() < 0.05, "{count}");
            // The same part of an image of another size.
            let small = rig.seen_mask(finger, [128, 128]).unwrap();
            let share = small.as_slice().iter().filter(|s| **s).count() as f64 / (128.0 * 128.0);
            assert!((share - w * h / (175.0 * 140.0)).abs() < 0.01, "{share}");
        }
    }

    #[test]
    fn an_error_outside_the_footprint_leaves_the_seen_part_clean() {
        let truth = Grid::from_fn(SIZE[0], SIZE[1], |x, y| 1e-4 * ((x * y) % 50) as f32);
        let seen = Rig::lab().seen_mask(lab::RIGHT, SIZE).unwrap();
        let mut prediction = truth.clone();
        for (p, s) in prediction.as_mut_slice().iter_mut().zip(seen.as_slice()) {
            *p += if *s { 0.0 } else { -0.001 };
        }
        let metrics = split(&prediction, &truth, &seen, 0.0225).unwrap();
        assert_eq!((metrics.seen.mae, metrics.seen.bias, metrics.seen.psnr_db), (Some(0.0), Some(0.0), None));
        assert!((metrics.invented.mae.unwrap() - 0.001).abs() < 1e-8);
        assert!((metrics.invented.bias.unwrap() + 0.001).abs() < 1e-8);
        assert!((metrics.invented.psnr_db.unwrap() - 27.04).abs() < 0.01);
        assert!(metrics.seen.ssim.unwrap() > metrics.invented.ssim.unwrap());
        assert_eq!(metrics.seen.pixels + metrics.invented.pixels, metrics.whole.pixels);
        let n = |f: PixelMetrics| f.pixels as f64;
        let mean = (n(metrics.seen) * metrics.seen.mae.unwrap() + n(metrics.invented) * metrics.invented.mae.unwrap())
            / n(metrics.whole);
        assert!((metrics.whole.mae.unwrap() - mean).abs() < 1e-12);
    }

    #[test]
    fn parts_without_a_pixel_have_no_figures() {
        let image = Grid::filled(8, 8, 0.001f32);
        let all = Grid::filled(8, 8, true);
        let metrics = split(&image, &image.map(|v| v + 0.001), &all, 0.0225).unwrap();
        assert_eq!(metrics.invented, PixelMetrics { pixels: 0, psnr_db: None, ssim: None, mae: None, bias: None });
        let holes = Grid::filled(8, 8, f32::NAN);
        assert_eq!(split(&holes, &image, &all, 0.0225), Err(MetricError::Nothing));
        assert!(split(&image, &image, &Grid::filled(4, 4, true), 0.0225).is_err());
        assert!(matches!(split(&image, &image, &all, 0.0), Err(MetricError::Range(_))));
    }
}
