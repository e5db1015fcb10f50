//! [`Insertion`]: a tool let down into a hole of its own outline.
//!
//! The robot lowers the gripper until the tool's lowest point is as deep as the hole, so an error of the pose along z does
//! not matter. It succeeds where some turn and shift within the compliance is free of the plates at that depth: everything
//! that is below the mouth then passed the plates above it straight, so the same turn and shift is free on the whole way.
//!
//! What reaches the bottom tilted by more than 10° is not put in, but askew: one prong of a fork, or a corner.
//!
//! Shifts are solved exactly, as intervals. Turns are searched by branch and bound: no point within a distance r of the grasp's
//! origin moves by more than r times a turn, so what overlaps a hole that is wider by that cannot be turned free.

use glam::{DVec2, DVec3};

use super::hole::{Segment, Slack};
use super::{
    ABOVE_M, Attempt, Compliance, Contact, End, Hole, HoleShape, InHand, Outline, Phase, TrialError, Waypoint,
};
use crate::frames::PlanarPose;

/// Overlap that counts as touching, meters.
const TOUCH_M: f64 = 1e-9;
/// Turns that move no point by more than this are not told apart, meters.
const FINEST_M: f64 = 1e-7;
/// Turns that are looked at for one answer, at most.
const MOST: usize = 4000;
/// Largest tilt of a tool that counts as put in: the paper's limit of a usable angle, radians.
const UPRIGHT_RAD: f64 = 10.0 / 180.0 * std::f64::consts::PI;
/// Halvings of a depth, and of a share of the compliance.
const DEPTH_HALVINGS: usize = 16;
const SHARE_HALVINGS: usize = 8;
/// Poses of the path from the first touch to the end.
const STEPS: usize = 12;

/// A tool, its hole, and a gripper.
#[derive(Clone, Debug, PartialEq)]
pub struct Insertion {
    outline: Outline,
    hole: Hole,
    compliance: Compliance,
}

/// The tool as it is held over the hole.
struct Held {
    /// Outline in the grasp frame, by the true pose.
    body: Vec<Segment>,
    /// Pose of the gripper as the robot commands it, but for its height.
    world_from_grasp: PlanarPose,
    grasp_from_object: PlanarPose,
    /// Largest distance of a point from the grasp's origin, meters.
    reach_m: f64,
}

/// A turn and a shift.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Motion {
    turn_rad: f64,
    shift_m: f64,
}

impl Held {
    /// The outline after a turn, as (y, height over its lowest point) with depth downwards: the lowest point at `depth_m`.
    fn at(&self, turn_rad: f64, depth_m: f64) -> Vec<Segment> {
        let turned = self.turned(turn_rad);
        let lowest = turned.iter().flatten().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
        let to = DVec2::new(self.world_from_grasp.y_m, depth_m - lowest);
        turned.into_iter().map(|s| s.map(|p| p + to)).collect()
    }

    fn turned(&self, turn_rad: f64) -> Vec<Segment> {
        let turn = PlanarPose { theta_rad: self.world_from_grasp.theta_rad + turn_rad, ..PlanarPose::default() };
        self.body.iter().map(|s| s.map(|p| turn.transform_yz(p))).collect()
    }

    /// Only what can come below the mouth within a turn at a depth: the rest cannot touch a plate.
    fn near(&self, turn_rad: f64, depth_m: f64) -> Self {
        let above = -2.0 * self.reach_m * turn_rad - TOUCH_M;
        let is_near = |s: &Segment| s.iter().any(|p| p.y >= above);
        let kept = self.body.iter().zip(self.at(0.0, depth_m)).filter(|(_, at)| is_near(at)).map(|(s, _)| *s);
        Self { body: kept.collect(), ..*self }
    }

    fn waypoint(&self, phase: Phase, motion: Motion, depth_m: f64) -> Waypoint {
        let lowest = self.turned(motion.turn_rad).iter().flatten().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
        let world_from_grasp = PlanarPose {
            theta_rad: self.world_from_grasp.theta_rad + motion.turn_rad,
            y_m: self.world_from_grasp.y_m + motion.shift_m,
            z_m: depth_m - lowest,
        };
        let world_from_object = world_from_grasp.compose(self.grasp_from_object);
        Waypoint { phase, depth_m, world_from_object, world_from_grasp }
    }
}

