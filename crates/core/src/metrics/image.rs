//! Pixel errors: MSE and PSNR, and the scaling to 0..1.

use crate::grid::Grid;

/// Why two images cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum MetricError {
    /// Different sizes `[width, height]` of prediction and truth.
    #[error("a prediction of {}x{} pixels cannot be compared with a truth of {}x{}", .0[0], .0[1], .1[0], .1[1])]
    Size([usize; 2], [usize; 2]),
    /// No pixel is a number in both images.
    #[error("no pixel is a number in both images")]
    Nothing,
    /// A range or peak that is zero, negative or not a number.
    #[error("the value range {0} is not a positive number")]
    Range(f64),
}

/// The mean squared difference over the pixels that are finite in both images, in squared units of the images.
///
/// # Errors
/// [`MetricError::Size`]; [`MetricError::Nothing`] if no pixel is left.
pub fn mse(prediction: &Grid<f32>, truth: &Grid<f32>) -> Result<f64, MetricError> {
    check_size(prediction, truth)?;
    let (mut sum, mut count) = (0.0, 0usize);
    for (&p, &t) in prediction.as_slice().iter().zip(truth.as_slice()) {
        if p.is_finite() && t.is_finite() {
            sum += (f64::from(p) - f64::from(t)).powi(2);
            count += 1;
        }
    }
    if count == 0 { Err(MetricError::Nothing) } else { Ok(sum / count as f64) }
}

/// Peak signal-to-noise ratio `20·log10(peak / √MSE)`, decibels; `None` for equal images, which must not be averaged with
/// others. The lab's peak is 0.0225 m; images scaled to 0..1 have 1.
///
/// # Errors
/// As [`mse`]; [`MetricError::Range`] for a peak that is not positive.
pub fn psnr(prediction: &Grid<f32>, truth: &Grid<f32>, peak: f64) -> Result<Option<f64>, MetricError> {
    psnr_of_mse(mse(prediction, truth)?, peak)
}

/// The PSNR of an error that was pooled over several images, as the lab does per tool.
///
/// # Errors
/// [`MetricError::Range`] for a peak that is not positive.
pub(crate) fn psnr_of_mse(mse: f64, peak: f64) -> Result<Option<f64>, MetricError> {
    if !(peak > 0.0 && peak.is_finite()) {
        return Err(MetricError::Range(peak));
    }
    Ok((mse != 0.0).then(|| 20.0 * peak.log10() - 10.0 * mse.log10()))
}

/// The image stretched so that its smallest finite value becomes 0 and its largest 1.
///
/// A constant image becomes 0 everywhere; NaN and infinities become NaN. Scale and offset errors are invisible
/// afterwards, so label every figure computed from it.
pub fn unit_range(image: &Grid<f32>) -> Grid<f32> {
    let finite = || image.as_slice().iter().copied().filter(|v| v.is_finite());
    let min = f64::from(finite().fold(f32::INFINITY, f32::min));
    let max = f64::from(finite().fold(f32::NEG_INFINITY, f32::max));
    image.map(|&v| {
        if !v.is_finite() {
            f32::NAN
        } else if max > min {
            ((f64::from(v) - min) / (max - min)) as f32
        } else {
            0.0
        }
    })
}

pub(super) fn check_size(prediction: &Grid<f32>, truth: &Grid<f32>) -> Result<(), MetricError> {
    let (found, expected) = (prediction.size(), truth.size());
    if found == expected { Ok(()) } else { Err(MetricError::Size(found, expected)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psnr_needs_a_peak_and_keeps_equal_images_apart() {
        let a = Grid::filled(4, 4, 0.5f32);
        let b = Grid::filled(4, 4, 0.25f32);
        assert_eq!(psnr(&a, &b, 1.0), Ok(Some(-10.0 * 0.0625f64.log10())));
        assert_eq!(psnr(&a, &a, 1.0), Ok(None));
        // The range decides the figure: 255 against 1 is 48.1 dB more.
        let difference = psnr(&a, &b, 255.0).unwrap().unwrap() - psnr(&a, &b, 1.0).unwrap().unwrap();
        assert!((difference - 20.0 * 255f64.log10()).abs() < 1e-9);
        for peak in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(psnr(&a, &b, peak), Err(MetricError::Range(_))));
        }
    }

    #[test]
    fn invalid_pixels_are_left_out() {
        let mut a = Grid::filled(3, 1, 1.0f32);
        let b = Grid::filled(3, 1, 0.0f32);
        a[(1, 0)] = f32::NAN;
        assert_eq!(mse(&a, &b), Ok(1.0));
        assert_eq!(mse(&Grid::filled(3, 1, f32::NAN), &b), Err(MetricError::Nothing));
        assert!(matches!(mse(&Grid::filled(1, 3, 0.0), &b), Err(MetricError::Size(..))));
        let empty = Grid::from_vec(0, 0, vec![]).unwrap();
        assert_eq!(mse(&empty, &empty), Err(MetricError::Nothing));
    }

    #[test]
    fn the_unit_range_is_reached_and_special_values_survive() {
        let scaled = unit_range(&Grid::from_vec(4, 1, vec![-2.0, f32::NAN, 6.0, 0.0]).unwrap());
        assert_eq!((scaled[(0, 0)], scaled[(2, 0)], scaled[(3, 0)]), (0.0, 1.0, 0.25));
        assert!(scaled[(1, 0)].is_nan());
        assert_eq!(unit_range(&Grid::filled(2, 2, 0.09)), Grid::filled(2, 2, 0.0));
        assert!(unit_range(&Grid::filled(2, 2, f32::INFINITY)).as_slice().iter().all(|v| v.is_nan()));
    }
}
