//! [`of_pair`]: the trial of a robot with the pose of one pair.

use serde::Serialize;

use super::{TrialsSetup, WHAT};
use crate::error::TaskError;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::trials::{Attempt, HoleShape, InHand, Insertion, Outline, TrialError};

/// The insertion of a pair's tool by a pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PairTrial {
    /// The attempt, in the hole of the usual trials.
    #[serde(flatten)]
    pub attempt: Attempt,
    /// Room to each side of that hole, meters.
    pub room_m: f64,
    /// Least room of the usual sweep with which the tool comes to the bottom, meters; `None` with none of them.
    pub needs_m: Option<f64>,
    /// The tool with its hole.
    #[serde(skip)]
    pub insertion: Insertion,
}

/// Lets a tool down by the pose that was estimated (`grasp_from_object`) while it is held by the true one: the hole, the gripper
/// and the sweep over its room are those of [`TrialsSetup::default`].
///
/// # Errors
/// If the model has no outline that such a hole could be cut for, or a pose is not finite.
pub fn of_pair(tool: &ToolModel, truth: PlanarPose, estimate: PlanarPose) -> Result<PairTrial, TaskError> {
    let fail = |err: TrialError| TaskError::from_error(WHAT, &err);
    let TrialsSetup { hole, clearances_m, compliance, .. } = TrialsSetup::default();
    let (outline, grasp) = (Outline::of_mesh(&tool.mesh).map_err(fail)?, InHand { truth, estimate });
    let with = |clearance_m: f64| Insertion::new(outline.clone(), HoleShape { clearance_m, ..hole }, compliance);
    let insertion = with(hole.clearance_m).map_err(fail)?;
    let attempt = insertion.attempt(grasp).map_err(fail)?;
    let mut needs_m = None;
    for clearance_m in clearances_m {
        if with(clearance_m).and_then(|wide| wide.passes(grasp)).map_err(fail)? {
            needs_m = Some(clearance_m);
            break;
        }
    }
    Ok(PairTrial { attempt, room_m: hole.clearance_m, needs_m, insertion })
}