impl Insertion {
    /// The insertion of a tool of this outline.
    ///
    /// # Errors
    /// As [`Hole::new`], and for a compliance that is none.
    pub fn new(outline: Outline, shape: HoleShape, compliance: Compliance) -> Result<Self, TrialError> {
        let hole = Hole::new(&outline, shape)?;
        Ok(Self { outline, hole, compliance: compliance.checked()? })
    }

    /// The same with another room to each side, meters.
    ///
    /// # Errors
    /// As [`Hole::new`].
    pub fn with_clearance(&self, clearance_m: f64) -> Result<Self, TrialError> {
        let shape = HoleShape { clearance_m, ..self.hole.shape() };
        Self::new(self.outline.clone(), shape, self.compliance)
    }

    /// The hole.
    pub fn hole(&self) -> &Hole {
        &self.hole
    }

    /// Motions that the gripper lets contact forces make.
    pub fn compliance(&self) -> Compliance {
        self.compliance
    }

    /// Pose of the upright tool at the bottom of the hole, `world_from_object`.
    pub fn goal(&self) -> PlanarPose {
        let at = self.hole.goal();
        PlanarPose { theta_rad: 0.0, y_m: at.x, z_m: at.y }
    }

    /// True where the tool comes to the bottom of the hole.
    ///
    /// # Errors
    /// [`TrialError::Number`] for a pose that is not finite.
    pub fn passes(&self, grasp: InHand) -> Result<bool, TrialError> {
        Ok(self.upright(&self.held(grasp.checked()?)).is_some())
    }

    /// The whole attempt.
    ///
    /// # Errors
    /// [`TrialError::Number`] for a pose that is not finite.
    pub fn attempt(&self, grasp: InHand) -> Result<Attempt, TrialError> {
        let held = self.held(grasp.checked()?);
        let (bottom_m, still) = (self.hole.shape().depth_m, Compliance::default());
        let goal = grasp.world_from_object(self.goal());
        let upright = self.upright(&held);
        let free_m = self.deepest(&held, still, 0.0);
        let end_m = if upright.is_some() { bottom_m } else { self.deepest(&held, self.compliance, free_m) };
        let contact = (free_m < bottom_m).then(|| self.contact(&held, free_m));
        let rigid = Motion::default();
        let mut path = vec![held.waypoint(Phase::Approach, rigid, -ABOVE_M)];
        if contact.is_some() {
            path.push(held.waypoint(Phase::Contact, rigid, free_m));
            path.extend(self.way(&held, [free_m, end_m]));
        }
        // As little as it takes, unless that is askew.
        let is_upright = |at: &Waypoint| upright.is_none() || at.world_from_object.theta_rad.abs() <= UPRIGHT_RAD;
        let last = path.last().filter(|last| last.phase == Phase::Inside && is_upright(last)).copied();
        let at_end = |motion: Motion| held.waypoint(Phase::End, motion, end_m);
        path.push(last.map_or_else(|| at_end(upright.unwrap_or_default()), |at| Waypoint { phase: Phase::End, ..at }));
        Ok(Attempt {
            end: match upright {
                Some(_) => End::Through { depth_m: end_m },
                None if end_m < bottom_m => End::Jammed { depth_m: end_m },
                None => End::Askew { depth_m: end_m },
            },
            tilt_rad: goal.theta_rad,
            offset_m: goal.transform_yz(self.hole.tip()).x,
            contact,
            path,
        })
    }

    fn held(&self, InHand { truth, estimate }: InHand) -> Held {
        let body: Vec<Segment> = self.outline.segments().iter().map(|s| s.map(|p| truth.transform_yz(p))).collect();
        let reach_m = body.iter().flatten().map(|p| p.length()).fold(0.0, f64::max);
        let world_from_grasp = self.goal().compose(estimate.inverse());
        Held { body, world_from_grasp, grasp_from_object: truth, reach_m }
    }

