//! [`Uncertainty`] of a pose from the membranes.

use glam::DVec2;
use nalgebra::Matrix3;

use super::cost::{Joint, Relief, noise_m};
use super::problem::{Patches, Problem};
use super::smooth::DECIDING;
use crate::align::Uncertainty;
use crate::align::batch::State;
use crate::align::search::Cost as _;
use crate::frames::PlanarPose;

/// Places of the membranes, and the kernel, meters, as in the answer.
const PLACES: usize = 800;
const KERNEL_M: f64 = 0.5e-3;
/// The variance of a place's height is four times this times the noise that is left, meters: neighbors err together, and a
/// part of what is left is the template's error, which hardly moves the pose. From fresh grasps under two laws.
const SHARED_M: f64 = 8e-5;
/// The same of predicted images, whose errors go together over the width of a bar. From fresh grasps that the shipped
/// generator predicted.
const PREDICTED_SHARED_M: f64 = 42e-5;

/// Curvature by motions of the tool in the hand, of that by steps of the points in the object frame, which go the other way.
fn in_the_hand([a, b, c, d, e, f]: &[f64; 6], pose: PlanarPose) -> Matrix3<f64> {
    let turn = -DVec2::from_angle(pose.theta_rad);
    let to_hand = Matrix3::new(-1.0, 0.0, 0.0, 0.0, turn.x, -turn.y, 0.0, turn.y, turn.x);
    to_hand * Matrix3::new(*a, *b, *c, *b, *d, *e, *c, *e, *f) * to_hand.transpose()
}

impl Problem<'_> {
    /// Uncertainty of a pose from the membranes.
    pub(super) fn uncertainty(&self, pose: PlanarPose) -> Uncertainty {
        let at = State::from_pose(pose, self.centroid());
        let patches = self.patches_at(DECIDING, PLACES, at);
        let mut joint = Joint { fingers: &patches, kernel_m: KERNEL_M, mask: None, lookups: 0 };
        let information = in_the_hand(&joint.sums(at).h, pose) * self.telling(&patches, at);
        Uncertainty::new(information, self.centroid(), pose, (self.tolerance, patches.len().max(1) as f64))
    }

    /// Information of what the mean cost of patches rises by: twice the logarithm of how much less likely a pose is.
    pub(super) fn telling(&self, patches: &Patches, at: State) -> f64 {
        let noise_m = noise_m(Relief::of(patches, at, KERNEL_M).residuals_m).max(1e-6);
        let shared_m = if self.predicted { PREDICTED_SHARED_M } else { SHARED_M };
        let points: usize = patches.iter().map(|(_, patch)| patch.len()).sum();
        KERNEL_M.powi(2) * points as f64 / (4.0 * shared_m * noise_m)
    }
}
