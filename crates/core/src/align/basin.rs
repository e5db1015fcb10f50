//! Basin map: where a registration ends when it starts from each pose of a grid.
//!
//! It shows what a single answer hides: how far the start may be off, which other poses fit about as well, and
//! whether the answer is one place or a valley.

use rayon::prelude::*;
use serde::Serialize;

use super::{AlignError, AlignReport, Prior, Stop};
use crate::frames::PlanarPose;
use crate::units::{angle_error, wrap_angle};

/// Ends closer than this are one: radians and meters.
pub(crate) const SAME_RAD: f64 = 1.0 / 180.0 * std::f64::consts::PI;
/// See [`SAME_RAD`].
pub(crate) const SAME_M: f64 = 1e-3;

/// The two coordinates of a start that are varied. The angle is in the lab's sense: that of `object_from_grasp`.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Serialize,
    strum::EnumIter,
    strum::EnumString,
    strum::IntoStaticStr,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Plane {
    /// Angle along the columns, y along the rows.
    #[default]
    AngleY,
    /// Angle along the columns, z along the rows.
    AngleZ,
    /// y along the columns, z along the rows.
    YZ,
}

/// A coordinate of a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The angle in the lab's sense, radians.
    Angle,
    /// y of the object's origin in the grasp frame, meters.
    Y,
    /// z of the same, meters.
    Z,
}

impl Axis {
    /// The coordinate of a pose (`grasp_from_object`), radians or meters.
    pub fn of(self, grasp_from_object: PlanarPose) -> f64 {
        match self {
            Self::Angle => -wrap_angle(grasp_from_object.theta_rad),
            Self::Y => grasp_from_object.y_m,
            Self::Z => grasp_from_object.z_m,
        }
    }

    fn set(self, pose: &mut PlanarPose, value: f64) {
        match self {
            Self::Angle => pose.theta_rad = -value,
            Self::Y => pose.y_m = value,
            Self::Z => pose.z_m = value,
        }
    }
}

impl Plane {
    /// Coordinates that vary along the columns and along the rows.
    pub fn axes(self) -> [Axis; 2] {
        match self {
            Self::AngleY => [Axis::Angle, Axis::Y],
            Self::AngleZ => [Axis::Angle, Axis::Z],
            Self::YZ => [Axis::Y, Axis::Z],
        }
    }
}

/// Grid of starts, and the prior it is drawn with.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BasinConfig {
    /// Plane of the two coordinates that vary; the third coordinate stays 0, the middle of the prior.
    pub plane: Plane,
    /// Columns and rows, at least one each.
    pub size: [usize; 2],
    /// Largest size of the angle, radians.
    pub angle_rad: f64,
    /// Largest size of y and z, meters.
    pub shift_m: f64,
    /// Prior, where the gripper can hold a tool: drawn, and the reason for the range.
    pub prior: Prior,
}

impl BasinConfig {
    /// 31 x 21 starts over twice the prior: steps of 3 degrees and 1 mm (0.67 mm along 31 columns).
    pub fn new(plane: Plane) -> Self {
        let prior = Prior::default();
        Self { plane, size: [31, 21], angle_rad: 2.0 * prior.theta_rad, shift_m: 2.0 * prior.shift_m, prior }
    }

    /// Largest size of a coordinate, radians or meters.
    pub fn reach(&self, axis: Axis) -> f64 {
        if axis == Axis::Angle { self.angle_rad } else { self.shift_m }
    }

    /// The pose that a cell starts from, `grasp_from_object`.
    pub fn start(&self, column: usize, row: usize) -> PlanarPose {
        let mut pose = PlanarPose::default();
        for ((axis, at), count) in self.plane.axes().into_iter().zip([column, row]).zip(self.size) {
            let share = if count > 1 { 2.0 * at as f64 / (count - 1) as f64 - 1.0 } else { 0.0 };
            axis.set(&mut pose, share * self.reach(axis));
        }
        pose
    }
}

/// Outcome of the run from one start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Arrival {
    /// The pose the run began at, `grasp_from_object`: not always the one that was asked for.
    pub applied: PlanarPose,
    /// Pose where the run ended, `grasp_from_object`.
    pub end: PlanarPose,
    /// Cost per point there, square meters; comparable within the map.
    pub cost_m2: f64,
    /// Share of the points near the surface there.
    pub inlier_share: f64,
    /// Steps taken.
    pub iterations: usize,
    /// Why it ended.
    pub stop: Stop,
    /// Position of its basin in [`Basin::basins`].
    pub basin: usize,
}

