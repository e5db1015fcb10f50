//! Trials of a robot with the poses of a recipe: simulated grasps from fixed seeds, felt up to the pose, and tried in a
//! hole of the tool's own outline, or on another cup: [`trials`]. The verb `trials` calls it.
//!
//! Every method is given the same grasps: the measured imprints as the upper bound, each generator, and no correction at
//! all as the floor. A second grasp is made of a trial where a method's verdict on the first is not *good*. The sweep over
//! clearances tries the same poses again; nothing is felt anew for it.

mod goal;
mod pair;
mod report;
mod task;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;
use serde::{Serialize, Serializer};

use crate::error::TaskError;
use crate::feel::{Touch, feel};
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::{ImprintSource, PairLabels};
use crate::models::Models;
use crate::recipe::{Recipe, Stage};
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::sample::Sample;
use touch2touch_core::sim::{Sensors, SimConfig, random_grasp, simulate};
use touch2touch_core::trials::{Compliance, HoleShape, InHand, Published, published};
use touch2touch_core::units::angle_error;
use touch2touch_core::verdict::Verdict;

pub use goal::{Goal, GoalKind};
pub use pair::{PairTrial, Room, of_pair};
pub use report::{Held, MethodTrials, Swept, ToolTrials, Trial};
use task::Task;
pub use task::{default_tools, known_tools};

/// Name of the task in errors.
const WHAT: &str = "Trials";
/// Seeds of the grasps: apart from those of the demo, of the test sets and of the training.
const TRIAL_SEED: u64 = 0x7e1a_1000_0000_0000;

/// Source of the pose that the robot goes by.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Method {
    /// The row's name.
    pub name: String,
    /// The recipe of its poses; `None` where the robot takes every tool for straight and in the middle.
    #[serde(serialize_with = "what_decides")]
    pub recipe: Option<Recipe>,
}

fn what_decides<S: Serializer>(recipe: &Option<Recipe>, to: S) -> Result<S::Ok, S::Error> {
    recipe.as_ref().map(|recipe| recipe.until(Stage::Pose)).serialize(to)
}

impl Method {
    /// The method of a recipe. Nobody can have drawn on a grasp that is simulated here, so masks by hand are left out.
    pub fn of(recipe: &Recipe) -> Self {
        let name = match (&recipe.generator, recipe.imprint) {
            (Some((bundle, _)), ImprintSource::Predicted) => bundle.name.clone(),
            _ => "Measured (upper bound)".to_owned(),
        };
        Self { name, recipe: Some(Recipe { hand: false, ..recipe.clone() }) }
    }

    /// The floor: the tool is taken for straight.
    pub fn uncorrected() -> Self {
        Self { name: "No correction (floor)".to_owned(), recipe: None }
    }
}

/// Settings of the trials.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrialsSetup {
    /// Names of the tools, of [`known_tools`].
    pub tools: Vec<String>,
    /// Trials of each tool.
    pub count: usize,
    /// Seed of the grasps.
    pub seed: u64,
    /// The sensors that feel them.
    pub sensors: Sensors,
    /// The methods, a row each.
    pub methods: Vec<Method>,
    /// The hole of the insertions.
    pub hole: HoleShape,
    /// Clearances that the same poses are tried with besides, meters.
    pub clearances_m: Vec<f64>,
    /// Give of the gripper.
    pub compliance: Compliance,
    /// Distance that a stacked cup's center of mass has to keep from the edge of its support, meters.
    pub margin_m: f64,
}

impl Default for TrialsSetup {
    fn default() -> Self {
        Self {
            tools: default_tools(),
            count: 30,
            seed: 1,
            sensors: Sensors::Nominal,
            methods: Vec::new(),
            hole: HoleShape { depth_m: 0.01, clearance_m: 0.001, chamfer_m: 0.0 },
            clearances_m: (1..=10).map(|half_mm| 0.0005 * f64::from(half_mm)).collect(),
            compliance: Compliance { turn_rad: 2f64.to_radians(), shift_m: 0.001 },
            margin_m: 0.01,
        }
    }
}

/// The trials of all tools by all methods.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trials {
    /// Settings of the trials.
    pub setup: TrialsSetup,
    /// One per tool, in the order of the settings.
    pub tools: Vec<ToolTrials>,
    /// The paper's counts, on a real robot.
    pub published: [Published; 5],
    /// Assumptions, in words.
    pub notes: Vec<String>,
    /// True where every trial asked for was made; false if stopped early.
    pub complete: bool,
    /// Time it took, seconds.
    pub seconds: f64,
}

