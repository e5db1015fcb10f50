//! Insertion: a tool let down into a hole of its own outline.
//!
//! The robot lowers the gripper until the tool's lowest point is as deep as the hole, so an error of the pose along z does
//! not matter. It succeeds where some turn and shift of the gripper is free of the plates at that depth: everything that is
//! below the mouth then passed the plates above it straight, so the same turn and shift is free on the whole way. What reaches
//! the bottom tilted by more than 10° is not put in, but askew: one prong of a fork, or a corner.
//!
//! Shifts are solved exactly, as intervals. Turns are searched by branch and bound: no point within a distance r of the grasp's
//! origin moves by more than r times a turn, so what overlaps a hole that is wider by that cannot be turned free.

use glam::DVec2;
use touch2touch_core::frames::PlanarPose;

use super::hole::{DEPTH_M, Segment, Slack};
use super::{GIVE_RAD, Hole, InHand, Outline};

/// Overlap that counts as touching, meters.
const TOUCH_M: f64 = 1e-9;
/// Turns that move no point by more than this are not told apart, meters.
const FINEST_M: f64 = 1e-7;
/// Turns that are looked at for one answer, at most.
const MOST: usize = 4000;
/// Largest tilt of a tool that counts as put in: the paper's limit of a usable angle, radians.
const UPRIGHT_RAD: f64 = 10.0 / 180.0 * std::f64::consts::PI;
/// Shift, to either side, by which the gripper gives way, meters.
const GIVE_M: f64 = 0.001;

/// The tool as it is held over the hole.
struct Held {
    /// Outline in the grasp frame, by the true pose.
    body: Vec<Segment>,
    /// Pose of the gripper as the robot commands it, but for its height.
    world_from_grasp: PlanarPose,
    /// Largest distance of a point from the grasp's origin, meters.
    reach_m: f64,
}

impl Held {
    /// The outline after a turn, as (y, height over its lowest point) with depth downwards: the lowest point at the bottom.
    fn at(&self, turn_rad: f64) -> Vec<Segment> {
        let turn = PlanarPose { theta_rad: self.world_from_grasp.theta_rad + turn_rad, ..PlanarPose::default() };
        let turned: Vec<Segment> = self.body.iter().map(|s| s.map(|p| turn.transform_yz(p))).collect();
        let lowest = turned.iter().flatten().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
        let to = DVec2::new(self.world_from_grasp.y_m, DEPTH_M - lowest);
        turned.into_iter().map(|s| s.map(|p| p + to)).collect()
    }

    /// Only what can come below the mouth within a turn: the rest cannot touch a plate.
    fn near(self, turn_rad: f64) -> Self {
        let above = -2.0 * self.reach_m * turn_rad - TOUCH_M;
        let is_near = |s: &Segment| s.iter().any(|p| p.y >= above);
        let kept = self.body.iter().zip(self.at(0.0)).filter(|(_, at)| is_near(at)).map(|(s, _)| *s);
        Self { body: kept.collect(), ..self }
    }
}

/// True where the tool comes to the bottom of the hole upright.
pub(super) fn passes(outline: &Outline, hole: &Hole, grasp: InHand) -> bool {
    passes_with(outline, hole, grasp, [GIVE_RAD, GIVE_M])
}