/// One start of the grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// The pose that was asked for, `grasp_from_object`.
    pub requested: PlanarPose,
    /// Outcome of the run; `None` if there was no answer.
    pub arrival: Option<Arrival>,
    /// Why there was none.
    pub failure: Option<String>,
}

/// Ends that are one place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct End {
    /// The cheapest of them, `grasp_from_object`.
    pub end: PlanarPose,
    /// Cost per point of the cheapest of them, square meters.
    pub cost_m2: f64,
    /// Starts of the grid that lead here.
    pub starts: usize,
}

/// A basin map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Basin {
    /// Grid of starts.
    pub config: BasinConfig,
    /// Row by row.
    pub cells: Vec<Cell>,
    /// The places where starts end, cheapest first.
    pub basins: Vec<End>,
    /// Points that every run used: contact points, or places of the membranes.
    pub points: usize,
    /// Contact points there are.
    pub offered: usize,
}

impl Basin {
    /// The cell of a column and a row.
    pub fn cell(&self, column: usize, row: usize) -> Option<&Cell> {
        if column >= self.config.size[0] {
            return None;
        }
        self.cells.get(row * self.config.size[0] + column)
    }

    /// The cell whose start is nearest to a place in the plane (radians or meters per axis).
    pub fn nearest_cell(&self, at: [f64; 2]) -> Option<&Cell> {
        let axes = self.config.plane.axes();
        let index: [usize; 2] = std::array::from_fn(|i| {
            let count = self.config.size[i];
            let share = (at[i] / self.config.reach(axes[i]) + 1.0) * 0.5;
            (share * (count - 1) as f64).round().clamp(0.0, (count - 1) as f64) as usize
        });
        self.cell(index[0], index[1])
    }

    /// Share of the starts that lead to the cheapest end; 0 without any.
    pub fn winning_share(&self) -> f64 {
        self.basins.first().map_or(0.0, |b| b.starts as f64 / self.cells.len().max(1) as f64)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.cells.len() * size_of::<Cell>() + self.basins.len() * size_of::<End>()
    }
}

/// True where two poses are the same place: within a degree and a millimeter.
pub fn is_same_place(a: PlanarPose, b: PlanarPose) -> bool {
    angle_error(a.theta_rad, b.theta_rad) <= SAME_RAD && (a.y_m - b.y_m).hypot(a.z_m - b.z_m) <= SAME_M
}

/// Runs `register` from every start of the grid, on all cores; `None` if `cancelled` said so meanwhile.
///
/// `register` gets the start asked for and answers with the report of that one run; its trace may be empty, then the
/// start counts as applied as it was asked for. The map does not depend on the order in which cells are done.
pub fn basin(
    config: &BasinConfig,
    offered: usize,
    register: impl Fn(PlanarPose) -> Result<AlignReport, AlignError> + Sync,
    cancelled: impl Fn() -> bool + Sync,
) -> Option<Basin> {
    let [columns, rows] = config.size.map(|n| n.max(1));
    let config = BasinConfig { size: [columns, rows], ..*config };
    let runs: Option<Vec<(Cell, usize)>> = (0..columns * rows)
        .into_par_iter()
        .map(|i| {
            if cancelled() {
                return None;
            }
            let requested = config.start(i % columns, i / columns);
            Some(match register(requested) {
                Ok(report) => {
                    (Cell { requested, arrival: Some(arrival(requested, &report)), failure: None }, report.used)
                }
                Err(err) => (Cell { requested, arrival: None, failure: Some(err.to_string()) }, 0),
            })
        })
        .collect();
    let runs = runs?;
    let points = runs.iter().map(|(_, used)| *used).max().unwrap_or(0);
    let mut cells: Vec<Cell> = runs.into_iter().map(|(cell, _)| cell).collect();
    let basins = sort_into_basins(&mut cells);
    Some(Basin { config, cells, basins, points, offered })
}

fn arrival(requested: PlanarPose, report: &AlignReport) -> Arrival {
    let run = report.runs.get(report.winner);
    Arrival {
        applied: run.map_or(requested, |r| r.start),
        end: report.grasp_from_object,
        cost_m2: run.map_or(f64::NAN, |r| r.cost_m2),
        inlier_share: report.inlier_share,
        iterations: report.iterations,
        stop: report.stop,
        basin: 0,
    }
}

