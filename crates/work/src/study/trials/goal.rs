//! [`Goal`]: what a robot does with a tool.

use serde::Serialize;

use super::TrialsSetup;
use touch2touch_core::catalog::is_cup_handle;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::trials::{Attempt, Cup, InHand, Insertion, Outline, Stacking, TrialError};

/// Goal of a trial.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// A hole of the tool's own outline.
    Insertion(Box<Insertion>),
    /// A cup on a cup.
    Stacking(Stacking),
}

/// Kind of a goal, in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GoalKind {
    /// A hole of the tool's own outline.
    Insertion,
    /// A cup on a cup.
    Stacking,
}

impl Goal {
    /// The goal of a tool: the cup is stacked by its handle, everything else inserted.
    ///
    /// # Errors
    /// If a number of the settings makes no sense, or no such hole can be cut for the tool.
    pub fn of(mesh: &TriMesh, setup: &TrialsSetup) -> Result<Self, TrialError> {
        if is_cup_handle(mesh) {
            return Ok(Self::Stacking(Stacking::new(Cup::default(), setup.margin_m, setup.compliance)?));
        }
        let insertion = Insertion::new(Outline::of_mesh(mesh)?, setup.hole, setup.compliance)?;
        Ok(Self::Insertion(Box::new(insertion)))
    }

    /// Kind of the goal.
    pub fn kind(&self) -> GoalKind {
        match self {
            Self::Insertion(_) => GoalKind::Insertion,
            Self::Stacking(_) => GoalKind::Stacking,
        }
    }

    /// The insertion; `None` of a cup.
    pub fn insertion(&self) -> Option<&Insertion> {
        match self {
            Self::Insertion(insertion) => Some(insertion),
            Self::Stacking(_) => None,
        }
    }

    /// An attempt with a pose.
    ///
    /// # Errors
    /// If the pose is not finite.
    pub fn attempt(&self, grasp: InHand) -> Result<Attempt, TrialError> {
        match self {
            Self::Insertion(insertion) => insertion.attempt(grasp),
            Self::Stacking(stacking) => stacking.attempt(grasp),
        }
    }
}
