//! [`Task`]: a tool with what is done with it.

use serde::Serialize;

use super::{TrialsSetup, WHAT};
use crate::error::TaskError;
use touch2touch_core::catalog::{ToolSpec, cup_handle, pencil, tools};
use touch2touch_core::trials::{Attempt, Cup, HoleShape, InHand, Insertion, Outline, Stacking, TrialError};

/// Things that a robot can be tried with: the catalog's tools, a pencil, and a cup by its handle.
fn specs() -> Vec<ToolSpec> {
    tools().iter().cloned().chain([pencil(), cup_handle()]).collect()
}

/// Names of the things that a robot can be tried with.
pub fn known_tools() -> Vec<String> {
    specs().into_iter().map(|spec| spec.name).collect()
}

/// Names of the things that the paper tried: the unseen tools, a pencil, a cup.
pub fn default_tools() -> Vec<String> {
    specs().into_iter().filter(|spec| !spec.seen).map(|spec| spec.name).collect()
}

/// A tool with what is done with it.
#[derive(Clone, Debug)]
pub struct Task {
    /// The tool.
    pub spec: ToolSpec,
    /// Place among [`known_tools`].
    pub(super) number: usize,
    goal: Goal,
    /// The insertion with each clearance of the sweep.
    sweep: Vec<(f64, Insertion)>,
}

/// Goal of a task.
#[derive(Clone, Debug)]
enum Goal {
    Insertion(Box<Insertion>),
    Stacking(Stacking),
}

/// Kind of a task, in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TaskKind {
    /// A hole of the tool's own outline.
    Insertion,
    /// A cup on a cup.
    Stacking,
}

impl Task {
    /// The task of a tool by its name: a cup is stacked, everything else inserted.
    ///
    /// # Errors
    /// If the tool is not known, or a number of the settings makes no sense for it.
    pub fn new(name: &str, setup: &TrialsSetup) -> Result<Self, TaskError> {
        let mut all = specs();
        let number = all.iter().position(|spec| spec.name == name).ok_or_else(|| {
            let names = known_tools().join(", ");
            TaskError::new(WHAT, format!("no tool is named {name:?}")).with_hint(format!("There are: {names}."))
        })?;
        let spec = all.swap_remove(number);
        let fail = |err: TrialError| TaskError::from_error(format!("{WHAT} with {name}"), &err);
        if spec == cup_handle() {
            let stacking = Stacking::new(Cup::default(), setup.margin_m, setup.compliance).map_err(fail)?;
            return Ok(Self { spec, number, goal: Goal::Stacking(stacking), sweep: Vec::new() });
        }
        let outline = Outline::of_mesh(&spec.mesh()).map_err(fail)?;
        let with = |clearance_m: f64| {
            let hole = HoleShape { clearance_m, ..setup.hole };
            Insertion::new(outline.clone(), hole, setup.compliance).map_err(fail)
        };
        let sweep = setup.clearances_m.iter().map(|&clearance_m| Ok((clearance_m, with(clearance_m)?)));
        let sweep = sweep.collect::<Result<Vec<_>, TaskError>>()?;
        let insertion = Box::new(with(setup.hole.clearance_m)?);
        Ok(Self { spec, number, goal: Goal::Insertion(insertion), sweep })
    }

    /// Name of the tool.
    pub fn name(&self) -> &str {
        &self.spec.name
    }

    /// Kind of the task.
    pub fn kind(&self) -> TaskKind {
        match self.goal {
            Goal::Insertion(_) => TaskKind::Insertion,
            Goal::Stacking(_) => TaskKind::Stacking,
        }
    }

    /// The insertion, for its hole; `None` of a cup.
    pub fn insertion(&self) -> Option<&Insertion> {
        match &self.goal {
            Goal::Insertion(insertion) => Some(insertion),
            Goal::Stacking(_) => None,
        }
    }

    /// The stacking, for its cup; `None` of a tool that is inserted.
    pub fn stacking(&self) -> Option<&Stacking> {
        match &self.goal {
            Goal::Insertion(_) => None,
            Goal::Stacking(stacking) => Some(stacking),
        }
    }

    /// An attempt with a pose.
    ///
    /// # Errors
    /// If the pose is not finite.
    pub fn attempt(&self, grasp: InHand) -> Result<Attempt, TaskError> {
        let made = match &self.goal {
            Goal::Insertion(insertion) => insertion.attempt(grasp),
            Goal::Stacking(stacking) => stacking.attempt(grasp),
        };
        made.map_err(|err| TaskError::from_error(WHAT, &err))
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
