//! [`Stacking`]: a cup set on the rim of another.
//!
//! The upper cup comes down with the tilt and the offset that the pose's error leaves, meets the rim, is let go, and stands
//! if its center of mass lies over the part of the rim that its base covers, a margin inside. Pressing it down may level it
//! by as much as the gripper gives way; nothing shifts it. How it rocks after that, and whether it slides, is left out.

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::{ABOVE_M, Attempt, Compliance, Contact, End, InHand, Phase, TrialError, Waypoint, length};
use crate::catalog::{CUP_AXIS_M, CUP_BASE_M};
use crate::frames::PlanarPose;

/// A cup that stands on its base, and the rim that it is set on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cup {
    /// Radius of the upper cup's base, meters.
    pub base_m: f64,
    /// Radius of the lower cup's rim, meters.
    pub rim_m: f64,
    /// Height, meters.
    pub height_m: f64,
    /// Height of the center of mass over the base, meters.
    pub mass_m: f64,
    /// Middle of the base as (y, z), meters, object frame; the axis is parallel to z.
    pub base_at: DVec2,
}

impl Default for Cup {
    /// The cup whose handle is [`crate::catalog::cup_handle`].
    fn default() -> Self {
        Self { base_m: 0.04, rim_m: 0.036, height_m: 0.09, mass_m: 0.042, base_at: DVec2::new(CUP_AXIS_M, CUP_BASE_M) }
    }
}

/// A cup, the least margin, and a gripper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stacking {
    cup: Cup,
    margin_m: f64,
    compliance: Compliance,
}

/// Part of the rim that a base covers whose middle is `offset_m` beside the rim's: from where to where along y; `None` where
/// it covers nothing.
fn covered(cup: &Cup, offset_m: f64) -> Option<[f64; 2]> {
    let Cup { base_m, rim_m, .. } = *cup;
    // A point of the rim at y is within the base where 2 y offset >= rim² + offset² - base².
    let over = rim_m * rim_m + offset_m * offset_m - base_m * base_m;
    let [low, high] = match offset_m {
        e if e > 0.0 => [over / (2.0 * e), rim_m],
        e if e < 0.0 => [-rim_m, over / (2.0 * e)],
        _ if over <= 0.0 => [-rim_m, rim_m],
        _ => return None,
    };
    let [low, high] = [low.max(-rim_m), high.min(rim_m)];
    (low <= high).then_some([low, high])
}

impl Stacking {
    /// The stacking of a cup.
    ///
    /// # Errors
    /// [`TrialError`] for lengths that are none, and a base that is smaller than the rim: it would fall in.
    pub fn new(cup: Cup, margin_m: f64, compliance: Compliance) -> Result<Self, TrialError> {
        for (what, value) in [
            ("the radius of the base", cup.base_m),
            ("the radius of the rim", cup.rim_m),
            ("the height of the cup", cup.height_m),
            ("the height of the center of mass", cup.mass_m),
            ("the margin", margin_m),
        ] {
            length(what, value)?;
        }
        if let Some(value) = cup.base_at.to_array().into_iter().find(|v| !v.is_finite()) {
            return Err(TrialError::Number { what: "the place of the base", value });
        }
        if cup.base_m < cup.rim_m {
            return Err(TrialError::Cup { base_m: cup.base_m, rim_m: cup.rim_m });
        }
        Ok(Self { cup, margin_m, compliance: compliance.checked()? })
    }

    /// The cup.
    pub fn cup(&self) -> &Cup {
        &self.cup
    }

    /// Least distance that the center of mass keeps from the edge of its support, meters.
    pub fn margin_m(&self) -> f64 {
        self.margin_m
    }

    /// Motions that the gripper lets contact forces make; of these a cup is only turned.
    pub fn compliance(&self) -> Compliance {
        self.compliance
    }

    /// Pose of the upright cup on the rim, `world_from_object`.
    pub fn goal(&self) -> PlanarPose {
        PlanarPose { theta_rad: 0.0, y_m: -self.cup.base_at.x, z_m: -self.cup.base_at.y }
    }

