//! The shape of each finger's membrane over a tool, by bands of lengths.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec2;

use super::smooth::{BANDS, Layer, Smooth};
use crate::relax::Field;
use crate::tent::{FreeShape, STEP_M, heights, lifted, tent};
use crate::tool::ToolModel;

/// Templates are made for free membranes so far apart: height (meters), slopes, and bends (1/m).
const STEPS: [f64; 5] = [1e-3, 0.05, 0.05, 2.0, 2.0];
/// Curvatures of free membranes, 1/m: of a large bubble, and of a small one.
const FLATTEST: f64 = 8.0;
const ROUNDEST: f64 = 400.0;

/// A band of a membrane's height over the y-z plane of the object frame, meters.
pub(super) struct BandField {
    pub(super) field: Field,
    /// `(y, z)` of node (0, 0), meters.
    pub(super) origin: DVec2,
}

/// The bands of one side of a tool, in the order of [`BANDS`].
pub(super) type Template = [BandField; BANDS.len()];

/// Steps of height, slopes and bends, the side, and whether the free membrane reaches the middle plane.
type Key = ([i32; 5], bool, bool);

/// The templates of a tool. `None` where the tool has nothing on that side.
#[derive(Default)]
struct Templates(Mutex<BTreeMap<Key, Option<Arc<Template>>>>);

/// The template of a tool on the side of the middle plane where x has the sign of `side`, under a membrane of this free shape.
/// Made at the first request (some 50 ms) and kept with the tool.
pub(super) fn template(tool: &ToolModel, side: f64, free: FreeShape) -> Option<Arc<Template>> {
    let all = if free.reaches {
        // A tent depends on the curvature alone.
        let curvature = free.bend.element_sum().clamp(FLATTEST, ROUNDEST);
        [0.0, 0.0, 0.0, 0.5 * curvature, 0.5 * curvature]
    } else {
        [free.height_m, free.slope.x, free.slope.y, free.bend.x, free.bend.y]
    };
    let steps: [i32; 5] = std::array::from_fn(|i| (all[i] / STEPS[i]).round().clamp(-400.0, 400.0) as i32);
    let [height_m, y, z, yy, zz] = std::array::from_fn(|i| f64::from(steps[i]) * STEPS[i]);
    let free = FreeShape { height_m, slope: DVec2::new(y, z), bend: DVec2::new(yy, zz), reaches: free.reaches };
    let kept = tool.derived(|_| Templates::default());
    let mut kept = kept.0.lock().unwrap_or_else(PoisonError::into_inner);
    kept.entry((steps, side > 0.0, free.reaches)).or_insert_with(|| made(tool, side, free).map(Arc::new)).clone()
}

fn made(tool: &ToolModel, side: f64, free: FreeShape) -> Option<Template> {
    let top = heights(&tool.mesh, side)?;
    let sheet = if free.reaches { tent(&top, free.bend.element_sum()) } else { lifted(&top, &free) };
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
        BandField { field, origin: sheet.origin }
    }))
}