/// Makes the trials of `setup`, on all cores. Predictions are taken from `models`, where they are kept too. Stops early when
/// told to, with the trials that were done.
///
/// # Errors
/// If a tool is not known, a number makes no sense, there is no method, a model cannot be used, or it was told to stop before
/// the first trial was done. A grasp without a pose is a result.
pub fn trials(setup: &TrialsSetup, models: &Models, cx: &JobCx) -> Result<Trials, TaskError> {
    let start = Instant::now();
    if setup.methods.is_empty() || setup.tools.is_empty() || setup.count == 0 {
        return Err(TaskError::new(WHAT, "there is nothing to do: no method, no tool or no trial"));
    }
    let tasks = setup.tools.iter().map(|name| Task::new(name, setup)).collect::<Result<Vec<_>, _>>()?;
    let (done, total) = (AtomicUsize::new(0), tasks.len() * setup.count);
    // The way from a touch to a pose asks no data set for anything; a touch names one all the same.
    let dataset = Dataset::demo();
    let config = setup.sensors.config();
    let mut tools = Vec::new();
    for task in &tasks {
        let model = ToolModel::new(task.spec.mesh()).map_err(|err| TaskError::from_error(WHAT, &err))?;
        let run = Run { setup, task, config: &config, model: &model, dataset: &dataset, models, cx };
        cx.progress(done.load(Ordering::Relaxed) as u64, total as u64, task.name());
        let one = |number: usize| -> Result<Vec<Trial>, TaskError> {
            let trial = run.trial(number)?;
            let so_far = done.fetch_add(1, Ordering::Relaxed) + 1;
            cx.progress(so_far as u64, total as u64, format!("{}, trial {}", task.name(), number + 1));
            Ok(trial)
        };
        // A trial that is stopped midway is none.
        let made = (0..setup.count).into_par_iter().map(|number| match cx.cancel.is_cancelled() {
            true => Ok(None),
            false => one(number).map(Some).or_else(|err| if cx.cancel.is_cancelled() { Ok(None) } else { Err(err) }),
        });
        let made = made.collect::<Result<Vec<_>, TaskError>>()?;
        let made: Vec<_> = made.into_iter().flatten().collect();
        if cx.cancel.is_cancelled() && made.is_empty() {
            break;
        }
        tools.push(report::tool_trials(task, setup, made)?);
    }
    if tools.is_empty() {
        cx.check(WHAT)?;
    }
    let made: usize = tools.iter().flat_map(|tool| tool.methods.first()).map(|method| method.trials.len()).sum();
    Ok(Trials {
        setup: setup.clone(),
        tools,
        published: published(),
        notes: report::notes(setup),
        complete: made == total,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Context that all trials of a tool have in common.
struct Run<'a> {
    setup: &'a TrialsSetup,
    task: &'a Task,
    config: &'a SimConfig,
    model: &'a ToolModel,
    dataset: &'a Dataset,
    models: &'a Models,
    cx: &'a JobCx,
}

impl Run<'_> {
    /// A trial by every method, in their order.
    fn trial(&self, number: usize) -> Result<Vec<Trial>, TaskError> {
        let methods = &self.setup.methods;
        let first = self.grasped(number, 0);
        let firsts = methods.iter().map(|method| self.held(method, &first)).collect::<Result<Vec<_>, _>>()?;
        let doubted = |method: &Method, held: &Held| method.recipe.is_some() && !held.tried().is_good();
        let again = methods.iter().zip(&firsts).any(|(method, held)| doubted(method, held));
        let second = again.then(|| self.grasped(number, 1));
        let both = methods.iter().zip(firsts).map(|(method, first)| {
            let second = second.as_ref().filter(|_| doubted(method, &first));
            let second = second.map(|grasped| self.held(method, grasped)).transpose()?;
            Ok(Trial { number, first, second })
        });
        both.collect()
    }

    /// The first or second grasp of a trial, felt.
    fn grasped(&self, number: usize, again: u64) -> Grasped {
        let seed = self.seed(number, again);
        let grasp = random_grasp(seed);
        let sample = simulate(self.task.spec, grasp, seed, self.config);
        Grasped { seed, sample, truth: grasp.object_from_grasp().inverse() }
    }

    /// Seed of a grasp: by the tool's place among all, so that it does not depend on which others are asked for.
    fn seed(&self, number: usize, again: u64) -> u64 {
        let of_run = TRIAL_SEED.wrapping_add(self.setup.seed.wrapping_mul(1_000_003));
        of_run ^ ((self.task.number as u64) << 32) ^ (2 * number as u64 + again)
    }

    /// The pose of a grasp by a method, tried.
    fn held(&self, method: &Method, grasped: &Grasped) -> Result<Held, TaskError> {
        let Grasped { seed, sample, truth } = grasped;
        let (seed, truth) = (*seed, *truth);
        let tried = |estimate: PlanarPose| self.task.attempt(InHand { truth, estimate });
        let Some(recipe) = &method.recipe else {
            let straight = PlanarPose::default();
            return Ok(Held {
                seed,
                truth,
                estimate: Some(straight),
                angle_error_rad: Some(angle_error(straight.theta_rad, truth.theta_rad)),
                grade: None,
                why: "the tool is taken for straight".to_owned(),
                attempt: Some(tried(straight)?),
            });
        };
        let labels = PairLabels::default();
        let touch = Touch { dataset: self.dataset, pair: PairId(0), sample, tool: Ok(self.model), labels: &labels };
        let felt = feel(touch, recipe, Stage::Pose, self.models, &self.cx.quiet())?;
        Ok(match felt.pose() {
            Ok(found) => {
                let verdict = Verdict::let_down(&found.report);
                Held {
                    seed,
                    truth,
                    estimate: Some(found.grasp_from_object),
                    angle_error_rad: found.error_rad,
                    grade: verdict.as_ref().map(|verdict| verdict.grade),
                    why: verdict.map(|verdict| verdict.why).unwrap_or_default(),
                    attempt: Some(tried(found.grasp_from_object)?),
                }
            }
            Err(err) => Held {
                seed,
                truth,
                estimate: None,
                angle_error_rad: None,
                grade: None,
                why: err.why.clone(),
                attempt: None,
            },
        })
    }
}

/// A simulated grasp with its truth.
struct Grasped {
    seed: u64,
    sample: Sample,
    truth: PlanarPose,
}

#[cfg(test)]
mod tests;
