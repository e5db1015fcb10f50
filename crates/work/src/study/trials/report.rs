//! The trials of a tool in counts, with every single one.

use serde::Serialize;

use super::task::Task;
use super::{GoalKind, TrialsSetup};
use crate::error::TaskError;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::metrics::AngleSummary;
use touch2touch_core::sim::Sensors;
use touch2touch_core::trials::{After, Attempt, Cup, InHand, Loop, Share, Tried, with_verdict};
use touch2touch_core::units::text_mm;
use touch2touch_core::verdict::Grade;

/// A grasp, the pose that a method found, and the attempt by it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Held {
    /// Seed of the grasp and of its noise.
    pub seed: u64,
    /// The true pose, `grasp_from_object`.
    pub truth: PlanarPose,
    /// The pose that the robot goes by, `grasp_from_object`; `None` where none was found.
    pub estimate: Option<PlanarPose>,
    /// Size of the angle's error, radians.
    pub angle_error_rad: Option<f64>,
    /// The verdict's grade for a robot that lets the tool down: a place left open along the tool is no fault. `None` without a
    /// pose, or where none is estimated.
    pub grade: Option<Grade>,
    /// That verdict in a sentence, or why there is no pose.
    pub why: String,
    /// The attempt; `None` without a pose.
    pub attempt: Option<Attempt>,
}

impl Held {
    /// The grasp as the counts see it.
    pub fn tried(&self) -> Tried {
        Tried { grade: self.grade, success: self.attempt.as_ref().is_some_and(|attempt| attempt.end.is_success()) }
    }

    /// The tool as it is held and as it is believed to be; `None` without a pose.
    pub fn in_hand(&self) -> Option<InHand> {
        Some(InHand { truth: self.truth, estimate: self.estimate? })
    }
}

/// A trial by one method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// Number of the trial, from 0 on.
    pub number: usize,
    /// The first grasp.
    pub first: Held,
    /// The second, where the verdict on the first was not good.
    pub second: Option<Held>,
}

/// Success with one clearance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Swept {
    /// Room to each side, meters.
    pub clearance_m: f64,
    /// Successes at the first grasp.
    pub success: Share,
}

/// The trials of a tool by one method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodTrials {
    /// Name of the method.
    pub method: String,
    /// Successes where the first grasp is tried, whatever the verdict, as in the paper.
    pub success: Share,
    /// The same with other clearances; empty for a cup.
    pub sweep: Vec<Swept>,
    /// Counts with the verdict in the loop, by what follows a second doubt; empty where no pose is estimated.
    pub with_verdict: Vec<Loop>,
    /// Angle errors of the first grasps.
    pub angle: AngleSummary,
    /// Every trial.
    pub trials: Vec<Trial>,
}

/// The trials of a tool.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ToolTrials {
    /// Name of the tool.
    pub tool: String,
    /// Task that it was tried with.
    pub task: GoalKind,
    /// One per method, in the order of the settings.
    pub methods: Vec<MethodTrials>,
}

/// The counts of a tool's trials, each given by all methods.
pub(super) fn tool_trials(task: &Task, setup: &TrialsSetup, made: Vec<Vec<Trial>>) -> Result<ToolTrials, TaskError> {
    let mut by_method: Vec<Vec<Trial>> = setup.methods.iter().map(|_| Vec::new()).collect();
    for trial in made {
        by_method.iter_mut().zip(trial).for_each(|(of, one)| of.push(one));
    }
    let one = |(method, trials): (&super::Method, Vec<Trial>)| {
        let firsts: Vec<Option<InHand>> = trials.iter().map(|trial| trial.first.in_hand()).collect();
        let share = |(clearance_m, passes): (f64, Vec<bool>)| Swept { clearance_m, success: Share::count(passes) };
        let pairs = || trials.iter().map(|trial| (trial.first.tried(), trial.second.as_ref().map(Held::tried)));
        let looped = |after| with_verdict(pairs(), after);
        let errors: Vec<f64> = trials.iter().map(|trial| trial.first.angle_error_rad.unwrap_or(f64::NAN)).collect();
        Ok(MethodTrials {
            method: method.name.clone(),
            success: Share::count(trials.iter().map(|trial| trial.first.tried().success)),
            sweep: task.swept(&firsts)?.into_iter().map(share).collect(),
            with_verdict: method.recipe.iter().flat_map(|_| [After::Try, After::GiveUp].map(looped)).collect(),
            angle: AngleSummary::from_errors(&errors),
            trials,
        })
    };
    let methods = setup.methods.iter().zip(by_method).map(one).collect::<Result<Vec<_>, TaskError>>()?;
    Ok(ToolTrials { tool: task.name().to_owned(), task: task.goal.kind(), methods })
}

/// Assumptions of the trials, in words.
pub(super) fn notes(setup: &TrialsSetup) -> Vec<String> {
    let (hole, cup) = (setup.hole, Cup::default());
    let mut notes = vec![
        format!(
            "insertion: the tool's own outline as the hole, {} deep, {} of room to each side, chamfer {}; the gripper gives \
             way by {}",
            text_mm(hole.depth_m),
            text_mm(hole.clearance_m),
            text_mm(hole.chamfer_m),
            setup.compliance
        ),
        format!(
            "stacking: a base of {} on a rim of {} (radii), center of mass {} high, at least {} inside its support",
            text_mm(cup.base_m),
            text_mm(cup.rim_m),
            text_mm(cup.mass_m),
            text_mm(setup.margin_m)
        ),
        "in the plane of the in-hand angle, rigid, without friction: what the gripper gives way is taken to be found"
            .into(),
    ];
    notes.push(match setup.sensors {
        Sensors::Nominal => "the simulator's nominal sensors".into(),
        Sensors::Drawn(seed) => format!("another pair of sensors, drawn by seed {seed} as training draws them"),
        Sensors::OtherGelslims(seed) => {
            format!("GelSlims in other colors and with other dots, drawn by seed {seed} beyond what training draws")
        }
    });
    notes.push("intervals: 95 %, Wilson's score".into());
    notes.push("the paper's counts are of a real robot, whose hole and clearance are not known here".into());
    notes
}
