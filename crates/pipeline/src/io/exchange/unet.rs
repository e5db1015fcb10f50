//! The lab's UNet layout: `{train,val,test}/{imgs,masks}/<stem>.png`, as its loader needs it.
//!
//! Per image exactly one mask of the same stem and size, 0 and 255, nothing else in the folders. The loader does not look
//! into `ignore/`: such pixels are free of contact to it.
//!
//! Source: `utils/data_loading.py` lines 22-30, 111-126 and 253-296 of the lab's UNet repository, and
//! `ICP_dataset_cal.py` lines 641-676 for the scale.

use std::path::Path;

use super::format::gray;
use super::{Content, ExportReport, IGNORED, IMAGE_HI_M, IMAGE_LO_M, make_folder};
use crate::io::error::FileError;
use crate::io::images;
use touch2touch_core::grid::{DepthMap, Grid};

/// Writes an image and its mask into the folders of their part.
pub(super) fn write(part: &Path, stem: &str, content: &Content, report: &mut ExportReport) -> Result<(), FileError> {
    let file = |kind: &str| part.join(kind).join(format!("{stem}.png"));
    let picture = image_from_imprint(&content.imprint, report);
    let image = file("imgs");
    images::write_gray8(&image, &picture)?;
    if images::read_gray8(&image)? != picture {
        return Err(FileError::new(image, "the file reads back differently", "check the disk"));
    }
    images::write_gray8(&file("masks"), &gray(&content.mask))?;
    if let Some(ignored) = &content.ignored {
        make_folder(&part.join(IGNORED))?;
        images::write_gray8(&file(IGNORED), &gray(ignored))?;
    }
    Ok(())
}

/// The loader's 8-bit image of an imprint, in 32-bit arithmetic as the lab's script has it.
fn image_from_imprint(imprint: &DepthMap, report: &mut ExportReport) -> Grid<u8> {
    let range = (IMAGE_HI_M - IMAGE_LO_M) as f32;
    imprint.map(|&meters| {
        let meters = if meters.is_finite() {
            meters
        } else {
            report.unmeasured_px += 1;
            0.0
        };
        let value = (meters - IMAGE_LO_M as f32) / range * 255.0;
        if !(0.0..256.0).contains(&value) {
            report.out_of_range_px += 1;
        }
        // Truncates like the lab's cast, but saturates where that would wrap around.
        value as u8
    })
}
