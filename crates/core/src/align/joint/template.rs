//! The shape of each finger's membrane over a tool, by bands of lengths.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec2;

use super::smooth::{BANDS, DECIDING, FINEST, Layer, Smooth};
use crate::frames::PlanarPose;
use crate::relax::Field;
use crate::tent::{FreeShape, Sheet, heights, lifted, tent};
use crate::tool::ToolModel;

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

/// Poses of a tool and free membranes of which one template is made: by the turn alone, for the search, or by the place as
/// well, for the answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Grasp {
    /// Steps of the angle and of y and z.
    steps: [i8; 3],
    placed: bool,
}

/// Turns of the search; twice as many for the answer.
const TURNS: i8 = 8;
/// Step of the place, and the farthest one, meters.
const SHIFT_M: f64 = 6e-3;
const FARTHEST_M: f64 = 0.06;
/// Steps of free membranes for the answer: height (meters), slopes, and bends (1/m). Twice these for the search.
const STEPS: [f64; 5] = [0.5e-3, 0.025, 0.025, 1.0, 1.0];
/// Curvatures of free membranes that reach the middle plane, 1/m: of a large bubble, and of a small one.
const FLATTEST: f64 = 8.0;
const ROUNDEST: f64 = 400.0;
/// Most templates that are kept of a tool.
const KEPT: usize = 120;

impl Grasp {
    /// The grasp of a pose, `grasp_from_object`, by its turn alone or `placed`.
    pub(super) fn of(pose: PlanarPose, placed: bool) -> Self {
        let turns = Self { steps: [0; 3], placed }.turns();
        let turn = (pose.theta_rad / TAU * f64::from(turns)).round() as i32;
        let shift = |m: f64| (m.clamp(-FARTHEST_M, FARTHEST_M) / SHIFT_M).round() as i8;
        let [y, z] = if placed { [pose.y_m, pose.z_m].map(shift) } else { [0; 2] };
        Self { steps: [turn.rem_euclid(i32::from(turns)) as i8, y, z], placed }
    }

    fn turns(self) -> i8 {
        if self.placed { 2 * TURNS } else { TURNS }
    }

    fn pose(self) -> PlanarPose {
        let [turn, y, z] = self.steps.map(f64::from);
        PlanarPose { theta_rad: TAU * turn / f64::from(self.turns()), y_m: y * SHIFT_M, z_m: z * SHIFT_M }
    }

    /// Steps of a free shape, and the shape that they stand for.
    pub(super) fn keyed(self, free: FreeShape) -> ([i32; 5], FreeShape) {
        let step = |i: usize| if self.placed { STEPS[i] } else { 2.0 * STEPS[i] };
        let all = if free.reaches {
            // A tent depends on the curvature alone.
            let half = 0.5 * free.bend.element_sum().clamp(FLATTEST, ROUNDEST);
            [0.0, 0.0, 0.0, half, half]
        } else {
            [free.height_m, free.slope.x, free.slope.y, free.bend.x, free.bend.y]
        };
        let steps: [i32; 5] = std::array::from_fn(|i| (all[i] / step(i)).round().clamp(-1000.0, 1000.0) as i32);
        let [height_m, y, z, yy, zz] = std::array::from_fn(|i| f64::from(steps[i]) * step(i));
        (steps, FreeShape { height_m, slope: DVec2::new(y, z), bend: DVec2::new(yy, zz), of: self.pose(), ..free })
    }
}

/// Steps of a free shape, whether the side is the positive one, whether the free membrane reaches the middle plane, and the grasp.
type Key = ([i32; 5], [bool; 2], Grasp);

/// The tops of a tool's sides, and the templates that were made over them.
struct Templates {
    tops: [Option<Sheet>; 2],
    kept: Mutex<BTreeMap<Key, Arc<Template>>>,
}

impl Templates {
    fn of(tool: &ToolModel) -> Self {
        Self { tops: [-1.0, 1.0].map(|side| heights(&tool.mesh, side)), kept: Mutex::default() }
    }
}

/// The template of a tool on the side of the middle plane where x has the sign of `side`, under a membrane of this free shape.
/// Made at the first request (some milliseconds) and kept with the tool. `None` where the tool has nothing on that side.
pub(super) fn template(tool: &ToolModel, side: f64, free: FreeShape, grasp: Grasp) -> Option<Arc<Template>> {
    let grasp = if free.reaches { Grasp { steps: [0; 3], ..grasp } } else { grasp };
    let (steps, free) = grasp.keyed(free);
    let templates = tool.derived(Templates::of);
    let lock = || templates.kept.lock().unwrap_or_else(PoisonError::into_inner);
    let key = (steps, [side > 0.0, free.reaches], grasp);
    let known = lock().get(&key).cloned();
    if known.is_some() {
        return known;
    }
    let made = Arc::new(made(templates.tops[usize::from(side > 0.0)].as_ref()?, &free, grasp.placed));
    let mut kept = lock();
    if kept.len() > KEPT {
        kept.retain(|(_, _, grasp), _| !grasp.placed);
    }
    kept.insert(key, made.clone());
    Some(made)
}

fn made(top: &Sheet, free: &FreeShape, placed: bool) -> Template {
    let thinned = (!placed).then(|| top.thinned());
    let top = thinned.as_ref().unwrap_or(top);
    let sheet = if free.reaches { tent(top, free.bend.element_sum()) } else { lifted(top, free) };
    let smooth = Smooth::new(&Layer::of(&sheet.field), sheet.step_m, 0.0);
    let band = |i: usize| {
        // A coarse band is smooth enough for every second node.
        let ([narrow, wide], every) = (BANDS[i], if placed && i == 0 { 2 } else { 1 });
        let (columns, rows) = (sheet.field.columns.div_ceil(every), sheet.field.rows.div_ceil(every));
        let at = |sigma: usize, k: usize| smooth.at(sigma, k % columns * every, k / columns * every)[0];
        let values = (0..columns * rows).map(|k| at(narrow, k) - at(wide, k)).collect();
        let field = Field { columns, rows, values };
        Arc::new(BandField { field, origin: sheet.origin, step_m: sheet.step_m * every as f64 })
    };
    let deciding = band(DECIDING);
    // Nothing is compared with the finest band of a membrane that hangs.
    let finest = if free.reaches { band(FINEST) } else { deciding.clone() };
    [band(0), deciding, finest]
}
