//! Depths that are no pictures: imprints in meters as numpy's arrays and TIFF files hold them, and the levels of other TIFFs.

use std::path::Path;

use super::super::most_invalid;
use super::{NotedTile, lengths};
use crate::io::error::FileError;
use crate::io::images::{self, wrong_kind};
use crate::io::npz::read_npy;
use crate::io::pt::{Tensor, Values};
use crate::io::tiff::{self, Gray};
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::rig::Sensor;

/// Ends of the names of such files, in lower case.
pub(super) const EXTENSIONS: [&str; 3] = [".npy", ".tif", ".tiff"];

/// True of a file that is one of them.
pub(super) fn has_any(path: &Path) -> bool {
    let lower = path.to_string_lossy().to_ascii_lowercase();
    EXTENSIONS.iter().any(|end| lower.ends_with(end))
}

const EXPECTED: &str =
    "height x width floats, how far the membrane is pushed in, in meters, as the camera's picture lies";

/// Content of a file of depths.
pub(super) enum Depth {
    /// Meters, raw orientation.
    Meters(DepthMap),
    /// Gray levels as a picture beside a GelSlim's lies.
    Levels(NotedTile),
}

/// Reads a file of depths, which a sensor's camera took.
pub(super) fn read(path: &Path, sensor: &Sensor) -> Result<Depth, FileError> {
    let kind = |found: String| wrong_kind(path, found, EXPECTED);
    let lower = path.to_string_lossy().to_ascii_lowercase();
    let meters = if lower.ends_with(".npy") {
        array(read_npy(path)?).map_err(kind)?
    } else if lower.ends_with(".tif") || lower.ends_with(".tiff") {
        match tiff::read(path)? {
            Gray::Float(meters) => meters,
            Gray::U16(values) => return Ok(Depth::Levels(lengths::levels(path, &values)?)),
            Gray::U8(levels) => return Ok(Depth::Levels((levels, None))),
        }
    } else {
        return Ok(Depth::Levels(match images::read_depth(path)? {
            Ok(values) => lengths::levels(path, &values)?,
            Err(tile) => (tile, None),
        }));
    };
    let ([width, height], [columns, rows]) = (meters.size(), sensor.size());
    if [width, height] != [columns, rows] {
        let found = format!("{width} x {height} values, but the sensor {} has {columns} x {rows} pixels", sensor.key);
        return Err(kind(found));
    }
    let meters = meters.map(|v| if v.is_finite() { *v } else { f32::NAN });
    let bad = meters.as_slice().iter().filter(|v| v.is_nan()).count();
    most_invalid(path, bad, meters.len(), || "values of the imprint".into())?;
    Ok(Depth::Meters(meters))
}

fn array(tensor: Tensor) -> Result<DepthMap, String> {
    if matches!(tensor.values, Values::U8(_) | Values::I64(_)) {
        return Err("an array of whole numbers".into());
    }
    let shape: Vec<usize> = tensor.shape.iter().copied().filter(|n| *n != 1).collect();
    let [height, width] = shape[..] else { return Err(format!("an array of shape {:?}", tensor.shape)) };
    Grid::from_vec(width, height, tensor.into_f32()).map_err(|err| err.to_string())
}
