//! The shape of each finger's membrane over a tool, by bands of lengths.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec2;

use super::smooth::{BANDS, Layer, Smooth};
use crate::frames::PlanarPose;
use crate::relax::Field;
use crate::tent::{FreeShape, heights, lifted, tent};
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
    /// Spacing of the nodes, meters.
    pub(super) step_m: f64,
}

/// The bands of one side of a tool, in the order of [`BANDS`].
pub(super) type Template = [Arc<BandField>; BANDS.len()];

/// Steps of height, slopes and bends, the side, whether the free membrane reaches the middle plane, and the grasp.
type Key = ([i32; 5], bool, bool, Grasp);

/// Poses of a tool under a free membrane of which one template is made: steps of the angle and of y and z. The one of the
/// lab's grasps is 0.
pub(super) type Grasp = [i8; 3];
/// Angles in a full turn.
pub(super) const ANGLES: i32 = 8;
/// Step of the place, meters.
const SHIFT_M: f64 = 0.012;
/// Most templates that are kept of a tool.
const KEPT: usize = 200;

/// The grasp of a pose, `grasp_from_object`.
pub(super) fn grasp_of(pose: PlanarPose) -> Grasp {
    let turn = (pose.theta_rad / TAU * f64::from(ANGLES)).round() as i32;
    [
        turn.rem_euclid(ANGLES) as i8,
        (pose.y_m / SHIFT_M).round().clamp(-9.0, 9.0) as i8,
        (pose.z_m / SHIFT_M).round().clamp(-9.0, 9.0) as i8,
    ]
}

/// The templates of a tool. `None` where the tool has nothing on that side.
#[derive(Default)]
struct Templates(Mutex<BTreeMap<Key, Option<Arc<Template>>>>);

/// Steps of a free shape, and the shape that they stand for.
pub(super) fn keyed(free: FreeShape) -> ([i32; 5], FreeShape) {
    let all = if free.reaches {
        // A tent depends on the curvature alone.
        let curvature = free.bend.element_sum().clamp(FLATTEST, ROUNDEST);
        [0.0, 0.0, 0.0, 0.5 * curvature, 0.5 * curvature]
    } else {
        [free.height_m, free.slope.x, free.slope.y, free.bend.x, free.bend.y]
    };
    let steps: [i32; 5] = std::array::from_fn(|i| (all[i] / STEPS[i]).round().clamp(-400.0, 400.0) as i32);
    let [height_m, y, z, yy, zz] = std::array::from_fn(|i| f64::from(steps[i]) * STEPS[i]);
    (steps, FreeShape { height_m, slope: DVec2::new(y, z), bend: DVec2::new(yy, zz), ..free })
}

/// The template of a tool on the side of the middle plane where x has the sign of `side`, under a membrane of this free shape.
/// Made at the first request (some 50 ms) and kept with the tool.
pub(super) fn template(tool: &ToolModel, side: f64, free: FreeShape, grasp: Grasp) -> Option<Arc<Template>> {
    let grasp = if free.reaches { Grasp::default() } else { grasp };
    let (steps, free) = keyed(free);
    let [turn, y_m, z_m] = grasp.map(f64::from);
    let of = PlanarPose { theta_rad: TAU * turn / f64::from(ANGLES), y_m: y_m * SHIFT_M, z_m: z_m * SHIFT_M };
    let free = FreeShape { of, ..free };
    let kept = tool.derived(|_| Templates::default());
    let mut kept = kept.0.lock().unwrap_or_else(PoisonError::into_inner);
    if kept.len() > KEPT {
        kept.retain(|(_, _, _, [_, y, z]), _| [*y, *z] == [0, 0]);
    }
    kept.entry((steps, side > 0.0, free.reaches, grasp)).or_insert_with(|| made(tool, side, free).map(Arc::new)).clone()
}

fn made(tool: &ToolModel, side: f64, free: FreeShape) -> Option<Template> {
    let top = heights(&tool.mesh, side)?;
    // The lab's grasps have the finer grid.
    let top = if free.of == PlanarPose::default() { top } else { top.thinned() };
    let sheet = if free.reaches { tent(&top, free.bend.element_sum()) } else { lifted(&top, &free) };
    let smooth = Smooth::new(&Layer::of(&sheet.field), sheet.step_m, 0.0);
    let (columns, rows) = (sheet.field.columns, sheet.field.rows);
    Some(BANDS.map(|[narrow, wide]| {
        let mut field = Field::filled(columns, rows, 0.0);
        for row in 0..rows {
            for column in 0..columns {
                field.values[row * columns + column] =
                    smooth.at(narrow, column, row)[0] - smooth.at(wide, column, row)[0];
            }
        }
        Arc::new(BandField { field, origin: sheet.origin, step_m: sheet.step_m })
    }))
}