/// [`passes`] with another turn and shift of the gripper, radians and meters.
fn passes_with(
    outline: &Outline,
    hole: &Hole,
    InHand { truth, estimate }: InHand,
    [turn_rad, shift_m]: [f64; 2],
) -> bool {
    let body: Vec<Segment> = outline.segments().iter().map(|s| s.map(|p| truth.transform_yz(p))).collect();
    let reach_m = body.iter().flatten().map(|p| p.length()).fold(0.0, f64::max);
    let world_from_grasp = hole.goal().compose(estimate.inverse());
    let tilt = world_from_grasp.theta_rad + truth.theta_rad;
    let (least, most) = ((-turn_rad).max(-UPRIGHT_RAD - tilt), turn_rad.min(UPRIGHT_RAD - tilt));
    if least > most {
        return false;
    }
    let held = Held { body, world_from_grasp, reach_m }.near(least.abs().max(most.abs()));
    let at = |turn_rad: f64, slack: Slack| hole.shifts(&held.at(turn_rad), shift_m + slack.across_m, slack);
    let is_free = |turn_rad: f64| !at(turn_rad, Slack { across_m: TOUCH_M, down_m: TOUCH_M }).is_empty();
    let smallest = 0.0_f64.clamp(least, most);
    if is_free(smallest) {
        return true;
    }
    let mut open = vec![[least, smallest], [smallest, most]];
    for _ in 0..MOST {
        let Some([low, high]) = open.pop() else { return false };
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        if is_free(middle) {
            return true;
        }
        let moved = held.reach_m * half;
        let slack = Slack { across_m: moved + TOUCH_M, down_m: 2.0 * moved + TOUCH_M };
        if moved > FINEST_M && !at(middle, slack).is_empty() {
            let mut halves = [[low, middle], [middle, high]];
            // The half that is nearer to no turn at all is looked at first.
            halves.sort_by(|a, b| (b[0] + b[1]).abs().total_cmp(&(a[0] + a[1]).abs()));
            open.extend(halves);
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trials::tools::pencil;
    use proptest::prelude::*;
    use touch2touch_core::catalog::tools;

    fn bar(width: f64, length: f64) -> Outline {
        let h = 0.5 * width;
        let corners = [(-h, -0.03), (h, -0.03), (h, length - 0.03), (-h, length - 0.03)];
        Outline::polygon(&corners.map(|(y, z)| DVec2::new(y, z))).unwrap()
    }

    /// A tool that is tilted and shifted, believed to be straight.
    fn off(theta_rad: f64, y_m: f64) -> InHand {
        InHand { truth: PlanarPose { theta_rad, y_m, z_m: 0.0 }, estimate: PlanarPose::default() }
    }

    fn tried(outline: &Outline, room_m: f64, grasp: InHand, give: [f64; 2]) -> bool {
        passes_with(outline, &Hole::new(outline, room_m).unwrap(), grasp, give)
    }

    /// The width that a bar of `width`, tilted by `t` with its lower corner at the bottom, takes up below the mouth.
    fn taken(width: f64, t: f64) -> f64 {
        if DEPTH_M >= width * t.sin() {
            width * t.cos() + DEPTH_M * t.tan()
        } else {
            DEPTH_M * (t.tan() + 1.0 / t.tan())
        }
    }

    proptest! {
        #[test]
        fn a_bar_passes_its_slot_just_where_the_closed_form_says(
            width in 0.002f64..0.02, t in 0.001f64..0.17, sign in prop::bool::ANY,
        ) {
            let outline = bar(width, 0.08);
            let needs = 0.5 * (taken(width, t) - width);
            let tilt = if sign { t } else { -t };
            // Shifted freely, so that only the width counts.
            for (room, passes) in [(needs + 2e-6, true), (needs - 2e-6, false)] {
                if room >= 0.0 {
                    prop_assert_eq!(tried(&outline, room, off(tilt, 0.0), [0.0, 0.5]), passes, "{} {}", needs, room);
                }
            }
            // A turn of the gripper takes as much off the tilt.
            let give = 0.3 * t;
            let needs = 0.5 * (taken(width, t - give) - width);
            if needs > 1e-5 && DEPTH_M > 1.1 * width * t.sin() && width * (t - give).sin() < DEPTH_M * (t - give).cos() {
                prop_assert!(tried(&outline, needs + 5e-6, off(tilt, 0.0), [give, 0.5]));
            }
        }

        #[test]
        fn a_shift_passes_up_to_room_and_give(
            width in 0.002f64..0.02, room in 0.0f64..0.005, give in 0.0f64..0.003, sign in prop::bool::ANY,
        ) {
            let outline = bar(width, 0.08);
            let at = |y: f64| tried(&outline, room, off(0.0, if sign { y } else { -y }), [0.0, give]);
            prop_assert!(at(room + give - 1e-6));
            prop_assert!(!at(room + give + 1e-6));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

        #[test]
        fn more_room_and_more_give_never_hinder(
            number in 0usize..13, theta in -0.15f64..0.15, y in -0.003f64..0.003,
            room in 0.0f64..0.003, more in 0.0f64..0.003, turn in 0.0f64..0.07, shift in 0.0f64..0.002,
        ) {
            let spec = tools().get(number).cloned().unwrap_or_else(pencil);
            let (tool, grasp) = (Outline::of_mesh(&spec.mesh()).unwrap(), off(theta, y));
            if tried(&tool, room, grasp, [turn, shift]) {
                prop_assert!(tried(&tool, room + more, grasp, [turn, shift]));
                prop_assert!(tried(&tool, room, grasp, [turn + 0.02, shift]));
                prop_assert!(tried(&tool, room, grasp, [turn, shift + more]));
            }
        }
    }

    #[test]
    fn a_triangle_that_goes_in_corner_first_is_askew() {
        let corners = [[-12.0, 6.0], [1.0, -12.0], [9.0, 10.0]].map(|[y, z]| DVec2::new(y, z) * 1e-3);
        let triangle = Outline::polygon(&corners).unwrap();
        assert!(!tried(&triangle, 0.001, off(30f64.to_radians(), 0.0), [GIVE_RAD, GIVE_M]));
    }
}
