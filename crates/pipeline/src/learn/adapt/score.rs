//! Scores of pictures beside their measurements, all three ways.

use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;

use super::gather::FitTouch;
use crate::compare::{Comparison, LAB_PEAK_M, compare_parts, tiles};
use crate::error::TaskError;
use touch2touch_core::evaluation::mean;
use touch2touch_core::grid::Grid;
use touch2touch_core::metrics::{AngleSummary, PixelMetrics, unstretched};
use touch2touch_core::resample::bilinear;
use touch2touch_core::rig::Rig;
use touch2touch_core::sample::{Sample, Scale};

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
    /// Inside the GelSlim's window.
    pub seen: Option<Part>,
    /// Outside.
    pub invented: Option<Part>,
    /// Of the in-hand angle, where tools and cameras are known: from the true pose, or from that of the measured imprints.
    #[serde(rename = "angle")]
    pub angle: Option<AngleSummary>,
}

/// Means of a part of the pictures.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Part {
    /// dB.
    pub psnr_db: Option<f64>,
    /// SSIM.
    pub ssim: Option<f64>,
}

/// The scores of a picture (meters, the decoder's grid) per touch; `None` where none was given.
pub(super) fn scored(
    touches: &[FitTouch],
    pictures: &[Option<&Grid<f32>>],
    rig: &Arc<Rig>,
) -> Result<Option<Scored>, TaskError> {
    let all = touches
        .par_iter()
        .zip(pictures)
        .filter_map(|(touch, picture)| Some(compared(touch, (*picture)?, rig)))
        .collect::<Result<Vec<Comparison>, TaskError>>()?;
    if all.is_empty() {
        return Ok(None);
    }
    let of = |get: &dyn Fn(&Comparison) -> Option<f64>| mean(all.iter().filter_map(get));
    let part = |get: fn(&Comparison) -> Option<PixelMetrics>| {
        let parts: Vec<PixelMetrics> = all.iter().filter_map(get).collect();
        (!parts.is_empty()).then(|| Part {
            psnr_db: mean(parts.iter().filter_map(|p| p.psnr_db)),
            ssim: mean(parts.iter().filter_map(|p| p.ssim)),
        })
    };
    let psnr_db = of(&|c| c.psnr_db);
    Ok(Some(Scored {
        touches: all.len(),
        psnr_db,
        ssim: of(&|c| c.ssim),
        psnr_raw_db: of(&|c| c.unstretched?.psnr_raw_db),
        ssim_raw: of(&|c| c.unstretched?.ssim_raw),
        psnr_line_db: of(&|c| c.unstretched?.psnr_line_db),
        psnr_spread_db: psnr_db.and_then(|m| of(&|c| Some((c.psnr_db? - m).powi(2)))).map(f64::sqrt),
        seen: part(|c| Some(c.split?.seen)),
        invented: part(|c| Some(c.split?.invented)),
        angle: None,
    }))
}

fn compared(touch: &FitTouch, picture: &Grid<f32>, rig: &Arc<Rig>) -> Result<Comparison, TaskError> {
    if let Some(tile) = &touch.tile {
        let [width, height] = tile.size();
        // Comparing asks a sample for nothing but its rig and its scale.
        let sample = Sample { rig: rig.clone(), scale: touch.scale, ..Sample::default() };
        let own = if picture.size() == tile.size() { picture.clone() } else { bilinear(picture, width, height) };
        return tiles(&own, tile, &sample, touch.pad);
    }
    let own = touch.imprint(picture);
    let seen = rig.seen_mask(touch.pad, touch.measured.size());
    let mut found = compare_parts(&own, &touch.measured, touch.scale, seen.as_ref())?;
    if touch.scale == Scale::Measured {
        found.unstretched = unstretched(&own, &touch.measured, LAB_PEAK_M).ok();
    }
    Ok(found)
}
