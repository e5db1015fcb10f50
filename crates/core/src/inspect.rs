//! Looking into a registration: what a step compares.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::align::correspond::{Matches, Surface, correspondences};
use super::align::{LabModel, TraceStep};
use super::pose::{Registration, ToolModel};

/// Model that contact points are compared with at any step of a run, prepared once per tool.
#[derive(Clone, Debug)]
pub struct Counterparts {
    model: Option<Arc<LabModel>>,
}

impl Counterparts {
    /// For a registration with a tool.
    pub fn new(tool: &ToolModel, engine: Registration) -> Self {
        Self { model: (engine == Registration::LabIcp).then(|| LabModel::of(tool)) }
    }

    /// The correspondences of a step, of at most `most` points. `tool` is that of [`Self::new`]. Some 10 µs for
    /// 300 points with the field, below a millisecond with model points.
    pub fn at(&self, points: &[DVec3], tool: &ToolModel, step: &TraceStep, most: usize) -> Matches {
        let surface = match &self.model {
            Some(model) => Surface::Points(model),
            None => Surface::Silhouette(&tool.field),
        };
        let points: Vec<DVec2> = points.iter().map(|p| DVec2::new(p.y, p.z)).collect();
        correspondences(&points, surface, step.grasp_from_object, step.kernel_m, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::Ask;
    use crate::align::testing::{cross, cross_contacts};
    use crate::frames::PlanarPose;
    use crate::pose::{Registration, register, register_with};
    use crate::units::angle_error;
    use strum::IntoEnumIterator as _;

    const POSE: PlanarPose = PlanarPose { theta_rad: 0.1, y_m: 0.002, z_m: -0.001 };

    fn contacts(count: usize) -> Vec<DVec3> {
        let yz = cross_contacts(count, POSE, 2e-4, 1);
        yz.into_iter().enumerate().map(|(i, p)| DVec3::new(0.001 * (i % 3) as f64, p.x, p.y)).collect()
    }

    /// True where two poses are the same place: within a degree and a millimeter.
    fn is_same_place(a: PlanarPose, b: PlanarPose) -> bool {
        angle_error(a.theta_rad, b.theta_rad) <= 1f64.to_radians() && (a.y_m - b.y_m).hypot(a.z_m - b.z_m) <= 1e-3
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
            let told = register_with(
                &*engine.method(),
                &points,
                &tool,
                Ask { starts: Some(&[start]), record: true, ..Ask::default() },
            )
            .unwrap();
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
}