    /// Distance of the center of mass from the edge of its support, less the margin, meters, for a cup that is let go tilted
    /// with the middle of its base beside the rim's; negative where it falls.
    pub fn spare_m(&self, tilt_rad: f64, offset_m: f64) -> f64 {
        let mass = offset_m + self.cup.mass_m * tilt_rad.sin();
        match covered(&self.cup, offset_m) {
            Some([low, high]) => (mass - low).min(high - mass) - self.margin_m,
            None => -self.cup.rim_m - self.margin_m,
        }
    }

    /// The whole attempt.
    ///
    /// # Errors
    /// [`TrialError::Number`] for a pose that is not finite.
    pub fn attempt(&self, grasp: InHand) -> Result<Attempt, TrialError> {
        let grasp = grasp.checked()?;
        let met = grasp.world_from_object(self.goal());
        let world_from_grasp = self.goal().compose(grasp.estimate.inverse());
        let leveled = -met.theta_rad.clamp(-self.compliance.turn_rad, self.compliance.turn_rad);
        // Where it is about to be let go: turned about the grasp's origin, and lowered or lifted onto the rim.
        let turned = PlanarPose { theta_rad: world_from_grasp.theta_rad + leveled, ..world_from_grasp };
        let on_the_rim = |phase: Phase, world_from_grasp: PlanarPose, above_m: f64| {
            let pose = world_from_grasp.compose(grasp.truth);
            let lift = self.sunk_m(pose) + above_m;
            let lifted = |pose: PlanarPose| PlanarPose { z_m: pose.z_m - lift, ..pose };
            let (world_from_object, world_from_grasp) = (lifted(pose), lifted(world_from_grasp));
            Waypoint { phase, depth_m: -above_m, world_from_object, world_from_grasp }
        };
        let path = vec![
            on_the_rim(Phase::Approach, world_from_grasp, ABOVE_M),
            on_the_rim(Phase::Contact, world_from_grasp, 0.0),
            on_the_rim(Phase::End, turned, 0.0),
        ];
        let released = path[2].world_from_object;
        let offset = |pose: PlanarPose| pose.transform_yz(self.cup.base_at).x;
        let spare_m = self.spare_m(released.theta_rad, offset(released));
        let contact = covered(&self.cup, offset(met)).map(|ends| {
            let y = if met.theta_rad >= 0.0 { ends[1] } else { ends[0] };
            // How far the base would go below the rim at its lowest, were there no rim.
            let interference_m = self.cup.rim_m * met.theta_rad.abs().tan();
            let x = (self.cup.rim_m.powi(2) - y * y).max(0.0).sqrt();
            Contact { point_m: DVec3::new(x, y, 0.0), depth_m: 0.0, interference_m }
        });
        Ok(Attempt {
            end: if spare_m >= 0.0 { End::Stands { spare_m } } else { End::Falls { spare_m } },
            tilt_rad: met.theta_rad,
            offset_m: offset(met),
            contact,
            path,
        })
    }

