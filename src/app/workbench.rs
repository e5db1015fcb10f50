//! The room of the workbench: layers, poses by hand, points read.

pub use super::state::workbench::{Layer, ManualTry, Picked, SceneTool, Workbench};

use super::effect::Effect;
use super::inspect::InspectCommand;
use super::keys::{ImprintSource, RunKey};
use super::state::State;
use super::state::results::Request;
use super::{inspect, labels, results};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::{self, AcceptedPose, ManualCost, PoseAxis};
use touch2touch_pipeline::error::TaskError;

/// Width of the kernel that costs of poses by hand are counted with, meters: the narrowest of the registration.
const KERNEL_M: f64 = 1e-3;

/// A command to the workbench.
#[derive(Clone, Debug, PartialEq)]
pub enum WorkbenchCommand {
    /// The coloring of the contact points.
    SetLayer(Layer),
    /// True where all tools are tried on the selected pair.
    TryTools(bool),
    /// True where each 3D pane shows the clouds of both imprints.
    SetBothClouds(bool),
    /// The effect of a click.
    SetTool(SceneTool),
    /// The side that the pointer is over.
    SetSide(ImprintSource),
    /// Moves the tool along one axis, meters or radians.
    Nudge(PoseAxis, f64),
    /// Puts the tool somewhere.
    SetHandPose(PlanarPose),
    /// Puts the tool at the next answer of the registration.
    NextAnswer,
    /// Registers from where the tool is.
    StartIcp,
    /// Takes the pose over into the document.
    AcceptHand,
    /// Gives the pose up.
    RevertHand,
    /// Reads a point, or no longer.
    Pick(Option<Picked>),
}

/// True where the pose tool is in hand and there is a tool to be moved.
pub(crate) fn in_hand(state: &State) -> bool {
    state.workbench.tool == SceneTool::Pose && results::tool(state).ready().is_some()
}

pub(super) fn step(state: &mut State, command: WorkbenchCommand, effects: &mut Vec<Effect>) {
    let pair = state.pair_key();
    let bench = &mut state.workbench;
    match command {
        WorkbenchCommand::SetLayer(layer) => bench.layer = layer,
        WorkbenchCommand::TryTools(on) => bench.tools_tried = pair.filter(|_| on),
        WorkbenchCommand::SetBothClouds(on) => bench.both_clouds = on,
        WorkbenchCommand::SetTool(tool) => {
            // Where nothing is drawn in 3D any more, nobody can end what is.
            if state.document.stroke.as_ref().is_some_and(|stroke| stroke.drawing.sight.is_some()) {
                labels::end_stroke(state, effects);
            }
            let bench = &mut state.workbench;
            bench.tool = tool;
            if tool != SceneTool::Pose {
                bench.hand = None;
            }
        }
        WorkbenchCommand::SetSide(side) => bench.side = side,
        WorkbenchCommand::Nudge(axis, by) => {
            if bench.tool == SceneTool::Pose {
                put(state, |pose| axis.moved(pose, by));
            }
        }
        WorkbenchCommand::SetHandPose(pose) => {
            if bench.tool == SceneTool::Pose {
                put(state, |_| pose);
            }
        }
        WorkbenchCommand::NextAnswer => {
            if let Some(pose) = answer(state) {
                step(state, WorkbenchCommand::SetTool(SceneTool::Pose), effects);
                put(state, |_| pose);
            }
        }
        WorkbenchCommand::StartIcp => start_icp(state, effects),
        WorkbenchCommand::AcceptHand => accept(state, effects),
        WorkbenchCommand::RevertHand => bench.hand = None,
        WorkbenchCommand::Pick(picked) => bench.picked = picked,
    }
}

/// The next pose that the touch allows as well, in the order of the answers from where the tool is.
pub(crate) fn answer(state: &State) -> Option<PlanarPose> {
    let source = state.workbench.side;
    let answers = &results::pose(state, source).ready()?.report.answers;
    let held = state.workbench.hand(source).map(|hand| hand.pose).or_else(|| results::by_hand(state, source));
    let at = answers.iter().position(|answer| Some(answer.grasp_from_object) == held).unwrap_or(0);
    let next = answers.iter().cycle().nth(at + 1).filter(|_| answers.len() > 1);
    next.map(|answer| answer.grasp_from_object)
}

