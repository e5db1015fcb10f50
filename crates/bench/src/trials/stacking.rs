//! Stacking: a cup set on the rim of another.
//!
//! The upper cup comes down with the tilt and the offset that the pose's error leaves, meets the rim, is let go, and stands
//! if its center of mass lies over the part of the rim that its base covers, a margin inside. Pressing it down may level it
//! by as much as the gripper gives way; nothing shifts it. How it rocks after that, and whether it slides, is left out.

use glam::DVec2;
use touch2touch_core::frames::PlanarPose;

use super::tools::{CUP_AXIS_M, CUP_BASE_M};
use super::{GIVE_RAD, InHand};

/// Radius of the upper cup's base, meters.
const BASE_M: f64 = 0.04;
/// Radius of the lower cup's rim, meters.
const RIM_M: f64 = 0.036;
/// Height of the center of mass over the base, meters.
const MASS_M: f64 = 0.042;
/// Distance that the center of mass has to keep from the edge of its support, meters.
const MARGIN_M: f64 = 0.01;

/// Part of the rim that a base covers whose middle is `offset_m` beside the rim's: from where to where along y; `None` where
/// it covers nothing.
fn covered(offset_m: f64) -> Option<[f64; 2]> {
    // A point of the rim at y is within the base where 2 y offset >= rim² + offset² - base².
    let over = RIM_M * RIM_M + offset_m * offset_m - BASE_M * BASE_M;
    let [low, high] = match offset_m {
        e if e > 0.0 => [over / (2.0 * e), RIM_M],
        e if e < 0.0 => [-RIM_M, over / (2.0 * e)],
        _ => [-RIM_M, RIM_M],
    };
    let [low, high] = [low.max(-RIM_M), high.min(RIM_M)];
    (low <= high).then_some([low, high])
}

/// Distance of the center of mass from the edge of its support, less the margin, meters, for a cup that is let go tilted
/// with the middle of its base beside the rim's; negative where it falls.
fn spare_m(tilt_rad: f64, offset_m: f64) -> f64 {
    let mass = offset_m + MASS_M * tilt_rad.sin();
    match covered(offset_m) {
        Some([low, high]) => (mass - low).min(high - mass) - MARGIN_M,
        None => -RIM_M - MARGIN_M,
    }
}

/// True where the cup stands.
pub(super) fn stands(InHand { truth, estimate }: InHand) -> bool {
    let base = DVec2::new(CUP_AXIS_M, CUP_BASE_M);
    let goal = PlanarPose { theta_rad: 0.0, y_m: -base.x, z_m: -base.y };
    let world_from_grasp = goal.compose(estimate.inverse());
    let tilt = world_from_grasp.compose(truth).theta_rad;
    let leveled = -tilt.clamp(-GIVE_RAD, GIVE_RAD);
    // Where it is about to be let go: turned about the grasp's origin.
    let turned = PlanarPose { theta_rad: world_from_grasp.theta_rad + leveled, ..world_from_grasp };
    let released = turned.compose(truth);
    spare_m(released.theta_rad, released.transform_yz(base).x) >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cup_stands_just_where_its_center_of_mass_is_supported() {
        // Upright over the middle: the rim's radius less the margin is to spare.
        assert!((spare_m(0.0, 0.0) - (RIM_M - MARGIN_M)).abs() < 1e-12);
        // The tipping angle: its sine is that over the height of the center of mass.
        let tipping = ((RIM_M - MARGIN_M) / MASS_M).asin();
        for sign in [-1.0, 1.0] {
            assert!(spare_m(sign * (tipping - 1e-6), 0.0) > 0.0);
            assert!(spare_m(sign * (tipping + 1e-6), 0.0) < 0.0);
        }
        // An offset towards +y: while the base covers the whole rim only the center of mass counts.
        let whole = BASE_M - RIM_M;
        assert!((spare_m(0.0, whole) - (RIM_M - whole - MARGIN_M)).abs() < 1e-12);
        // Beyond, the chord between the two circles is the edge: the radical axis.
        let e = 0.012;
        let chord = (RIM_M.powi(2) + e * e - BASE_M.powi(2)) / (2.0 * e);
        assert!((spare_m(0.0, e) - ((e - chord).min(RIM_M - e) - MARGIN_M)).abs() < 1e-12);
        assert!((spare_m(0.3, e) - spare_m(-0.3, -e)).abs() < 1e-12, "mirrored cups stand alike");
        assert!(spare_m(0.0, 0.2) < 0.0, "beside the lower cup");
    }
}
