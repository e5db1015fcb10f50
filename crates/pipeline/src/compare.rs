//! Imprints of the same touch against each other: [`between`], and a prediction against the measurement: [`of_pad`].

pub mod depict;
pub mod deviation;
pub mod subject;

use std::borrow::Cow;

use crate::error::TaskError;
use crate::io::dataset::{ASSUMED_IMPRINT_RANGE_M, Dataset, assumed_meters, imprint_from_tile};
use crate::io::error::FileError;
use crate::steps::imprint::picture_of;
use crate::steps::prediction::Prediction;
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::metrics::{self, SsimRange, Unstretched};
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::resample::bilinear;
use touch2touch_core::rig::{PadId, Rig};
use touch2touch_core::sample::{Sample, Scale};

/// The peak of the lab's PSNR, meters.
pub const LAB_PEAK_M: f64 = 0.0225;

/// A prediction against the measurement of the same touch.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Predicted minus measured, meters; NaN where either is.
    pub error: DepthMap,
    /// Peak signal-to-noise ratio as the lab computes it, decibels; `None` if it is not defined.
    pub psnr_db: Option<f64>,
    /// Structural similarity as the lab computes it; `None` if it is not defined.
    pub ssim: Option<f64>,
    /// Mean absolute error, meters; NaN without a pixel to compare.
    pub mae_m: f64,
    /// With an assumed scale, the metrics of the pictures as they are, beside those of the stretched ones.
    pub unstretched: Option<Unstretched>,
    /// Scale that PSNR and SSIM are of: meters, or (assumed scale) images stretched to 0..1 each.
    pub scale: Scale,
}

/// A prediction against the measurement. With an assumed scale both are stretched to 0..1 first.
///
/// # Errors
/// If the sizes differ or no pixel is left to compare.
pub fn compare(predicted: &DepthMap, measured: &DepthMap, scale: Scale) -> Result<Comparison, TaskError> {
    let fail = |err: metrics::MetricError| TaskError::from_error("Compare prediction and measurement", &err);
    let mut sum = 0.0;
    let mut count = 0usize;
    let sizes_equal = predicted.size() == measured.size();
    let error = Grid::from_fn(measured.width(), measured.height(), |x, y| {
        let difference = if sizes_equal { predicted[(x, y)] - measured[(x, y)] } else { f32::NAN };
        if difference.is_finite() {
            sum += f64::from(difference.abs());
            count += 1;
        }
        difference
    });
    let mut unstretched = None;
    let (psnr, ssim) = match scale {
        Scale::Measured => (
            metrics::psnr(predicted, measured, LAB_PEAK_M).map_err(fail)?,
            metrics::ssim(predicted, measured, SsimRange::Explicit(LAB_PEAK_M)),
        ),
        Scale::Assumed => {
            let [lo, hi] = ASSUMED_IMPRINT_RANGE_M;
            unstretched = Some(metrics::unstretched(predicted, measured, hi - lo).map_err(fail)?);
            let (p, m) = (metrics::unit_range(predicted), metrics::unit_range(measured));
            (metrics::psnr(&p, &m, 1.0).map_err(fail)?, metrics::ssim(&p, &m, SsimRange::Explicit(1.0)))
        }
    };
    Ok(Comparison {
        error,
        psnr_db: psnr,
        ssim: ssim.ok(),
        mae_m: if count == 0 { f64::NAN } else { sum / count as f64 },
        unstretched,
        scale,
    })
}

/// The picture that a pair's imprint was made from, in the assumed meters and as the file has it; `None` where imprints
/// were measured.
///
/// # Errors
/// If it cannot be read.
pub fn tile_of(dataset: &Dataset, id: PairId, sample: &Sample) -> Result<Option<DepthMap>, TaskError> {
    let fail = |err: FileError| TaskError::from_error("Compare prediction and measurement", &err).with_hint(err.hint);
    Ok(dataset.bubble_tile(id, sample.laid).map_err(fail)?.as_ref().map(assumed_meters))
}

/// The prediction of another program that lies beside a pair as a picture, in the assumed meters.
#[derive(Clone, Debug, PartialEq)]
pub struct Beside {
    /// As the file has it.
    pub tile: DepthMap,
    /// As large and turned as the measured imprint.
    pub imprint: DepthMap,
}