    /// A motion within the compliance that brings the tool to the bottom upright.
    fn upright(&self, held: &Held) -> Option<Motion> {
        let tilt = held.world_from_grasp.theta_rad + held.grasp_from_object.theta_rad;
        let Compliance { turn_rad, shift_m } = self.compliance;
        let turns = [(-turn_rad).max(-UPRIGHT_RAD - tilt), turn_rad.min(UPRIGHT_RAD - tilt)];
        self.search(held, turns, shift_m, self.hole.shape().depth_m)
    }

    /// A motion within a compliance at which the tool is free with its lowest point at a depth: one that is small.
    fn free(&self, held: &Held, Compliance { turn_rad, shift_m }: Compliance, depth_m: f64) -> Option<Motion> {
        self.search(held, [-turn_rad, turn_rad], shift_m, depth_m)
    }

    fn search(&self, held: &Held, [least, most]: [f64; 2], shift_m: f64, depth_m: f64) -> Option<Motion> {
        if least > most {
            return None;
        }
        let held = held.near(least.abs().max(most.abs()), depth_m);
        let at = |turn_rad: f64, slack: Slack| {
            self.hole.shifts(&held.at(turn_rad, depth_m), shift_m + slack.across_m, slack)
        };
        let found = |turn_rad: f64| {
            let shift_m = at(turn_rad, Slack { across_m: TOUCH_M, down_m: TOUCH_M }).nearest_to_zero()?;
            Some(Motion { turn_rad, shift_m })
        };
        let smallest = 0.0_f64.clamp(least, most);
        if let Some(motion) = found(smallest) {
            return Some(motion);
        }
        let mut open = vec![[least, smallest], [smallest, most]];
        for _ in 0..MOST {
            let [low, high] = open.pop()?;
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            if let Some(motion) = found(middle) {
                return Some(motion);
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
        None
    }

    /// The greatest depth, from `known_m` on, at which the tool is free within a compliance.
    fn deepest(&self, held: &Held, compliance: Compliance, known_m: f64) -> f64 {
        let bottom_m = self.hole.shape().depth_m;
        if self.free(held, compliance, bottom_m).is_some() {
            return bottom_m;
        }
        let (mut free, mut stuck) = (known_m, bottom_m);
        for _ in 0..DEPTH_HALVINGS {
            let middle = 0.5 * (free + stuck);
            if self.free(held, compliance, middle).is_some() { free = middle } else { stuck = middle }
        }
        free
    }

    /// Poses from the first touch to the end, each moved as little as it takes.
    fn way(&self, held: &Held, [from_m, to_m]: [f64; 2]) -> Vec<Waypoint> {
        let mut least = 0.0;
        let depths = (1..=STEPS).map(|k| from_m + (to_m - from_m) * k as f64 / STEPS as f64);
        let one = |depth_m: f64| {
            let (mut low, mut high) = (least, 1.0);
            let mut best = self.free(held, self.compliance, depth_m)?;
            for _ in 0..SHARE_HALVINGS {
                let middle = 0.5 * (low + high);
                match self.free(held, self.compliance.scaled(middle), depth_m) {
                    Some(motion) => (best, high) = (motion, middle),
                    None => low = middle,
                }
            }
            least = low;
            Some(held.waypoint(Phase::Inside, best, depth_m))
        };
        depths.filter_map(one).collect()
    }

    /// The first touch of the rigid tool, just below the depth to which it is free.
    fn contact(&self, held: &Held, free_m: f64) -> Contact {
        let bottom_m = self.hole.shape().depth_m;
        let below = (free_m + 2.0 * bottom_m / f64::from(1 << DEPTH_HALVINGS)).min(bottom_m);
        let touch = self.hole.overlap(&held.at(0.0, below)).or_else(|| self.hole.overlap(&held.at(0.0, bottom_m)));
        let at = touch.map_or(DVec2::ZERO, |(at, _)| at);
        let interference_m = self.hole.overlap(&held.at(0.0, bottom_m)).map_or(0.0, |(_, amount)| amount);
        Contact { point_m: DVec3::new(0.0, at.x, at.y), depth_m: free_m, interference_m }
    }
}

#[cfg(test)]
mod tests;
