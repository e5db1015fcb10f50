//! The shape of each finger's membrane over a tool, by bands of lengths.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec2;

use super::pyramid::Pyramid;
use super::smooth::{BANDS, Layer, Smooth};
use crate::relax::Field;
use crate::tent::{STEP_M, heights, tent};
use crate::tool::ToolModel;

/// Curvatures of free membranes, 1/m: flat as a large bubble, and round as a small one.
const CURVATURE: std::ops::RangeInclusive<f64> = 8.0..=400.0;
/// Templates are made for so many curvatures between one and twice it.
const STEPS: f64 = 4.0;
/// Templates are made for floors so far apart, meters.
const FLOOR_M: f64 = 0.5e-3;

/// A band of a membrane's height over the y-z plane of the object frame, meters.
pub(super) struct BandField {
    pub(super) field: Field,
    /// `(y, z)` of node (0, 0), meters.
    pub(super) origin: DVec2,
    pub(super) pyramid: Pyramid,
}

/// The bands of one side of a tool, in the order of [`BANDS`].
pub(super) type Template = [BandField; BANDS.len()];

/// Step of curvature, step of floor, and the side.
type Key = (i32, i32, bool);

/// The templates of a tool. `None` where the tool has nothing on that side.
#[derive(Default)]
struct Templates(Mutex<BTreeMap<Key, Option<Arc<Template>>>>);

/// The template of a tool on the side of the middle plane where x has the sign of `side`, under a membrane whose free
/// height has the Laplacian `curvature` (1/m) and which reaches the plane `floor_m` over the middle plane, over which heights
/// count. Made at the first request (25 to 65 ms) and kept with the tool.
pub(super) fn template(tool: &ToolModel, side: f64, curvature: f64, floor_m: f64) -> Option<Arc<Template>> {
    let step = (STEPS * curvature.clamp(*CURVATURE.start(), *CURVATURE.end()).log2()).round();
    let floor = (floor_m.clamp(0.0, 0.05) / FLOOR_M).round();
    let key = (step as i32, floor as i32, side > 0.0);
    let kept = tool.derived(|_| Templates::default());
    let mut kept = kept.0.lock().unwrap_or_else(PoisonError::into_inner);
    kept.entry(key).or_insert_with(|| made(tool, side, (step / STEPS).exp2(), floor * FLOOR_M).map(Arc::new)).clone()
}

fn made(tool: &ToolModel, side: f64, curvature: f64, floor_m: f64) -> Option<Template> {
    let mut heights = heights(&tool.mesh, side)?;
    heights.field.values.iter_mut().for_each(|height| *height = (*height - floor_m as f32).max(0.0));
    let sheet = tent(&heights, curvature);
    let smooth = Smooth::new(&Layer::of(&sheet.field), STEP_M, 0.0);
    let (columns, rows) = (sheet.field.columns, sheet.field.rows);
    Some(BANDS.map(|[narrow, wide]| {
        let mut field = Field::filled(columns, rows, 0.0);
        for row in 0..rows {
            for column in 0..columns {
                field.values[row * columns + column] =
                    smooth.at(narrow, column, row)[0] - smooth.at(wide, column, row)[0];
            }
        }
        BandField { field, origin: sheet.origin, pyramid: Pyramid::default() }
    }))
}
