//! Metrics of a picture whose scale was assumed that do not stretch it.
//!
//! Stretching both pictures to 0..1 stretches a measured one by its noise spikes and a prediction by its body, so that
//! even a simulator's own imprint without camera noise reaches no more than 20 dB. What a prediction is worth shows
//! beside it: as it is (`raw`), and after the straight line that fits best (`line`, the worth of its shape alone).

use serde::{Deserialize, Serialize};

use super::image::{MetricError, check_size, psnr_of_mse};
use super::{SsimRange, psnr, ssim};
use crate::grid::Grid;

/// Metrics that do not stretch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Unstretched {
    /// PSNR of the pictures as they are, dB; `None` for equal ones.
    pub psnr_raw_db: Option<f64>,
    /// SSIM likewise.
    pub ssim_raw: Option<f64>,
    /// PSNR after the straight line that brings the prediction nearest, dB.
    pub psnr_line_db: Option<f64>,
}

/// Of pictures in one unit, with the range that the source assumed as peak of the PSNR and range of the SSIM.
///
/// # Errors
/// If the sizes differ, no pixel is a number in both, or the range is not positive.
pub fn unstretched(prediction: &Grid<f32>, truth: &Grid<f32>, range: f64) -> Result<Unstretched, MetricError> {
    Ok(Unstretched {
        psnr_raw_db: psnr(prediction, truth, range)?,
        ssim_raw: ssim(prediction, truth, SsimRange::Explicit(range)).ok(),
        psnr_line_db: psnr_of_mse(line_mse(prediction, truth)?, range)?,
    })
}

/// The mean squared error that the best straight line of the prediction leaves.
fn line_mse(prediction: &Grid<f32>, truth: &Grid<f32>) -> Result<f64, MetricError> {
    check_size(prediction, truth)?;
    let pairs = || {
        let both = prediction.as_slice().iter().zip(truth.as_slice()).map(|(&p, &t)| (f64::from(p), f64::from(t)));
        both.filter(|(p, t)| p.is_finite() && t.is_finite())
    };
    let (n, x, y) = pairs().fold((0.0, 0.0, 0.0), |(n, x, y), (p, t)| (n + 1.0, x + p, y + t));
    if n == 0.0 {
        return Err(MetricError::Nothing);
    }
    let (x, y) = (x / n, y / n);
    let [xx, xy, yy] = pairs().fold([0.0; 3], |[xx, xy, yy], (p, t)| {
        [xx + (p - x) * (p - x), xy + (p - x) * (t - y), yy + (t - y) * (t - y)]
    });
    let explained = if xx > 0.0 { xy * xy / xx } else { 0.0 };
    Ok((yy - explained).max(0.0) / n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_forgiven_only_where_it_says_so() {
        let truth = Grid::from_fn(40, 30, |x, y| ((x * 7 + y * 3) % 11) as f32 / 11.0);
        let off = truth.map(|v| 0.5 * v + 0.3);
        let metrics = unstretched(&off, &truth, 1.0).unwrap();
        assert!(metrics.psnr_raw_db.unwrap() < 20.0 && metrics.psnr_line_db.is_none_or(|db| db > 100.0), "{metrics:?}");
        assert_eq!(unstretched(&truth, &truth, 1.0).unwrap().psnr_raw_db, None);
        // Noise of known size is what the line leaves: 20 dB for a tenth.
        let noisy = Grid::from_fn(40, 30, |x, y| truth[(x, y)] + if (x + y) % 2 == 0 { 0.1 } else { -0.1 });
        assert!((unstretched(&truth, &noisy, 1.0).unwrap().psnr_line_db.unwrap() - 20.0).abs() < 0.1);
        // A flat prediction is worth the truth's own spread.
        let flat = unstretched(&Grid::filled(40, 30, 7.0), &truth, 1.0).unwrap();
        assert!((flat.psnr_line_db.unwrap() - 10.0).abs() < 1.0, "{flat:?}");
        assert!(unstretched(&Grid::filled(3, 3, 0.0), &truth, 1.0).is_err());
        assert!(unstretched(&truth.map(|_| f32::NAN), &truth, 1.0).is_err());
    }
}
