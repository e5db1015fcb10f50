//! [`Uncertainty`]: spread of the errors that a pose may have, and [`Prior::slid_in`], which goes by it.

use glam::DVec2;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::observability::{Observability, observability};
use super::{ANGLE_SCALE_M, Prior};
use crate::field::DistanceField;
use crate::frames::PlanarPose;
use crate::rig::CameraTolerance;

/// Standard deviation of a place, where it is known least, beyond which the contact leaves it open, meters. The gripper alone knows
/// it to 2.9 mm.
pub const PLACE_OPEN_M: f64 = 1.75e-3;

/// Spread of the errors of a pose, as a normal distribution about it.
///
/// It is the inverse of what is known: how much the cost rises when the tool moves, by the noise that is left; what the
/// gripper can hold at all; and the mounting of the cameras. What the contact leaves open (a rod along itself) is as wide as
/// the gripper is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// Covariance of `grasp_from_object`: angle (radians), y and z (meters).
    pub covariance: [[f64; 3]; 3],
    /// Middle of what was compared, `(y, z)`, meters, grasp frame: there the place is known best.
    pub center: DVec2,
}

/// Deviation of the place, y and z, that no finger can see alone: where the template is not the membrane's own law, or the
/// camera, which looks obliquely along z, does not see behind the tool. From fresh grasps under two laws.
const LAW_M: [f64; 2] = [0.2e-3, 0.28e-3];
/// Deviation of a mask's whole outline, meters: its errors go together. From fresh grasps with masks that fit.
const OUTLINE_M: f64 = 0.07e-3;

impl Uncertainty {
    /// From the information (inverse covariance) about (angle times [`ANGLE_SCALE_M`], y, z) of the tool turned about
    /// `center`, grasp frame, of so many cameras, each with a mount of its own.
    pub(super) fn new(
        information: Matrix3<f64>,
        center: DVec2,
        pose: PlanarPose,
        (mount, cameras): (CameraTolerance, f64),
    ) -> Self {
        let Prior { theta_rad, shift_m } = Prior::default();
        // Of an even distribution.
        let held = [theta_rad * ANGLE_SCALE_M, shift_m, shift_m].map(|half| half * half / 3.0);
        let held_only = Matrix3::from_diagonal(&held.into());
        let told = (information + Matrix3::from_diagonal(&held.map(|v| 1.0 / v).into())).try_inverse();
        let place = LAW_M.map(|law| (mount.place_mm * 1e-3).powi(2) / cameras + law.powi(2));
        let mounting = [(mount.angle_deg.to_radians() * ANGLE_SCALE_M).powi(2) / cameras, place[0], place[1]];
        let at_center = told.unwrap_or(held_only) + Matrix3::from_diagonal(&mounting.into());
        // The place of the object's origin moves with the angle.
        let arm = (DVec2::new(pose.y_m, pose.z_m) - center).perp() / ANGLE_SCALE_M;
        let to_origin = Matrix3::new(1.0 / ANGLE_SCALE_M, 0.0, 0.0, arm.x, 1.0, 0.0, arm.y, 0.0, 1.0);
        Self { covariance: (to_origin * at_center * to_origin.transpose()).into(), center }
    }

    /// Uncertainty of a pose from the mask alone. `points_yz` in the grasp frame, meters.
    pub(super) fn of_mask(
        points_yz: &[DVec2],
        field: &DistanceField,
        pose: PlanarPose,
        mount: CameraTolerance,
    ) -> Self {
        let Observability { eigenvalues, motions, center, .. } = observability(points_yz, field, pose);
        let information = eigenvalues.iter().zip(motions).map(|(value, motion)| {
            let motion = Vector3::from(motion);
            motion * motion.transpose() * (value / (OUTLINE_M * OUTLINE_M))
        });
        Self::new(information.sum(), center, pose, (mount, 2.0))
    }

    /// The same pose if another estimate says that it lies elsewhere: their difference is a part of the spread, at most so many
    /// standard deviations of it.
    #[must_use]
    pub(super) fn with_other(self, pose: PlanarPose, other: PlanarPose, most: f64) -> Self {
        let turned = crate::units::wrap_angle(other.theta_rad - pose.theta_rad);
        let off = Vector3::new(turned, other.y_m - pose.y_m, other.z_m - pose.z_m);
        let covariance = Matrix3::from(self.covariance);
        let deviations = covariance.try_inverse().map_or(0.0, |inverse| (off.transpose() * inverse * off)[0].sqrt());
        let off = off * (most / deviations).min(1.0);
        let covariance = covariance + off * off.transpose();
        Self { covariance: covariance.into(), ..self }
    }

    /// The same of another pose that no touch tells apart from this one.
    #[must_use]
    pub(super) fn moved(self, from: PlanarPose, to: PlanarPose) -> Self {
        let arm = DVec2::new(to.y_m - from.y_m, to.z_m - from.z_m).perp();
        let moved = Matrix3::new(1.0, 0.0, 0.0, arm.x, 1.0, 0.0, arm.y, 0.0, 1.0);
        Self { covariance: (moved * Matrix3::from(self.covariance) * moved.transpose()).into(), ..self }
    }

    /// Standard deviation of the angle, radians.
    pub fn angle_rad(&self) -> f64 {
        self.covariance[0][0].sqrt()
    }

    /// Covariance of the place of the tool's point in the [`center`](Self::center), `(y, z)`, square meters, whatever the angle
    /// does meanwhile.
    fn place(&self, grasp_from_object: PlanarPose) -> Matrix2<f64> {
        let arm = (self.center - DVec2::new(grasp_from_object.y_m, grasp_from_object.z_m)).perp();
        let to_center = Matrix2x3::new(arm.x, 1.0, 0.0, arm.y, 0.0, 1.0);
        to_center * Matrix3::from(self.covariance) * to_center.transpose()
    }

    /// Half axes of the ellipse of one standard deviation of that place, `(y, z)`, meters, the longer one first.
    pub fn half_axes(&self, grasp_from_object: PlanarPose) -> [DVec2; 2] {
        let place = self.place(grasp_from_object);
        let (mean, half) = (0.5 * (place[(0, 0)] + place[(1, 1)]), 0.5 * (place[(0, 0)] - place[(1, 1)]));
        let spread = half.hypot(place[(0, 1)]);
        let direction = DVec2::from_angle(0.5 * place[(0, 1)].atan2(half));
        [direction * (mean + spread).max(0.0).sqrt(), direction.perp() * (mean - spread).max(0.0).sqrt()]
    }

    /// Standard deviation of that place along the axis where it is known least, meters.
    pub fn place_m(&self, grasp_from_object: PlanarPose) -> f64 {
        self.half_axes(grasp_from_object)[0].length()
    }
}

impl Prior {
    /// The pose, where the gripper can hold the tool so; else the one to which it slides along what the contact leaves open, as
    /// near to the middle as that leads, if the gripper can hold that. A rod may be anywhere along itself: of two places that fit
    /// alike, one is possible.
    pub(super) fn slid_in(&self, pose: PlanarPose, told: impl FnOnce() -> Uncertainty) -> PlanarPose {
        if self.allows(pose) {
            return pose;
        }
        let [open, _] = told().half_axes(pose);
        let along = open.normalize_or_zero();
        let origin = DVec2::new(pose.y_m, pose.z_m);
        let slid = origin - along * origin.dot(along);
        let slid = PlanarPose { y_m: slid.x, z_m: slid.y, ..pose };
        if open.length() > PLACE_OPEN_M && self.allows(slid) { slid } else { pose }
    }
}
