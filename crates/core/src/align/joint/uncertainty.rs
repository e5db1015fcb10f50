//! [`Uncertainty`]: spread of the errors that a pose may have.

use glam::DVec2;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::cost::{Joint, Relief, noise_m};
use super::problem::{LAST, Problem};
use crate::align::batch::State;
use crate::align::observability::{Observability, observability};
use crate::align::search::Cost as _;
use crate::align::{ANGLE_SCALE_M, Prior};
use crate::field::DistanceField;
use crate::frames::PlanarPose;

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

/// Deviation of a camera's true angle about the closing axis from the nominal one, radians, and of its place per axis, meters:
/// a good mount's. Each finger has its own.
const MOUNTING: [f64; 2] = [0.25 / 180.0 * std::f64::consts::PI, 0.2e-3];
/// Deviation of the place, y and z, that no finger can see alone: where the template is not the membrane's own law, or the
/// camera, which looks obliquely along z, does not see behind the tool. From fresh grasps under two laws.
const LAW_M: [f64; 2] = [0.2e-3, 0.28e-3];
/// Places of the membranes, and the kernel, meters, as in the answer.
const PLACES: usize = 800;
const KERNEL_M: f64 = 0.5e-3;
/// The variance of a place's height is four times this times the noise that is left, meters: neighbors err together, and a
/// part of what is left is the template's error, which hardly moves the pose. From fresh grasps under two laws.
const SHARED_M: f64 = 4e-5;
/// The same of predicted images, whose errors go together over the width of a bar. From fresh grasps that the shipped
/// generator predicted.
const PREDICTED_SHARED_M: f64 = 42e-5;
/// Deviation of a mask's whole outline, meters: its errors go together. From fresh grasps with masks that fit.
const OUTLINE_M: f64 = 0.07e-3;

impl Uncertainty {
    /// From the information (inverse covariance) about (angle times [`ANGLE_SCALE_M`], y, z) of the tool turned about
    /// `center`, grasp frame, of so many cameras.
    fn new(information: Matrix3<f64>, center: DVec2, pose: PlanarPose, cameras: f64) -> Self {
        let Prior { theta_rad, shift_m } = Prior::default();
        // Of an even distribution.
        let held = [theta_rad * ANGLE_SCALE_M, shift_m, shift_m].map(|half| half * half / 3.0);
        let held_only = Matrix3::from_diagonal(&held.into());
        let told = (information + Matrix3::from_diagonal(&held.map(|v| 1.0 / v).into())).try_inverse();
        let place = LAW_M.map(|law| MOUNTING[1].powi(2) / cameras + law.powi(2));
        let mounting = [(MOUNTING[0] * ANGLE_SCALE_M).powi(2) / cameras, place[0], place[1]];
        let at_center = told.unwrap_or(held_only) + Matrix3::from_diagonal(&mounting.into());
        // The place of the object's origin moves with the angle.
        let arm = (DVec2::new(pose.y_m, pose.z_m) - center).perp() / ANGLE_SCALE_M;
        let to_origin = Matrix3::new(1.0 / ANGLE_SCALE_M, 0.0, 0.0, arm.x, 1.0, 0.0, arm.y, 0.0, 1.0);
        Self { covariance: (to_origin * at_center * to_origin.transpose()).into(), center }
    }

    /// Uncertainty of a pose from the mask alone. `points_yz` in the grasp frame, meters.
    pub(in crate::align) fn of_mask(points_yz: &[DVec2], field: &DistanceField, pose: PlanarPose) -> Self {
        let Observability { eigenvalues, motions, center, .. } = observability(points_yz, field, pose);
        let information = eigenvalues.iter().zip(motions).map(|(value, motion)| {
            let motion = Vector3::from(motion);
            motion * motion.transpose() * (value / (OUTLINE_M * OUTLINE_M))
        });
        Self::new(information.sum(), center, pose, 2.0)
    }

    /// The same pose if another estimate says that it lies elsewhere: their difference is a part of the spread.
    #[must_use]
    pub(super) fn with_other(self, pose: PlanarPose, other: PlanarPose) -> Self {
        let turned = crate::units::wrap_angle(other.theta_rad - pose.theta_rad);
        let off = Vector3::new(turned, other.y_m - pose.y_m, other.z_m - pose.z_m);
        let covariance = Matrix3::from(self.covariance) + off * off.transpose();
        Self { covariance: covariance.into(), ..self }
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

    /// Standard deviation of that place along a unit direction `(y, z)`, meters.
    pub fn along_m(&self, grasp_from_object: PlanarPose, direction: DVec2) -> f64 {
        let direction = Vector2::new(direction.x, direction.y);
        (self.place(grasp_from_object) * direction).dot(&direction).sqrt()
    }

    /// Standard deviation of that place along the axis where it is known least, meters.
    pub fn place_m(&self, grasp_from_object: PlanarPose) -> f64 {
        self.half_axes(grasp_from_object)[0].length()
    }
}

/// Curvature by motions of the tool in the hand, of that by steps of the points in the object frame, which go the other way.
fn in_the_hand([a, b, c, d, e, f]: &[f64; 6], pose: PlanarPose) -> Matrix3<f64> {
    let turn = -DVec2::from_angle(pose.theta_rad);
    let to_hand = Matrix3::new(-1.0, 0.0, 0.0, 0.0, turn.x, -turn.y, 0.0, turn.y, turn.x);
    to_hand * Matrix3::new(*a, *b, *c, *b, *d, *e, *c, *e, *f) * to_hand.transpose()
}

impl Problem<'_> {
    /// Curvature of the membranes' part of the cost that decides the answer, about (angle times [`ANGLE_SCALE_M`], y, z) of the
    /// tool turned about the centroid.
    pub(super) fn answer_curvature(&self, pose: PlanarPose) -> Matrix3<f64> {
        let patches = self.patches(LAST);
        let mut joint = Joint { fingers: &patches, kernel_m: self.config().kernels_m[LAST], mask: None, lookups: 0 };
        in_the_hand(&joint.sums(State::from_pose(pose, self.centroid())).h, pose)
    }

    /// Uncertainty of a pose from the membranes.
    pub(super) fn uncertainty(&self, pose: PlanarPose) -> Uncertainty {
        let at = State::from_pose(pose, self.centroid());
        let patches = self.patches_of(self.answer_band(), PLACES);
        let noise_m = noise_m(Relief::of(&patches, at, KERNEL_M).residuals_m).max(1e-6);
        let mut joint = Joint { fingers: &patches, kernel_m: KERNEL_M, mask: None, lookups: 0 };
        let shared_m = if self.is_predicted() { PREDICTED_SHARED_M } else { SHARED_M };
        let scale = KERNEL_M.powi(2) * joint.points() as f64 / (4.0 * shared_m * noise_m);
        let information = in_the_hand(&joint.sums(at).h, pose) * scale;
        Uncertainty::new(information, self.centroid(), pose, patches.len().max(1) as f64)
    }
}