/// Gives every arrival its basin: cheapest first, each joins the first basin whose cheapest end is the same place.
fn sort_into_basins(cells: &mut [Cell]) -> Vec<End> {
    let mut order: Vec<&mut Arrival> = cells.iter_mut().filter_map(|c| c.arrival.as_mut()).collect();
    order.sort_by(|a, b| a.cost_m2.total_cmp(&b.cost_m2));
    let mut basins: Vec<End> = Vec::new();
    for arrival in order {
        arrival.basin = match basins.iter().position(|b| is_same_place(b.end, arrival.end)) {
            Some(at) => at,
            None => {
                basins.push(End { end: arrival.end, cost_m2: arrival.cost_m2, starts: 0 });
                basins.len() - 1
            }
        };
        basins[arrival.basin].starts += 1;
    }
    basins
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::align::testing::{cross, cross_contacts};
    use crate::align::{AlignConfig, align};
    use crate::field::DistanceField;

    const POSE: PlanarPose = PlanarPose { theta_rad: 0.15, y_m: 0.002, z_m: -0.001 };

    fn one(points: &[glam::DVec2], field: &DistanceField, start: PlanarPose) -> Result<AlignReport, AlignError> {
        align(points, field, &AlignConfig { starts: vec![start], points: 256, record: true, ..AlignConfig::default() })
    }

    #[test]
    fn the_map_finds_the_truth_and_every_cell_has_a_basin() {
        let field = DistanceField::from_mesh(&cross()).unwrap();
        let points = cross_contacts(800, POSE, 2e-4, 1);
        for plane in [Plane::AngleY, Plane::AngleZ, Plane::YZ] {
            let config = BasinConfig { size: [9, 7], ..BasinConfig::new(plane) };
            let map = basin(&config, points.len(), |s| one(&points, &field, s), || false).unwrap();
            assert_eq!((map.cells.len(), map.points, map.offered), (63, 256, 800));
            assert!(is_same_place(map.basins[0].end, POSE), "{plane:?}: {:?}", map.basins[0]);
            assert!(map.winning_share() > 0.3, "{plane:?}: {}", map.winning_share());
            assert!(map.basins.windows(2).all(|w| w[0].cost_m2 <= w[1].cost_m2));
            let arrived: usize = map.cells.iter().filter(|c| c.arrival.is_some()).count();
            assert_eq!(map.basins.iter().map(|b| b.starts).sum::<usize>(), arrived);
            for cell in &map.cells {
                match &cell.arrival {
                    Some(a) => {
                        assert!(is_same_place(map.basins[a.basin].end, a.end) && cell.failure.is_none());
                        assert!((a.applied.theta_rad - cell.requested.theta_rad).abs() < 1e-12);
                    }
                    None => assert!(cell.failure.is_some()),
                }
            }
        }
    }

    #[test]
    fn starts_cover_the_range_in_the_sense_on_screen() {
        let config = BasinConfig::new(Plane::AngleY);
        let (first, last) = (config.start(0, 0), config.start(30, 20));
        assert!((Axis::Angle.of(first) + 45f64.to_radians()).abs() < 1e-12 && (first.y_m + 0.01).abs() < 1e-12);
        assert!((Axis::Angle.of(last) - 45f64.to_radians()).abs() < 1e-12 && (last.y_m - 0.01).abs() < 1e-12);
        assert_eq!(Axis::Angle.of(last), last.inverse().theta_rad, "the angle that the lab reports");
        assert!(config.start(15, 10).theta_rad.abs() < 1e-12);
        let config = BasinConfig { size: [1, 0], ..config };
        let map = basin(&config, 0, |_| Err(AlignError::NoOverlap { share: 0.0 }), || false).unwrap();
        assert_eq!((map.cells.len(), map.basins.len(), map.winning_share()), (1, 0, 0.0));
        assert_eq!(map.cells[0].requested, PlanarPose::default());
        assert!(map.nearest_cell([f64::NAN, 1e9]).is_some() && map.cell(1, 0).is_none() && map.cell(0, 1).is_none());
    }

    #[test]
    fn being_told_to_stop_ends_it() {
        let asked = AtomicUsize::new(0);
        let config = BasinConfig::new(Plane::YZ);
        let map = basin(
            &config,
            0,
            |_| {
                asked.fetch_add(1, Ordering::Relaxed);
                Err(AlignError::NoOverlap { share: 0.0 })
            },
            || asked.load(Ordering::Relaxed) >= 5,
        );
        assert!(map.is_none() && asked.load(Ordering::Relaxed) < 31 * 21);
    }
}
