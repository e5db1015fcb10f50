//! Poses set by hand: the planar pose with what a planar pose leaves out, small steps, and what a pose costs.

use glam::{DAffine3, DQuat, DVec2, DVec3};
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

/// The tool's pose in the hand with all six numbers: `grasp_from_object`.
///
/// The planar part is what registration answers; the other three are zero unless a person set them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ManualPose {
    /// Angle about x, shift along y and z.
    #[serde(flatten)]
    pub planar: PlanarPose,
    /// Shift along the closing axis, meters.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub x_m: f64,
    /// Angle about y, radians, applied after `yaw_rad` and before the planar angle.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub pitch_rad: f64,
    /// Angle about z, radians, applied first.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub yaw_rad: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the form that serde asks for")]
fn is_zero(v: &f64) -> bool {
    *v == 0.0
}

/// One of the six ways to move a tool by hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, strum::EnumIter)]
pub enum PoseAxis {
    /// Lateral shift.
    Y,
    /// Shift along the tool.
    Z,
    /// Turn about the closing axis.
    Theta,
    /// Shift along the closing axis.
    X,
    /// Turn about y.
    Pitch,
    /// Turn about z.
    Yaw,
}

impl PoseAxis {
    /// Size of one step, meters or radians.
    pub fn step(self) -> f64 {
        if self.is_turn() { STEP_RAD } else { STEP_M }
    }

    /// True for a turn.
    pub(crate) fn is_turn(self) -> bool {
        matches!(self, Self::Theta | Self::Pitch | Self::Yaw)
    }

    /// True where it leaves the plane of the registration.
    pub fn leaves_plane(self) -> bool {
        matches!(self, Self::X | Self::Pitch | Self::Yaw)
    }
}

impl From<PlanarPose> for ManualPose {
    fn from(planar: PlanarPose) -> Self {
        Self { planar, ..Self::default() }
    }
}

impl ManualPose {
    /// The motion in space: from the object frame to the grasp frame.
    pub fn to_affine(self) -> DAffine3 {
        let turn = DQuat::from_rotation_x(self.planar.theta_rad)
            * DQuat::from_rotation_y(self.pitch_rad)
            * DQuat::from_rotation_z(self.yaw_rad);
        DAffine3::from_rotation_translation(turn, DVec3::new(self.x_m, self.planar.y_m, self.planar.z_m))
    }

    /// True where every number is finite.
    pub fn is_finite(self) -> bool {
        self.planar.is_finite() && self.x_m.is_finite() && self.pitch_rad.is_finite() && self.yaw_rad.is_finite()
    }

    /// True where it lies in the plane of the registration.
    pub fn is_planar(self) -> bool {
        self.x_m == 0.0 && self.pitch_rad == 0.0 && self.yaw_rad == 0.0
    }

    /// The pose moved along one axis of the grasp frame, in meters or radians. Turns are about the object's origin.
    #[must_use]
    pub fn moved(mut self, axis: PoseAxis, by: f64) -> Self {
        match axis {
            PoseAxis::Y => self.planar.y_m += by,
            PoseAxis::Z => self.planar.z_m += by,
            PoseAxis::Theta => self.planar.theta_rad += by,
            PoseAxis::X => self.x_m += by,
            PoseAxis::Pitch => self.pitch_rad += by,
            PoseAxis::Yaw => self.yaw_rad += by,
        }
        self
    }
}

/// A pose that a person accepted for a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AcceptedPose {
    /// `grasp_from_object`.
    #[serde(flatten)]
    pub pose: ManualPose,
    /// True where a person set it, rather than took over what a registration answered.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub by_hand: bool,
}

impl From<PlanarPose> for AcceptedPose {
    /// A registration's answer, taken over as it is.
    fn from(planar: PlanarPose) -> Self {
        Self { pose: planar.into(), by_hand: false }
    }
}

impl AcceptedPose {
    /// True where an older reader, which knows planar poses only, understands all of it.
    pub fn is_plain(self) -> bool {
        !self.by_hand && self.pose.is_planar()
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
    pose: ManualPose,
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
    fn a_planar_hand_pose_is_the_planar_pose() {
        let planar = PlanarPose { theta_rad: 0.3, y_m: 0.004, z_m: -0.002 };
        let hand = ManualPose::from(planar);
        assert!(hand.is_planar() && hand.to_affine().abs_diff_eq(planar.to_affine(), 1e-15));
        // Old labels hold the planar pose alone: they are read, and a planar hand pose is written as before.
        let old = serde_json::to_string(&planar).unwrap();
        assert_eq!(serde_json::from_str::<ManualPose>(&old).unwrap(), hand);
        assert_eq!(serde_json::to_string(&hand).unwrap(), old);
        let tilted = hand.moved(PoseAxis::Pitch, 0.1).moved(PoseAxis::X, 1e-3);
        let json = serde_json::to_string(&tilted).unwrap();
        assert_eq!(serde_json::from_str::<ManualPose>(&json).unwrap(), tilted);
    }

    #[test]
    fn each_axis_moves_the_tool_as_its_name_says() {
        let start = ManualPose::default();
        let tip = DVec3::new(0.0, 0.0, 0.02);
        for axis in PoseAxis::iter() {
            let moved = start.moved(axis, axis.step());
            assert_eq!(moved.is_planar(), !axis.leaves_plane(), "{axis:?}");
            let by = moved.to_affine().transform_point3(tip) - tip;
            let want = match axis {
                PoseAxis::X => DVec3::X * STEP_M,
                PoseAxis::Y => DVec3::Y * STEP_M,
                PoseAxis::Z => DVec3::Z * STEP_M,
                // y turns towards z about x, z towards x about y; about its own axis the tip stays.
                PoseAxis::Theta => DVec3::Y * (-0.02 * STEP_RAD.sin()),
                PoseAxis::Pitch => DVec3::X * (0.02 * STEP_RAD.sin()),
                PoseAxis::Yaw => DVec3::ZERO,
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
        let cost_of = |pose: ManualPose| cost(&points, &field, &surface, pose, 1e-3);
        let best = cost_of(truth.into());
        assert!(best.inlier_share > 0.99 && best.outline_rms_m < 2e-4 && best.surface_rms_m < 2e-4, "{best:?}");
        for axis in PoseAxis::iter() {
            let by = if axis.is_turn() { 0.15 } else { 0.003 };
            let moved = cost_of(ManualPose::from(truth).moved(axis, by));
            assert!(moved.surface_rms_m > best.surface_rms_m, "{axis:?}: {moved:?}");
            if !axis.leaves_plane() {
                assert!(moved.cost_m2 > 2.0 * best.cost_m2, "{axis:?}: {moved:?}");
            }
        }
        let none = cost(&[], &field, &surface, truth.into(), 1e-3);
        assert!(none.cost_m2.is_nan() && none.points == 0);
        let gap = PoseDifference::between(truth, PlanarPose { theta_rad: 0.1 - std::f64::consts::TAU, ..truth });
        assert!(gap.angle_rad < 1e-12 && gap.position_m == 0.0);
    }
}
