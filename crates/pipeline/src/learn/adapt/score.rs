//! Scores of pictures beside their measurements, all three ways.

use rayon::prelude::*;
use serde::Serialize;

use super::gather::FitTouch;
use crate::compare::{Comparison, LAB_PEAK_M, compare};
use crate::error::TaskError;
use touch2touch_core::evaluation::mean;
use touch2touch_core::grid::Grid;
use touch2touch_core::metrics::{AngleSummary, unstretched};
use touch2touch_core::resample::bilinear;
use touch2touch_core::sample::Scale;

/// Means over touches.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Scored {
    /// Touches compared.
    pub touches: usize,
    /// PSNR as everywhere in the program, dB: of pictures both stretched to 0..1, of measured meters with the lab's peak.
    pub psnr_db: Option<f64>,
    /// SSIM likewise.
    pub ssim: Option<f64>,
    /// PSNR of the pictures as they are, dB.
    pub psnr_raw_db: Option<f64>,
    /// SSIM likewise.
    pub ssim_raw: Option<f64>,
    /// PSNR after the straight line that fits best, dB.
    pub psnr_line_db: Option<f64>,
    /// Deviation of `psnr_db` over the touches, dB.
    pub psnr_spread_db: Option<f64>,
    /// Of the in-hand angle, where tools and cameras are known: from the true pose, or from that of the measured imprints.
    #[serde(rename = "angle")]
    pub angle: Option<AngleSummary>,
}

/// The scores of a picture (meters, the decoder's grid) per touch; `None` where none was given.
pub(super) fn scored(touches: &[FitTouch], pictures: &[Option<&Grid<f32>>]) -> Result<Option<Scored>, TaskError> {
    let all = touches
        .par_iter()
        .zip(pictures)
        .filter_map(|(touch, picture)| Some(compared(touch, (*picture)?)))
        .collect::<Result<Vec<Comparison>, TaskError>>()?;
    if all.is_empty() {
        return Ok(None);
    }
    let of = |get: &dyn Fn(&Comparison) -> Option<f64>| mean(all.iter().filter_map(get));
    let psnr_db = of(&|c| c.psnr_db);
    Ok(Some(Scored {
        touches: all.len(),
        psnr_db,
        ssim: of(&|c| c.ssim),
        psnr_raw_db: of(&|c| c.unstretched?.psnr_raw_db),
        ssim_raw: of(&|c| c.unstretched?.ssim_raw),
        psnr_line_db: of(&|c| c.unstretched?.psnr_line_db),
        psnr_spread_db: psnr_db.and_then(|m| of(&|c| Some((c.psnr_db? - m).powi(2)))).map(f64::sqrt),
        angle: None,
    }))
}

fn compared(touch: &FitTouch, picture: &Grid<f32>) -> Result<Comparison, TaskError> {
    if let Some(tile) = &touch.tile {
        let [width, height] = tile.size();
        let own = if picture.size() == tile.size() { picture.clone() } else { bilinear(picture, width, height) };
        return compare(&own, tile, touch.scale);
    }
    let own = touch.imprint(picture);
    let mut found = compare(&own, &touch.measured, touch.scale)?;
    if touch.scale == Scale::Measured {
        found.unstretched = unstretched(&own, &touch.measured, LAB_PEAK_M).ok();
    }
    Ok(found)
}
