//! Looking into a registration: the map of where starts lead, and what a step compares.
//!
//! The studio's time machine and basin map and the command line's `basin` call these.

use glam::{DVec2, DVec3};

use super::align::basin::{Basin, BasinConfig, basin};
use super::align::correspond::{Matches, ModelPoints, Surface, correspondences};
use super::align::{Contacts, TraceStep};
use super::mesh::sampling::spread;
use super::pose::{Registration, RegistrationChoice, ToolModel, register, register_from};

/// Contact points per run of a basin map with the distance field: more move its ends by less than a line is wide.
const MAP_POINTS: usize = 512;
/// Contact points per run with registrations that ask a tree for every point and iteration: 651 runs must take about a
/// second.
const MAP_POINTS_COSTLY: usize = 96;

/// Basin map: where every start of a grid leads; `None` if `cancelled` said so meanwhile.
///
/// The map is of the cost that decided the pose: where membranes say too little and the mask alone answers, of the mask
/// alone. Costly registrations get fewer points, evenly thinned; [`Basin::points`] and [`Basin::offered`] say so.
pub fn basin_map<'a>(
    contacts: impl Into<Contacts<'a>>,
    tool: &ToolModel,
    engine: impl Into<RegistrationChoice>,
    config: &BasinConfig,
    cancelled: impl Fn() -> bool + Sync,
) -> Option<Basin> {
    let (engine, Contacts { points, images }) = (engine.into(), contacts.into());
    let finite: Vec<DVec3> = points.iter().copied().filter(|p| p.is_finite()).collect();
    let most = if engine.by.uses_field() { MAP_POINTS } else { MAP_POINTS_COSTLY };
    let thinned: Vec<DVec3> = spread(finite.len(), most).into_iter().map(|i| finite[i]).collect();
    let whole = Contacts { points: &thinned, images };
    let by_membrane = || register(whole, tool, engine, false).ok()?.joint.map(|fit| fit.basis.has_membrane());
    let images = if images.is_empty() || by_membrane() == Some(true) { images } else { &[] };
    let contacts = Contacts { points: &thinned, images };
    basin(config, points.len(), |start| register_from(contacts, tool, engine, start, false), cancelled)
}

/// Model that contact points are compared with at any step of a run, prepared once per tool.
#[derive(Clone, Debug)]
pub struct Counterparts {
    model: Option<ModelPoints>,
}

impl Counterparts {
    /// For a registration with a tool.
    pub fn new(tool: &ToolModel, engine: Registration) -> Self {
        Self {
            model: (!engine.uses_field()).then(|| {
                let surface = tool.surface().iter().map(|(p, _)| *p);
                ModelPoints::new(&in_plane(&surface.collect::<Vec<_>>()))
            }),
        }
    }

    /// The correspondences of a step, of at most `most` points. `tool` is that of [`Self::new`]. Some 10 µs for
    /// 300 points with the field, below a millisecond with model points.
    pub fn at(&self, points: &[DVec3], tool: &ToolModel, step: &TraceStep, most: usize) -> Matches {
        let surface = match &self.model {
            Some(model) => Surface::Points(model),
            None => Surface::Silhouette(&tool.field),
        };
        correspondences(&in_plane(points), surface, step.grasp_from_object, step.kernel_m, most)
    }
}

fn in_plane(points: &[DVec3]) -> Vec<DVec2> {
    points.iter().map(|p| DVec2::new(p.y, p.z)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::basin::{Plane, is_same_place};
    use crate::align::testing::{cross, cross_contacts};
    use crate::frames::PlanarPose;
    use strum::IntoEnumIterator as _;

    const POSE: PlanarPose = PlanarPose { theta_rad: 0.1, y_m: 0.002, z_m: -0.001 };

    fn contacts(count: usize) -> Vec<DVec3> {
        let yz = cross_contacts(count, POSE, 2e-4, 1);
        yz.into_iter().enumerate().map(|(i, p)| DVec3::new(0.001 * (i % 3) as f64, p.x, p.y)).collect()
    }

    #[test]
    fn every_engine_records_its_run_and_starts_where_it_is_told() {
        let tool = ToolModel::new(cross()).unwrap();
        let points = contacts(600);
        let start = PlanarPose { theta_rad: 0.12, y_m: 0.0, z_m: 0.001 };
        for engine in Registration::iter() {
            let own = register(&points, &tool, engine, true).unwrap();
            let plain = register(&points, &tool, engine, false).unwrap();
            assert_eq!(own.grasp_from_object, plain.grasp_from_object, "{engine}: looking changes nothing");
            assert!(!own.trace.is_empty() && plain.trace.is_empty(), "{engine}");
            let told = register_from(&points, &tool, engine, start, true).unwrap();
            let first = told.trace[0].grasp_from_object;
            assert_eq!(told.runs.len(), 1, "{engine}");
            assert!(is_same_place(first, start) && told.trace[0].iteration == 0, "{engine}: {first:?}");
            let last = told.trace.last().unwrap();
            assert!(is_same_place(last.grasp_from_object, told.grasp_from_object), "{engine}");
            let matches = Counterparts::new(&tool, engine).at(&points, &tool, last, 300);
            assert_eq!((matches.list.len(), matches.of), (300, 600), "{engine}");
            let [median, _] = matches.median_and_max_m().unwrap();
            assert!(median < 2e-3, "{engine}: {median}");
        }
    }

    #[test]
    fn a_map_says_how_many_points_it_used() {
        let tool = ToolModel::new(cross()).unwrap();
        let mut points = contacts(900);
        points.push(DVec3::NAN);
        for engine in Registration::iter() {
            let config = BasinConfig { size: [5, 3], ..BasinConfig::new(Plane::AngleY) };
            let map = basin_map(&points, &tool, engine, &config, || false).unwrap();
            let most = if engine.uses_field() { MAP_POINTS } else { MAP_POINTS_COSTLY };
            assert_eq!((map.points, map.offered, map.cells.len()), (most, 901, 15), "{engine}");
            assert!(basin_map(&points, &tool, engine, &config, || true).is_none());
        }
        let none =
            basin_map(&[] as &[DVec3], &tool, Registration::default(), &BasinConfig::new(Plane::YZ), || false).unwrap();
        assert!(none.cells.iter().all(|c| c.failure.is_some()) && none.basins.is_empty());
    }
}
