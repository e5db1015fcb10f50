//! Color pictures against each other: the metrics of one plane, over three.

use super::{MetricError, SsimRange, psnr, ssim};
use crate::grid::{Grid, RgbGrid};

/// Peak and range of difference images on the 0..255 scale.
pub const LEVELS: f64 = 255.0;

/// Red, green and blue as three planes, one below the other, times `scale`.
pub fn planes(picture: &RgbGrid, scale: f64) -> Grid<f32> {
    let height = picture.height().max(1);
    Grid::from_fn(picture.width(), 3 * picture.height(), |x, y| {
        (f64::from(picture[(x, y % height)][y / height]) * scale) as f32
    })
}

/// PSNR over all channels and the mean of their SSIM, with peak and range [`LEVELS`]; of difference images of one size.
///
/// # Errors
/// As [`psnr()`] and [`ssim()`].
pub fn color(prediction: &RgbGrid, truth: &RgbGrid) -> Result<(Option<f64>, f64), MetricError> {
    let psnr = psnr(&planes(prediction, 1.0), &planes(truth, 1.0), LEVELS)?;
    let mut similar = 0.0;
    for channel in 0..3 {
        let plane = |picture: &RgbGrid| picture.map(|pixel| pixel[channel]);
        similar += ssim(&plane(prediction), &plane(truth), SsimRange::Explicit(LEVELS))? / 3.0;
    }
    Ok((psnr, similar))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_of_one_channel_is_pooled_over_three() {
        let truth = RgbGrid::from_fn(32, 24, |x, y| [x as f32, y as f32, (x * y % 7) as f32]);
        let prediction = truth.map(|p| [p[0] + 30.0, p[1], p[2]]);
        let (psnr, ssim) = color(&prediction, &truth).unwrap();
        // 20 log10(255) - 10 log10(900 / 3)
        assert!((psnr.unwrap() - 23.36).abs() < 0.01, "{psnr:?}");
        // Two channels are equal, the third is not.
        assert!(ssim > 0.667 && ssim < 0.99, "{ssim}");
        assert_eq!(planes(&truth, 2.0)[(3, 24 + 5)], 10.0);
        assert!(color(&prediction, &RgbGrid::filled(3, 3, [0.0; 3])).is_err());
    }
}