/// The cost of a pose with the contact points of an imprint; `None` while cloud or model are not there.
fn cost_of(state: &State, source: ImprintSource, pose: PlanarPose) -> Option<ManualCost> {
    let clouds = results::cloud(state, source).ready()?;
    let tool = &results::tool(state).ready()?.model;
    Some(manual::cost(&clouds.contact_points(), &tool.field, &tool.distance, pose, KERNEL_M))
}

/// The pose being set for the side in hand; begins one if there is none.
fn hold(state: &State) -> Option<ManualTry> {
    let (pair, source) = (state.pair_key()?, state.workbench.side);
    if let Some(hand) = state.workbench.hand(source).filter(|hand| hand.pair == pair) {
        return Some(hand.clone());
    }
    // Without a model there is nothing to be moved.
    results::tool(state).ready()?;
    let began = results::manual_begins(state, source);
    let cost = cost_of(state, source, began);
    Some(ManualTry { pair, source, pose: began, began, cost, began_cost: cost, icp: None, from_icp: None })
}

/// Puts the tool where `to` says, from where it is. A pose that is not finite changes nothing.
fn put(state: &mut State, to: impl FnOnce(PlanarPose) -> PlanarPose) {
    let Some(mut hand) = hold(state) else { return };
    let pose = to(hand.pose);
    if !pose.is_finite() {
        return;
    }
    hand.cost = cost_of(state, hand.source, pose);
    hand.pose = pose;
    // A registration from the place before is no longer asked for.
    hand.icp = None;
    hand.from_icp = None;
    state.workbench.hand = Some(hand);
}

/// The contact points changed: the same pose costs something else.
pub(super) fn refresh_cost(state: &mut State) {
    let Some(mut hand) = state.workbench.hand.take() else { return };
    hand.cost = cost_of(state, hand.source, hand.pose);
    hand.began_cost = cost_of(state, hand.source, hand.began);
    state.workbench.hand = Some(hand);
}

fn start_icp(state: &mut State, effects: &mut Vec<Effect>) {
    const WHAT: &str = "Register from here";
    if state.workbench.tool != SceneTool::Pose {
        return;
    }
    let Some(mut hand) = hold(state) else {
        return state.log.error(&TaskError::new(WHAT, "no tool to move"));
    };
    let Ok(Some(pose)) = results::pose_key(state, hand.source) else {
        let err = TaskError::new(WHAT, "the contact points are still being computed");
        return state.log.error(&err.with_hint("Try again."));
    };
    let (source, start) = (hand.source, hand.pose);
    let key = RunKey { pose, start: Some(start.into()) };
    // Asked for by a person: what failed before is tried again.
    state.tasks.failed.remove(&Request::Run(key.clone()));
    hand.icp = Some(key.clone());
    hand.from_icp = None;
    state.workbench.hand = Some(hand);
    if state.results.runs.contains(&key) {
        run_arrived(state, &key);
    }
    // The pane of the steps shows the same run, at its end: there the tool in hand goes.
    inspect::step(state, InspectCommand::Source(source), effects);
    inspect::step(state, InspectCommand::Start(Some(start)), effects);
    state.inspect.at = None;
}

/// A recorded registration is there: the tool in hand goes where the one it waits for ended.
pub(super) fn run_arrived(state: &mut State, key: &RunKey) {
    let Some(hand) = state.workbench.hand.as_ref().filter(|hand| hand.icp.as_ref() == Some(key)) else { return };
    let source = hand.source;
    let Some(pose) = state.results.runs.get(key).map(|run| run.result.grasp_from_object) else { return };
    let cost = cost_of(state, source, pose);
    if let Some(hand) = &mut state.workbench.hand {
        hand.pose = pose;
        hand.cost = cost;
        hand.icp = None;
        hand.from_icp = Some(key.clone());
    }
}

/// A recorded registration failed; whether a person waits for it, who has to be told.
pub(super) fn run_failed(state: &mut State, key: &RunKey) -> bool {
    match &mut state.workbench.hand {
        Some(hand) if hand.icp.as_ref() == Some(key) => {
            hand.icp = None;
            true
        }
        _ => false,
    }
}

fn accept(state: &mut State, effects: &mut Vec<Effect>) {
    let Some(hand) = state.workbench.hand.clone() else { return };
    if !labels::check_editable(state, "Accept the pose") {
        return;
    }
    let accepted = AcceptedPose { pose: hand.pose, by_hand: true };
    state.workbench.hand = None;
    labels::set_accepted(state, hand.source, Some(accepted), effects);
}