    /// Depth of the base below the rim where the two would meet, meters: of its plane at the rim's lowest covered side.
    fn sunk_m(&self, world_from_object: PlanarPose) -> f64 {
        let base = world_from_object.transform_yz(self.cup.base_at);
        let [low, high] = covered(&self.cup, base.x).unwrap_or([base.x; 2]);
        let slope = world_from_object.theta_rad.tan();
        base.y + ((high - base.x) * slope).max((low - base.x) * slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn stacking(margin_m: f64) -> Stacking {
        Stacking::new(Cup::default(), margin_m, Compliance::default()).unwrap()
    }

    #[test]
    fn the_limits_are_those_of_the_closed_form() {
        let (cup, margin) = (Cup::default(), 0.005);
        let trial = stacking(margin);
        // Upright over the middle: the rim's radius less the margin is to spare.
        assert!((trial.spare_m(0.0, 0.0) - (cup.rim_m - margin)).abs() < 1e-12);
        // The tipping angle: its sine is that over the height of the center of mass.
        let tipping = ((cup.rim_m - margin) / cup.mass_m).asin();
        for sign in [-1.0, 1.0] {
            assert!(trial.spare_m(sign * (tipping - 1e-6), 0.0) > 0.0);
            assert!(trial.spare_m(sign * (tipping + 1e-6), 0.0) < 0.0);
        }
        // An offset towards +y: while the base covers the whole rim only the center of mass counts.
        let whole = cup.base_m - cup.rim_m;
        assert!((trial.spare_m(0.0, whole) - (cup.rim_m - whole - margin)).abs() < 1e-12);
        // Beyond, the chord between the two circles is the edge: the radical axis.
        let e = 0.012;
        let chord = (cup.rim_m.powi(2) + e * e - cup.base_m.powi(2)) / (2.0 * e);
        assert!((trial.spare_m(0.0, e) - ((e - chord).min(cup.rim_m - e) - margin)).abs() < 1e-12);
        assert!(trial.spare_m(0.0, 0.2) < 0.0, "beside the lower cup");
    }

    proptest! {
        #[test]
        fn mirrored_cups_stand_alike_and_a_larger_margin_never_helps(
            tilt in -1.0f64..1.0, offset in -0.05f64..0.05, margin in 0.0f64..0.02, more in 0.0f64..0.02,
        ) {
            let spare = stacking(margin).spare_m(tilt, offset);
            prop_assert!((spare - stacking(margin).spare_m(-tilt, -offset)).abs() < 1e-12);
            prop_assert!(stacking(margin + more).spare_m(tilt, offset) <= spare);
        }

        #[test]
        fn a_perfect_pose_stands_and_thirty_degrees_fall(
            theta in -0.4f64..0.4, y in -0.005f64..0.005, z in -0.005f64..0.005, sign in prop::bool::ANY,
        ) {
            let trial = stacking(0.01);
            let truth = PlanarPose { theta_rad: theta, y_m: y, z_m: z };
            let perfect = trial.attempt(InHand { truth, estimate: truth }).unwrap();
            prop_assert!(perfect.end.is_success() && perfect.offset_m.abs() < 1e-12, "{perfect:?}");
            let wrong = 30f64.to_radians() * if sign { 1.0 } else { -1.0 };
            let estimate = PlanarPose { theta_rad: theta - wrong, ..truth };
            let fallen = trial.attempt(InHand { truth, estimate }).unwrap();
            prop_assert!(!fallen.end.is_success() && (fallen.tilt_rad - wrong).abs() < 1e-12, "{fallen:?}");
            // It lies on the rim where it is let go.
            let released = fallen.path.last().unwrap();
            prop_assert!(trial.sunk_m(released.world_from_object).abs() < 1e-12);
        }
    }

    #[test]
    fn the_gripper_levels_what_it_can_and_nonsense_is_refused() {
        let give = Compliance { turn_rad: 5f64.to_radians(), shift_m: 0.0 };
        let soft = Stacking::new(Cup::default(), 0.005, give).unwrap();
        let estimate = PlanarPose::default();
        let truth = PlanarPose { theta_rad: 4f64.to_radians(), ..estimate };
        let leveled = soft.attempt(InHand { truth, estimate }).unwrap();
        assert!(leveled.path[2].world_from_object.theta_rad.abs() < 1e-12 && leveled.tilt_rad > 0.06);
        let nan = PlanarPose { y_m: f64::NAN, ..estimate };
        assert!(soft.attempt(InHand { truth: nan, estimate }).is_err());
        let small = Cup { base_m: 0.03, ..Cup::default() };
        assert!(Stacking::new(small, 0.005, give).unwrap_err().to_string().contains("does not cover"));
        let negative = Compliance { turn_rad: -1.0, shift_m: 0.0 };
        assert!(Stacking::new(Cup::default(), 0.005, negative).is_err());
        assert!(Stacking::new(Cup::default(), f64::NAN, give).is_err());
    }
}