/// The prediction that lies beside a pair as a picture; `None` where there is none.
///
/// # Errors
/// If it cannot be read.
pub fn beside(dataset: &Dataset, id: PairId, sample: &Sample) -> Result<Option<Beside>, TaskError> {
    let fail = |err: FileError| TaskError::from_error("Stored picture", &err).with_hint(err.hint);
    let tile = dataset.vqvae_tile(id, sample.laid).map_err(fail)?;
    let both = |tile| Beside { tile: assumed_meters(&tile), imprint: imprint_from_tile(&tile, &dataset.rig) };
    Ok(tile.map(both))
}

/// An imprint as the picture of its sensor shows it: turned as that lies, and as large (`[width, height]`).
pub(crate) fn as_tile(imprint: &DepthMap, rig: &Rig, [width, height]: [usize; 2]) -> DepthMap {
    let turned = rig.depth().is_some_and(|sensor| sensor.rotation_deg == 180).then(|| imprint.rotated_180());
    bilinear(turned.as_ref().unwrap_or(imprint), width, height)
}

/// An imprint that is compared.
#[derive(Clone, Debug)]
pub struct Depicted<'a> {
    /// Meters, raw orientation.
    pub imprint: &'a DepthMap,
    /// Imprint as its file or its decoder has it, on the grid of the pair's picture ([`tile_of`]); `None` where
    /// imprints were measured.
    pub tile: Option<Cow<'a, DepthMap>>,
}

impl<'a> Depicted<'a> {
    /// A predicted imprint of a pad. On the grid of a `tile` it is resampled once where it is known how it was `drawn`.
    ///
    /// # Errors
    /// As [`picture_of`].
    pub fn predicted(
        imprint: &'a DepthMap,
        drawn: Option<(&Prediction, ShiftMode)>,
        sample: &Sample,
        pad: PadId,
        tile: Option<&DepthMap>,
    ) -> Result<Depicted<'a>, TaskError> {
        let tile = match (tile, drawn) {
            (None, _) => None,
            (Some(tile), Some((prediction, shift))) => Some(picture_of(prediction, shift, sample, pad, tile.size())?),
            (Some(tile), None) => Some(as_tile(imprint, &sample.rig, tile.size())),
        };
        Ok(Self { imprint, tile: tile.map(Cow::Owned) })
    }
}

/// An imprint of a pad against another of it: the figures that every part of the program shows. With pictures of both
/// they are of the pictures' own pixels, so that what the file has is not resampled; the error map is of the imprint's
/// pixels always.
///
/// # Errors
/// As [`compare`].
pub fn between(a: &Depicted<'_>, b: &Depicted<'_>, scale: Scale) -> Result<Comparison, TaskError> {
    let whole = compare(a.imprint, b.imprint, scale)?;
    let (Some(a_tile), Some(b_tile)) = (&a.tile, &b.tile) else { return Ok(whole) };
    Ok(Comparison { error: whole.error, ..compare(a_tile, b_tile, scale)? })
}

/// The predicted imprint of a pad (meters, raw orientation) against what was measured; see [`between`] and
/// [`Depicted::predicted`]. `None` where nothing was measured.
///
/// # Errors
/// As [`compare`].
pub fn of_pad(
    imprint: &DepthMap,
    drawn: Option<(&Prediction, ShiftMode)>,
    sample: &Sample,
    pad: PadId,
    tile: Option<&DepthMap>,
) -> Result<Option<Comparison>, TaskError> {
    let Some(bubble) = sample.pad(pad).and_then(|touch| touch.depth()) else { return Ok(None) };
    let predicted = Depicted::predicted(imprint, drawn, sample, pad, tile)?;
    let measured = Depicted { imprint: &bubble.imprint, tile: tile.map(Cow::Borrowed) };
    between(&predicted, &measured, sample.scale).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comparing_says_how_far_off() {
        let a = Grid::from_fn(40, 30, |x, y| 1e-4 * (x * y % 17) as f32);
        let b = a.map(|v| v + 0.001);
        let comparison = compare(&b, &a, Scale::Measured).unwrap();
        // A constant error of 1 mm: 20 log10(0.0225 / 0.001) = 27.04 dB.
        assert!((comparison.psnr_db.unwrap() - 27.04).abs() < 0.01);
        assert!((comparison.mae_m - 0.001).abs() < 1e-8);
        // With an assumed scale an offset is invisible: the stretched images are equal up to rounding.
        let assumed = compare(&b, &a, Scale::Assumed).unwrap();
        assert!(assumed.psnr_db.is_none_or(|db| db > 80.0));
        assert!(compare(&Grid::filled(3, 3, 0.0), &a, Scale::Measured).is_err());
    }
}
