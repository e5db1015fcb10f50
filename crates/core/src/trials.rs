//! Trials of a robot with a pose: a peg put into a hole, a cup set on a cup, and whether the verdict helps.
//!
//! The robot knows the *estimated* pose in the hand and turns and moves the gripper so that a tool held like that would
//! stand upright over its goal. The tool is held by its *true* pose; the difference of the two is what decides.
//!
//! **World frame**: x along the closing axis, y across the hole, z *down*, away from the wrist; the origin is the middle of
//! the hole's mouth, or of the lower cup's rim. Its axes are those of the grasp frame of an upright gripper, so everything
//! turns in the y-z plane of the in-hand angle, by [`PlanarPose`].
//!
//! Nothing slips, bends or rubs: what the gripper gives way is a box, [`Compliance`], and a trial succeeds where some pose
//! in that box is free of overlap. That is the best that contact forces could do.

mod count;
mod hole;
mod insertion;
mod intervals;
mod outline;
mod paper;
mod policy;
mod stacking;

use glam::DVec3;
use serde::Serialize;

use crate::frames::PlanarPose;
use crate::units::{text_deg, text_mm};

pub use count::Share;
pub use hole::{Hole, HoleShape};
pub use insertion::Insertion;
pub use outline::Outline;
pub use paper::{Published, published};
pub use policy::{After, Loop, Tried, with_verdict};
pub use stacking::{Cup, Stacking};

/// Height that a trial begins above its goal, meters.
const ABOVE_M: f64 = 0.015;

/// Why a trial makes no sense.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrialError {
    /// A number that is not finite, or negative where that has no meaning.
    #[error("{what} is {value}, which is no length or angle that a trial can have")]
    Number {
        /// Name of the number.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A tool without an outline.
    #[error("the tool has no outline: {why}")]
    Outline {
        /// Fault of the tool.
        why: &'static str,
    },
    /// A hole deeper than the tool is long.
    #[error("the tool is {} long and cannot go {} deep", text_mm(*length_m), text_mm(*depth_m))]
    TooDeep {
        /// Extent of the tool along z, meters.
        length_m: f64,
        /// Depth that was asked for, meters.
        depth_m: f64,
    },
    /// A cup that would fall into the one below.
    #[error("a base of radius {} does not cover a rim of radius {}", text_mm(*base_m), text_mm(*rim_m))]
    Cup {
        /// Radius of the base, meters.
        base_m: f64,
        /// Radius of the rim, meters.
        rim_m: f64,
    },
}

/// The number, if it is finite and not negative.
fn length(what: &'static str, value: f64) -> Result<f64, TrialError> {
    if value.is_finite() && value >= 0.0 { Ok(value) } else { Err(TrialError::Number { what, value }) }
}

/// Box of motions that the gripper lets contact forces make: a turn about the grasp's origin and a shift along y.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Compliance {
    /// Largest turn to either side, radians.
    pub turn_rad: f64,
    /// Largest shift to either side, meters.
    pub shift_m: f64,
}

impl Compliance {
    /// The share of the box around its middle.
    fn scaled(self, share: f64) -> Self {
        Self { turn_rad: share * self.turn_rad, shift_m: share * self.shift_m }
    }

    fn checked(self) -> Result<Self, TrialError> {
        length("the turn of the compliance", self.turn_rad)?;
        length("the shift of the compliance", self.shift_m)?;
        Ok(self)
    }
}

impl std::fmt::Display for Compliance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} and {}", text_deg(self.turn_rad), text_mm(self.shift_m))
    }
}

/// A tool in the hand: how it is held, and how the robot believes it to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct InHand {
    /// The true pose, `grasp_from_object`.
    pub truth: PlanarPose,
    /// The pose that the robot goes by, `grasp_from_object`.
    pub estimate: PlanarPose,
}

impl InHand {
    /// Pose of the tool in the world where the robot brings it to `world_from_object` by its estimate.
    pub fn world_from_object(self, target: PlanarPose) -> PlanarPose {
        target.compose(self.estimate.inverse()).compose(self.truth)
    }

    fn checked(self) -> Result<Self, TrialError> {
        for pose in [self.truth, self.estimate] {
            let not_finite = [pose.theta_rad, pose.y_m, pose.z_m].into_iter().find(|v| !v.is_finite());
            if let Some(value) = not_finite {
                return Err(TrialError::Number { what: "a coordinate of the pose in the hand", value });
            }
        }
        Ok(self)
    }
}

/// Part of a trial that a pose belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// On the way down, free.
    Approach,
    /// The first touch.
    Contact,
    /// Held by the goal, turned and shifted as little as it takes.
    Inside,
    /// The end: through, jammed, standing or let go.
    End,
}

/// A pose on the way of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Waypoint {
    /// Part of the trial.
    pub phase: Phase,
    /// Depth of the tool's lowest point below the mouth or the rim, meters; negative above.
    pub depth_m: f64,
    /// Pose of the tool.
    pub world_from_object: PlanarPose,
    /// Pose of the gripper.
    pub world_from_grasp: PlanarPose,
}

/// The first touch of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Contact {
    /// Place, meters, world frame, in the middle plane of the tool.
    pub point_m: DVec3,
    /// Depth of the tool's lowest point then, meters.
    pub depth_m: f64,
    /// Overlap with the wall if the robot went on to the end without giving way, meters.
    pub interference_m: f64,
}

/// End of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum End {
    /// The tip came to the bottom of the hole.
    Through {
        /// Depth of the tip, meters.
        depth_m: f64,
    },
    /// No pose within the compliance is deeper.
    Jammed {
        /// Depth of the tip, meters.
        depth_m: f64,
    },
    /// The tip came to the bottom, but the tool is tilted by more than counts as put in.
    Askew {
        /// Depth of the tip, meters.
        depth_m: f64,
    },
    /// The cup stands.
    Stands {
        /// Distance of its center of mass from the edge of its support, less the margin, meters.
        spare_m: f64,
    },
    /// The cup falls.
    Falls {
        /// As for a standing one, and negative.
        spare_m: f64,
    },
}

impl End {
    /// True for what the robot was to do.
    pub fn is_success(self) -> bool {
        matches!(self, Self::Through { .. } | Self::Stands { .. })
    }
}

impl std::fmt::Display for End {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::Through { depth_m } => write!(f, "through, {} deep", text_mm(depth_m)),
            Self::Jammed { depth_m } => write!(f, "jams {} deep", text_mm(depth_m)),
            Self::Askew { depth_m } => write!(f, "askew, {} deep", text_mm(depth_m)),
            Self::Stands { spare_m } => write!(f, "stands, {} to spare", text_mm(spare_m)),
            Self::Falls { spare_m } => write!(f, "falls, {} beyond the margin", text_mm(-spare_m)),
        }
    }
}

/// One attempt of the robot, with what a player needs to show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Attempt {
    /// The end.
    pub end: End,
    /// Tilt of the tool where the robot means it to be upright, radians: true angle minus estimate.
    pub tilt_rad: f64,
    /// Distance of the tip (of a cup: the middle of its base) from its goal along y, before anything gives way, meters.
    pub offset_m: f64,
    /// The first touch; `None` where the tool slides in freely.
    pub contact: Option<Contact>,
    /// Poses from above the goal to the end, in order; between two of them a straight motion is meant.
    pub path: Vec<Waypoint>,
}
