//! [`of_pair`]: the trial of a robot with the pose of one pair.

use serde::Serialize;

use super::{Goal, TrialsSetup, WHAT};
use crate::error::TaskError;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::trials::{Attempt, InHand, Insertion, TrialError};

/// The trial of a pair's tool by a pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairTrial {
    /// The attempt, at the goal of the usual trials.
    #[serde(flatten)]
    pub attempt: Attempt,
    /// Room about the tool in its hole; `None` for a cup.
    #[serde(flatten)]
    pub room: Option<Room>,
    /// The hole, or the cup.
    #[serde(skip)]
    pub goal: Goal,
}

/// Room to each side of a tool in its hole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Room {
    /// Room of the usual hole, meters.
    pub room_m: f64,
    /// Least room of the usual sweep with which the tool comes to the bottom, meters; `None` with none of them.
    pub needs_m: Option<f64>,
}

/// Lets a tool down by the pose that was estimated (`grasp_from_object`) while it is held by the true one: the goal, the gripper
/// and the sweep over the hole's room are those of [`TrialsSetup::default`].
///
/// # Errors
/// If the model has no outline that such a hole could be cut for, or a pose is not finite.
pub fn of_pair(tool: &ToolModel, truth: PlanarPose, estimate: PlanarPose) -> Result<PairTrial, TaskError> {
    let fail = |err: TrialError| TaskError::from_error(WHAT, &err);
    let (setup, grasp) = (TrialsSetup::default(), InHand { truth, estimate });
    let goal = Goal::of(&tool.mesh, &setup).map_err(fail)?;
    let attempt = goal.attempt(grasp).map_err(fail)?;
    let room = |insertion: &Insertion| {
        let needs_m = least_room(insertion, &setup.clearances_m, grasp)?;
        Ok(Room { room_m: setup.hole.clearance_m, needs_m })
    };
    let room = goal.insertion().map(room).transpose().map_err(fail)?;
    Ok(PairTrial { attempt, room, goal })
}

/// The first of some clearances, meters, with which the tool comes to the bottom.
fn least_room(insertion: &Insertion, clearances_m: &[f64], grasp: InHand) -> Result<Option<f64>, TrialError> {
    for &clearance_m in clearances_m {
        if insertion.with_clearance(clearance_m)?.passes(grasp)? {
            return Ok(Some(clearance_m));
        }
    }
    Ok(None)
}
