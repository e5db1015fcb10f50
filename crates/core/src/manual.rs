//! Poses set by hand: small steps, and what a pose costs.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::field::DistanceField;
use super::frames::PlanarPose;
use super::mesh::MeshDistance;
use super::mesh::sampling::spread;
use super::units::angle_error;

/// Step of a shift by key, meters.
pub const STEP_M: f64 = 1e-4;
/// Step of a turn by key, radians (half a degree).
pub const STEP_RAD: f64 = 0.5 / 180.0 * std::f64::consts::PI;

/// One of the ways to move a tool by hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, strum::EnumIter)]
pub enum PoseAxis {
    /// Lateral shift.
    Y,
    /// Shift along the tool.
    Z,
    /// Turn about the closing axis.
    Theta,
}

impl PoseAxis {
    /// Size of one step, meters or radians.
    pub fn step(self) -> f64 {
        if self == Self::Theta { STEP_RAD } else { STEP_M }
    }

    /// The pose moved along it in the grasp frame, in meters or radians. Turns are about the object's origin.
    #[must_use]
    pub fn moved(self, mut pose: PlanarPose, by: f64) -> PlanarPose {
        match self {
            Self::Y => pose.y_m += by,
            Self::Z => pose.z_m += by,
            Self::Theta => pose.theta_rad += by,
        }
        pose
    }
}

/// A pose that a person accepted for a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AcceptedPose {
    /// `grasp_from_object`.
    #[serde(flatten)]
    pub pose: PlanarPose,
    /// True where a person set it, rather than took over what a registration answered.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub by_hand: bool,
}

impl From<PlanarPose> for AcceptedPose {
    /// A registration's answer, taken over as it is.
    fn from(planar: PlanarPose) -> Self {
        Self { pose: planar, by_hand: false }
    }
}

/// Difference of two planar poses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PoseDifference {
    /// Size of the difference of the angles, radians.
    pub angle_rad: f64,
    /// Distance between the places of the object's origin, meters.
    pub position_m: f64,
}

impl PoseDifference {
    /// Between two `grasp_from_object`.
    pub fn between(a: PlanarPose, b: PlanarPose) -> Self {
        Self { angle_rad: angle_error(a.theta_rad, b.theta_rad), position_m: (a.y_m - b.y_m).hypot(a.z_m - b.z_m) }
    }
}

/// Cost of a pose, whoever made it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ManualCost {
    /// Root mean square distance of the points to the tool's outline in the plane, those inside counted as zero,
    /// meters. NaN without a point.
    pub outline_rms_m: f64,
    /// Robust cost per point as the registration counts it, square meters. NaN without a point.
    pub cost_m2: f64,
    /// Share of the points within the kernel, 0 to 1. NaN without a point.
    pub inlier_share: f64,
    /// Root mean square distance of the points to the tool's surface in space, meters. NaN without a point.
    pub surface_rms_m: f64,
    /// Points looked at.
    pub points: usize,
}

/// Points looked at: as many as the registration uses, so that a drag is answered within a frame.
const COST_POINTS: usize = 512;

/// Cost of `pose`, for at most 512 of the contact points (meters, grasp frame), spread evenly; points that are not
/// finite are left out. `kernel_m` is the width of the Geman-McClure kernel.
pub fn cost(
    points: &[DVec3],
    field: &DistanceField,
    surface: &MeshDistance,
    pose: PlanarPose,
    kernel_m: f64,
) -> ManualCost {
    let object_from_grasp = pose.to_affine().inverse();
    let (mut squares, mut robust, mut inliers, mut to_surface, mut count) = (0.0, 0.0, 0usize, 0.0, 0usize);
    for point in spread(points.len(), COST_POINTS).into_iter().map(|i| points[i]).filter(|p| p.is_finite()) {
        let q = object_from_grasp.transform_point3(point);
        let r = field.sample(DVec2::new(q.y, q.z)).distance.max(0.0);
        let d = surface.unsigned(q);
        if !(r.is_finite() && d.is_finite()) {
            continue;
        }
        squares += r * r;
        robust += r * r / (1.0 + (r / kernel_m).powi(2));
        inliers += usize::from(r <= kernel_m);
        to_surface += d * d;
        count += 1;
    }
    let n = count as f64;
    ManualCost {
        outline_rms_m: (squares / n).sqrt(),
        cost_m2: robust / n,
        inlier_share: inliers as f64 / n,
        surface_rms_m: (to_surface / n).sqrt(),
        points: count,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::testing::{cross, cross_contacts};
    use strum::IntoEnumIterator as _;

    #[test]
    fn a_pose_that_left_the_plane_is_read_as_its_part_in_it() {
        let pose = PlanarPose { theta_rad: 0.3, y_m: 0.004, z_m: -0.002 };
        let stored =
            r#"{"theta_rad": 0.3, "y_m": 0.004, "z_m": -0.002, "x_m": 0.001, "pitch_rad": 0.1, "by_hand": true}"#;
        assert_eq!(serde_json::from_str::<AcceptedPose>(stored).unwrap(), AcceptedPose { pose, by_hand: true });
        let plain = serde_json::to_string(&AcceptedPose::from(pose)).unwrap();
        assert_eq!(plain, serde_json::to_string(&pose).unwrap());
    }

    #[test]
    fn each_axis_moves_the_tool_as_its_name_says() {
        let start = PlanarPose::default();
        let tip = DVec3::new(0.0, 0.0, 0.02);
        for axis in PoseAxis::iter() {
            let moved = axis.moved(start, axis.step());
            let by = moved.to_affine().transform_point3(tip) - tip;
            let want = match axis {
                PoseAxis::Y => DVec3::Y * STEP_M,
                PoseAxis::Z => DVec3::Z * STEP_M,
                // y turns towards z about x.
                PoseAxis::Theta => DVec3::Y * (-0.02 * STEP_RAD.sin()),
            };
            assert!((by - want).length() < 1e-6, "{axis:?}: {by}");
        }
    }

    #[test]
    fn the_true_pose_costs_least() {
        let mesh = cross();
        let (field, surface) = (DistanceField::from_mesh(&mesh).unwrap(), MeshDistance::new(&mesh).unwrap());
        let truth = PlanarPose { theta_rad: 0.1, y_m: 0.001, z_m: -0.002 };
        let mut points: Vec<DVec3> =
            cross_contacts(3000, truth, 1e-4, 3).iter().map(|p| DVec3::new(0.003, p.x, p.y)).collect();
        points.push(DVec3::NAN);
        let cost_of = |pose: PlanarPose| cost(&points, &field, &surface, pose, 1e-3);
        let best = cost_of(truth);
        assert!(best.inlier_share > 0.99 && best.outline_rms_m < 2e-4 && best.surface_rms_m < 2e-4, "{best:?}");
        for axis in PoseAxis::iter() {
            let by = if axis == PoseAxis::Theta { 0.15 } else { 0.003 };
            let moved = cost_of(axis.moved(truth, by));
            assert!(moved.surface_rms_m > best.surface_rms_m, "{axis:?}: {moved:?}");
            assert!(moved.cost_m2 > 2.0 * best.cost_m2, "{axis:?}: {moved:?}");
        }
        let none = cost(&[], &field, &surface, truth, 1e-3);
        assert!(none.cost_m2.is_nan() && none.points == 0);
        let gap = PoseDifference::between(truth, PlanarPose { theta_rad: 0.1 - std::f64::consts::TAU, ..truth });
        assert!(gap.angle_rad < 1e-12 && gap.position_m == 0.0);
    }
}
