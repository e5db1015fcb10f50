//! Distances in both directions: from the contact points to the tool, and from the tool to the contact points.
//!
//! They answer different questions. Scene to model says how well the touch lies on the tool; model to scene says how
//! much of the tool was touched, and is large for a good pose wherever the fingers did not reach.

use glam::DVec2;
use serde::Serialize;

use super::DistanceField;
use crate::domain::frames::PlanarPose;
use crate::domain::mesh::sampling::spread;

/// Distance up to which two surfaces count as touching, metres.
pub const OVERLAP_M: f64 = 1e-3;
/// Points looked at on each side: the search of the second direction is over all pairs.
const POINTS: usize = 1500;

/// Distances in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Direction {
    /// Root mean square distance, metres; NaN without a point.
    pub rms_m: f64,
    /// Share of the points within [`OVERLAP_M`], 0 to 1; NaN without a point.
    pub overlap: f64,
    /// Points measured from.
    pub points: usize,
}

/// Distances in both directions, in the plane of the tool.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BothWays {
    /// Contact points to the tool's silhouette; those on it count as zero.
    pub scene_to_model: Direction,
    /// Points of the tool's surface to the nearest contact point.
    pub model_to_scene: Direction,
}

/// Measures both directions. Contact points are `(y, z)` in the grasp frame, model points `(y, z)` in the object
/// frame, metres; at most 1500 of each are looked at, spread evenly. Points that are not finite are left out.
pub fn both_ways(
    points_yz: &[DVec2],
    model_yz: &[DVec2],
    field: &DistanceField,
    grasp_from_object: PlanarPose,
) -> BothWays {
    let object_from_grasp = grasp_from_object.inverse();
    let finite: Vec<DVec2> = points_yz.iter().copied().filter(|p| p.is_finite()).collect();
    let scene: Vec<DVec2> =
        spread(finite.len(), POINTS).into_iter().map(|i| object_from_grasp.transform_yz(finite[i])).collect();
    let model = spread(model_yz.len(), POINTS).into_iter().map(|i| model_yz[i]).filter(|p| p.is_finite());
    let to_scene = |m: DVec2| scene.iter().map(|s| s.distance_squared(m)).fold(f64::INFINITY, f64::min).sqrt();
    BothWays {
        scene_to_model: direction(scene.iter().map(|s| field.sample(*s).distance.max(0.0))),
        model_to_scene: direction(model.map(to_scene).filter(|d| d.is_finite())),
    }
}

fn direction(distances: impl Iterator<Item = f64>) -> Direction {
    let (mut squares, mut near, mut points) = (0.0, 0usize, 0usize);
    for d in distances {
        squares += d * d;
        near += usize::from(d <= OVERLAP_M);
        points += 1;
    }
    let n = points as f64;
    Direction { rms_m: (squares / n).sqrt(), overlap: near as f64 / n, points }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::align::testing::{cross, cross_contacts};

    #[test]
    fn half_a_touch_fits_the_tool_but_covers_half_of_it() {
        let mesh = cross();
        let field = DistanceField::from_mesh(&mesh).unwrap();
        let model: Vec<DVec2> = mesh.sample_surface(3000, 0).iter().map(|p| DVec2::new(p.y, p.z)).collect();
        let pose = PlanarPose { theta_rad: 0.2, y_m: 0.003, z_m: 0.001 };
        let points = cross_contacts(4000, pose, 1e-4, 5);
        let all = both_ways(&points, &model, &field, pose);
        assert!(all.scene_to_model.overlap > 0.99 && all.scene_to_model.rms_m < 2e-4, "{all:?}");
        assert!(all.model_to_scene.overlap > 0.95, "{all:?}");
        let half: Vec<DVec2> = points.iter().copied().filter(|p| p.y > 0.001).chain([DVec2::NAN]).collect();
        let part = both_ways(&half, &model, &field, pose);
        assert!(part.scene_to_model.overlap > 0.99, "{part:?}");
        assert!((0.3..0.7).contains(&part.model_to_scene.overlap), "{part:?}");
        assert!(part.model_to_scene.rms_m > 5.0 * part.scene_to_model.rms_m);
        let moved = PlanarPose { y_m: pose.y_m + 0.004, ..pose };
        assert!(both_ways(&points, &model, &field, moved).scene_to_model.rms_m > 1e-3);
        let none = both_ways(&[], &model, &field, pose);
        assert!(none.scene_to_model.rms_m.is_nan() && none.model_to_scene.points == 0);
    }
}
