//! The files of a prediction.

use std::path::Path;

use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_pipeline::io::images;
use touch2touch_pipeline::io::names::with_ending;

/// Writes `STEM.npy` (meters, f32, 140 x 175, raw orientation) and a 16-bit picture of it (0.001 mm steps from
/// -20 mm) for people.
pub(super) fn write(stem: &Path, imprint: &DepthMap) -> anyhow::Result<()> {
    touch2touch_pipeline::io::npz::write_npy(&with_ending(stem, ".npy"), imprint)?;
    Ok(images::write_depth16(&with_ending(stem, ".png"), imprint)?)
}

/// Writes `STEM.png`: the difference of a color sensor's images around the middle gray, in its raw orientation;
/// and `STEM.npy` with the numbers (f32, 3 x height x width).
pub(super) fn write_color(stem: &Path, difference: &RgbGrid) -> anyhow::Result<()> {
    touch2touch_pipeline::io::npz::write_npy_planes(&with_ending(stem, ".npy"), difference)?;
    let picture = difference.map(|pixel| pixel.map(|v| v + 128.0));
    images::write_rgb8(&with_ending(stem, ".png"), &picture)?;
    Ok(())
}
