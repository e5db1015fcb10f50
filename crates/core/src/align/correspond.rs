//! Correspondences at a pose: which point of the tool every contact point is pulled to, how far, and how strongly.
//!
//! Everything is planar, in `(y, z)`: that is what the registrations move. The answer is a pure function of the
//! pose, so a recorded run stores poses only and this is asked for the one step that is looked at.

use glam::DVec2;

use super::LabModel;
use crate::field::DistanceField;
use crate::frames::PlanarPose;
use crate::mesh::sampling::spread;

/// Surface that contact points are compared with.
#[derive(Clone, Copy, Debug)]
pub enum Surface<'a> {
    /// The nearest point of the silhouette; points on the silhouette are where they should be.
    Silhouette(&'a DistanceField),
    /// The nearest point of a model that has some, inside or not.
    Points(&'a LabModel),
}

/// One contact point and its counterpart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Position in the list of points offered.
    pub point: usize,
    /// The counterpart, `(y, z)`, meters, grasp frame.
    pub foot_yz: DVec2,
    /// Distance that the point pays for, meters.
    pub residual_m: f64,
    /// Weight in [0, 1] under the kernel.
    pub weight: f64,
}

/// The correspondences that are shown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matches {
    /// In the order of the points.
    pub list: Vec<Match>,
    /// Finite points there are.
    pub of: usize,
}

impl Matches {
    /// Median and largest residual of the list, meters; `None` without a match.
    pub fn median_and_max_m(&self) -> Option<[f64; 2]> {
        let mut all: Vec<f64> = self.list.iter().map(|m| m.residual_m).collect();
        all.sort_by(f64::total_cmp);
        Some([*all.get(all.len() / 2)?, *all.last()?])
    }
}

/// Correspondences of at most `most` points, evenly thinned; points that are not finite have none.
///
/// `points_yz` are `(y, z)` in the grasp frame, meters; `kernel_m` is the width of the Geman-McClure kernel, infinite
/// without one. A pose that is not finite has no correspondences.
pub fn correspondences(
    points_yz: &[DVec2],
    surface: Surface<'_>,
    grasp_from_object: PlanarPose,
    kernel_m: f64,
    most: usize,
) -> Matches {
    let finite: Vec<usize> = (0..points_yz.len()).filter(|&i| points_yz[i].is_finite()).collect();
    let of = finite.len();
    if !grasp_from_object.is_finite() {
        return Matches { list: Vec::new(), of };
    }
    let object_from_grasp = grasp_from_object.inverse();
    let list = spread(of, most)
        .into_iter()
        .map(|i| {
            let point = finite[i];
            let in_object = object_from_grasp.transform_yz(points_yz[point]);
            let (foot, residual_m) = match surface {
                Surface::Silhouette(field) => foot_on_silhouette(field, in_object),
                Surface::Points(points) => {
                    let foot = points.point(points.nearest(in_object).0);
                    (foot, foot.distance(in_object))
                }
            };
            let ratio = if kernel_m.is_finite() { 1.0 / (1.0 + (residual_m / kernel_m).powi(2)) } else { 1.0 };
            Match { point, foot_yz: grasp_from_object.transform_yz(foot), residual_m, weight: ratio * ratio }
        })
        .collect();
    Matches { list, of }
}

/// The nearest point of the silhouette and the distance to it, meters; a point on the silhouette is its own.
fn foot_on_silhouette(field: &DistanceField, at: DVec2) -> (DVec2, f64) {
    let sample = field.sample(at);
    let residual = sample.distance.max(0.0);
    let mut foot = at;
    // Once is exact where the outline is straight; a second time corrects what the grid rounds at corners.
    for _ in 0..2 {
        let sample = field.sample(foot);
        if let (true, Some(outwards)) = (sample.distance > 0.0, sample.gradient.try_normalize()) {
            foot -= outwards * sample.distance;
        }
    }
    (foot, residual)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::testing::{cross, cross_contacts};
    use glam::DVec3;

    const POSE: PlanarPose = PlanarPose { theta_rad: 0.2, y_m: 0.003, z_m: -0.001 };

    #[test]
    fn feet_lie_on_the_silhouette_as_far_away_as_the_residual_says() {
        let field = DistanceField::from_mesh(&cross()).unwrap();
        let mut points = cross_contacts(400, POSE, 2e-3, 3);
        points.push(DVec2::new(f64::NAN, 0.0));
        points.push(DVec2::new(0.2, 0.1));
        let matches = correspondences(&points, Surface::Silhouette(&field), POSE, 2e-3, 1000);
        assert_eq!((matches.list.len(), matches.of), (401, 401));
        for m in &matches.list[..400] {
            let in_object = POSE.inverse().transform_yz(m.foot_yz);
            // A cell of the field is 0.25 mm; corners are rounded by a part of it.
            assert!(field.sample(in_object).distance < 1e-4, "{m:?}");
            assert!((m.foot_yz.distance(points[m.point]) - m.residual_m).abs() < 2e-4, "{m:?}");
            assert!(m.weight > 0.0 && m.weight <= 1.0);
            assert_eq!(m.residual_m == 0.0, m.weight == 1.0, "what pays nothing weighs all");
        }
        let far = matches.list.last().unwrap();
        assert!(far.point == 401 && far.residual_m > 0.1 && far.weight < 1e-3);
        // Thinned, the same points have the same counterparts.
        let thin = correspondences(&points, Surface::Silhouette(&field), POSE, 2e-3, 50);
        assert_eq!((thin.list.len(), thin.of), (50, 401));
        assert!(thin.list.iter().all(|m| matches.list.contains(m)));
        let [median, max] = matches.median_and_max_m().unwrap();
        assert!(median < 2e-3 && max == far.residual_m);
    }

    fn model_of(points_yz: &[DVec2]) -> LabModel {
        LabModel::new(&points_yz.iter().map(|p| DVec3::new(0.0, p.x, p.y)).collect::<Vec<_>>())
    }

    #[test]
    fn the_nearest_model_point_is_the_nearest() {
        let model = cross_contacts(300, PlanarPose::default(), 0.0, 5);
        let points = model_of(&model);
        for at in cross_contacts(200, POSE, 5e-3, 6) {
            let brute = model.iter().map(|p| p.distance_squared(at)).fold(f64::INFINITY, f64::min);
            assert_eq!(points.point(points.nearest(at).0).distance_squared(at), brute);
        }
        let matches = correspondences(&model, Surface::Points(&points), PlanarPose::default(), f64::INFINITY, 10);
        assert!(matches.list.iter().all(|m| m.residual_m == 0.0 && m.weight == 1.0));
    }

    #[test]
    fn nothing_gives_nothing() {
        let none = model_of(&[DVec2::NAN]);
        let at = |points: &[DVec2], pose| correspondences(points, Surface::Points(&none), pose, 1e-3, 10);
        assert_eq!(at(&[], POSE), Matches::default());
        assert_eq!(at(&[], POSE).median_and_max_m(), None);
        let nowhere = PlanarPose { theta_rad: f64::NAN, ..POSE };
        assert_eq!(at(&[DVec2::ZERO], nowhere), Matches { list: Vec::new(), of: 1 });
    }
}
