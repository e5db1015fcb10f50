//! The coarsest band of a template turned all around, in cells.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec2;

use super::template::{Grasp, Template, template};
use crate::align::batch::State;
use crate::align::lanes::LANES;
use crate::frames::PlanarPose;
use crate::mesh::TriMesh;
use crate::tent::FreeShape;
use crate::tool::ToolModel;

/// Turns that are compared.
pub(super) const TURNS: usize = 30;
/// Greatest side of a cell, meters.
const CELL_M: f64 = 5.5e-3;
/// Cells of an image to each side of its middle.
pub(super) const REACH: usize = 8;
/// Way beyond the model on which the middle of the membranes may lie, meters.
const BEYOND_M: f64 = 8e-3;

/// Places at which a model is compared: as far as it reaches about its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    /// Middle of the model, `(y, z)`, object frame, meters.
    center: DVec2,
    pub(super) cell_m: f64,
    /// Places along each axis: a multiple of [`LANES`].
    pub(super) side: usize,
}

impl Frame {
    pub(super) fn of(mesh: &TriMesh) -> Self {
        let yz = || mesh.vertices.iter().filter(|v| v.is_finite()).map(|v| DVec2::new(v.y, v.z));
        let low = yz().fold(DVec2::INFINITY, DVec2::min);
        let high = yz().fold(DVec2::NEG_INFINITY, DVec2::max);
        let center = 0.5 * (low + high);
        let radius = yz().map(|p| p.distance(center)).fold(0.0, f64::max).min(0.1) + BEYOND_M;
        let side = (2.0 * radius / (CELL_M * LANES as f64)).ceil() as usize * LANES;
        Self { center, cell_m: 2.0 * radius / (side - 1) as f64, side }
    }

    /// Cells along each axis of what lies around all places.
    pub(super) fn width(&self) -> usize {
        self.side + 2 * REACH
    }

    /// The state of a turn and a place.
    pub(super) fn state(&self, turn: usize, row: usize, column: usize) -> State {
        let phi = crate::units::wrap_angle(angle(turn));
        let middle = 0.5 * (self.side - 1) as f64;
        let place = DVec2::new(column as f64 - middle, row as f64 - middle) * self.cell_m;
        State { phi, place: self.center + DVec2::from_angle(phi).rotate(place) }
    }
}

/// A turn of the object frame, radians.
fn angle(turn: usize) -> f64 {
    TAU * turn as f64 / TURNS as f64
}

/// A band of a template's heights in cells, for each turn row by row, meters.
pub(super) struct Turned(pub(super) Vec<f32>);

impl Turned {
    /// Of the template for each turn of the object frame.
    fn new(frame: Frame, templates: &[Arc<Template>]) -> Self {
        let width = frame.width();
        let middle = 0.5 * (width - 1) as f64;
        let mut cells = Vec::with_capacity(TURNS * width * width);
        for (turn, [band, ..]) in templates.iter().map(|template| &**template).enumerate() {
            let turn = DVec2::from_angle(angle(turn));
            for at in 0..width * width {
                let cell = DVec2::new((at % width) as f64 - middle, (at / width) as f64 - middle);
                let mean = (0..9).map(|part| {
                    let part = DVec2::new(f64::from(part % 3 - 1), f64::from(part / 3 - 1)) / 3.0;
                    let place = (frame.center + turn.rotate(cell + part) * frame.cell_m - band.origin) / band.step_m;
                    let inside = place.min_element() >= 0.0
                        && place.x < band.field.columns as f64
                        && place.y < band.field.rows as f64;
                    if inside { band.field.at(place.x, place.y) } else { 0.0 }
                });
                cells.push((mean.sum::<f64>() / 9.0) as f32);
            }
        }
        Self(cells)
    }
}

/// Steps of the free shape, the side, and whether the free membrane reaches the middle plane.
type Key = ([i32; 5], bool, bool);

/// The coarsest bands of a tool turned all around.
#[derive(Default)]
struct AllTurned(Mutex<BTreeMap<Key, Arc<Turned>>>);

/// The coarsest band of a template turned all around, each with the free membrane of about its turn. Made at the first request.
pub(super) fn turned(tool: &ToolModel, side: f64, free: FreeShape, frame: Frame) -> Option<Arc<Turned>> {
    let key = (Grasp::default().keyed(free).0, side > 0.0, free.reaches);
    let kept = tool.derived(|_| AllTurned::default());
    let mut kept = kept.0.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(turned) = kept.get(&key) {
        return Some(turned.clone());
    }
    let grasp = |turn: usize| Grasp::of(PlanarPose { theta_rad: -angle(turn), ..PlanarPose::default() }, false);
    let of = |turn: usize| template(tool, side, free, grasp(turn));
    let turned = Arc::new(Turned::new(frame, &(0..TURNS).map(of).collect::<Option<Vec<_>>>()?));
    kept.insert(key, turned.clone());
    Some(turned)
}
