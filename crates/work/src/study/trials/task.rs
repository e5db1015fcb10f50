//! [`Task`]: a tool with its goal.

use super::{Goal, TrialsSetup, WHAT};
use crate::error::TaskError;
use touch2touch_core::catalog::{ToolSpec, all_tools};
use touch2touch_core::trials::{Attempt, InHand, Insertion, TrialError};

/// Names of the things that a robot can be tried with.
pub fn known_tools() -> Vec<String> {
    all_tools().iter().map(|spec| spec.name.clone()).collect()
}

/// Names of the things that the paper tried: the unseen tools, a pencil, a cup.
pub fn default_tools() -> Vec<String> {
    all_tools().iter().filter(|spec| !spec.seen).map(|spec| spec.name.clone()).collect()
}

/// A tool with what is done with it.
#[derive(Clone, Debug)]
pub(super) struct Task {
    /// The tool.
    pub(super) spec: &'static ToolSpec,
    /// Place among [`known_tools`].
    pub(super) number: usize,
    pub(super) goal: Goal,
    /// The insertion with each clearance of the sweep.
    sweep: Vec<(f64, Insertion)>,
}

impl Task {
    /// The task of a tool by its name.
    ///
    /// # Errors
    /// If the tool is not known, or a number of the settings makes no sense for it.
    pub(super) fn new(name: &str, setup: &TrialsSetup) -> Result<Self, TaskError> {
        let all = all_tools();
        let number = all.iter().position(|spec| spec.name == name).ok_or_else(|| {
            let names = known_tools().join(", ");
            TaskError::new(WHAT, format!("no tool is named {name:?}")).with_hint(format!("There are: {names}."))
        })?;
        let spec = &all[number];
        let fail = |err: TrialError| TaskError::from_error(format!("{WHAT} with {name}"), &err);
        let goal = Goal::of(&spec.mesh(), setup).map_err(fail)?;
        let wide = |insertion: &Insertion| {
            let with = |&clearance_m: &f64| Ok((clearance_m, insertion.with_clearance(clearance_m)?));
            setup.clearances_m.iter().map(with).collect::<Result<Vec<_>, _>>()
        };
        let sweep = goal.insertion().map(wide).transpose().map_err(fail)?.unwrap_or_default();
        Ok(Self { spec, number, goal, sweep })
    }

    /// Name of the tool.
    pub(super) fn name(&self) -> &str {
        &self.spec.name
    }

    /// An attempt with a pose.
    ///
    /// # Errors
    /// If the pose is not finite.
    pub(super) fn attempt(&self, grasp: InHand) -> Result<Attempt, TaskError> {
        self.goal.attempt(grasp).map_err(|err| TaskError::from_error(WHAT, &err))
    }

    /// Success of poses with each clearance of the sweep; a grasp without a pose succeeds with none.
    ///
    /// # Errors
    /// If a pose is not finite.
    pub(super) fn swept(&self, grasps: &[Option<InHand>]) -> Result<Vec<(f64, Vec<bool>)>, TaskError> {
        let passes = |insertion: &Insertion, grasp: &Option<InHand>| {
            grasp.map_or(Ok(false), |grasp| insertion.passes(grasp)).map_err(|err| TaskError::from_error(WHAT, &err))
        };
        let one = |(clearance_m, insertion): &(f64, Insertion)| {
            let each = grasps.iter().map(|grasp| passes(insertion, grasp));
            Ok((*clearance_m, each.collect::<Result<Vec<_>, TaskError>>()?))
        };
        self.sweep.iter().map(one).collect()
    }
}
