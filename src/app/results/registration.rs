//! Results about a registration: recorded runs, their steps and layers, distances to the model, other tools; and poses
//! that a person set, accepted, or starts from.

use std::sync::Arc;

use strum::IntoEnumIterator as _;

use super::super::jobs::{Job, Worker};
use super::super::keys::{DeviationKey, ImprintSource, LayersKey, PoseBits, RankingKey, RunKey, ToolKey};
use super::super::results::{self, Computes, Demands};
use super::super::services::Services;
use super::super::state::inspect::{Inspected, Inspection};
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::align::Ask;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::{AcceptedPose, PoseDifference};
use touch2touch_core::which_tool::Candidate;
use touch2touch_pipeline::compare::deviation::{self, Deviation};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::labels::ImprintOf;
use touch2touch_pipeline::masks::propose::hand_pose;
use touch2touch_pipeline::steps::layers::{self, LayerResult};
use touch2touch_pipeline::steps::tool::{LoadedTool, load_tool};

impl Computes for RunKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Inspection>> {
        let ((estimate, tool, sample), by) = (results::registered(state, &self.pose)?, self.pose.pose.as_ref()?.1);
        let start = self.start.map(PoseBits::get);
        Some(Job::new(Worker::Compute, "Registration, recorded", move |_| {
            let ask = Ask { starts: start.as_ref().map(std::slice::from_ref), record: true, ..Ask::default() };
            let run = estimate.pose_by(&sample, &tool.model, &*by.method(), ask)?;
            let points = estimate.points().map_err(Clone::clone)?.clone();
            Ok(Inspection::new(run, points, &tool.model, by))
        }))
    }

    fn arrived(&self, state: &mut State, _: &Arc<Inspection>) {
        if let Some(at) = self.pose.place() {
            state.results.latest.entry(at).or_default().inspection = Some(self.clone());
        }
    }
}

/// The recipe of the recorded run that is looked at; `Ok(None)` while something it is made from is missing.
///
/// # Errors
/// Why there can be none.
pub(crate) fn inspection_key(state: &State) -> Result<Option<RunKey>, Absent> {
    let pose = results::pose_key(state, state.inspect.source)?;
    Ok(pose.map(|pose| RunKey { pose, start: state.inspect.start }))
}

/// The recorded run that is looked at.
pub fn inspection(state: &State) -> Lookup<'_, Arc<Inspection>> {
    if let failed @ Lookup::Failed(_) = results::tool(state) {
        return failed.without();
    }
    let before = || state.results.runs.get(results::latest(state, state.inspect.source)?.inspection.as_ref()?);
    state.look_or(inspection_key(state), before)
}

/// The recorded registration that is looked at.
pub(crate) fn want_inspection(wants: &mut Demands<'_>) {
    let state = wants.state;
    if let (true, Ok(Some(run))) = (results::shows_steps(state, state.inspect.source), inspection_key(state)) {
        wants.ask(run);
    }
}

/// The step that is looked at, of the run shown (also of the one before, while the next is computed).
pub fn inspected(state: &State) -> Option<Inspected<'_>> {
    let inspection = inspection(state).shown()?;
    let last_run = inspection.num_runs().checked_sub(1)?;
    let run = state.inspect.run.unwrap_or(inspection.report().winner).min(last_run);
    let last = inspection.num_steps(run).checked_sub(1)?;
    let at = state.inspect.at.unwrap_or(last).min(last);
    Some(Inspected { inspection, run, at, step: inspection.step(run, at)? })
}

/// The step that the 3D view of a side shows instead of the registered pose.
pub(crate) fn inspected_in(state: &State, source: ImprintSource) -> Option<Inspected<'_>> {
    if results::shows_steps(state, source) { inspected(state) } else { None }
}

impl Computes for LayersKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<LayerResult>> {
        let estimate = state.results.estimates.get(&self.0.its_cloud())?.clone();
        let run = state.results.runs.get(&self.run())?.clone();
        Some(Job::new(Worker::Compute, "Layers of the registration", move |_| layers::layers(&estimate, &run.result)))
    }
}

/// The layers of an imprint.
pub fn layers(state: &State, source: ImprintSource) -> Lookup<'_, LayerResult> {
    let key = results::pose_key(state, source).map(|key| key.map(LayersKey));
    let run = key.clone().ok().flatten().and_then(|key| state.failure(key.run()));
    state.look_or(key, || None).or_failed(run).value()
}

/// The layers of an imprint, or the recorded registration that they need.
pub(crate) fn want_layers(wants: &mut Demands<'_>, source: ImprintSource) {
    let state = wants.state;
    let pose = results::pose_key(state, source).ok().flatten();
    let Some(key) = pose.map(LayersKey).filter(|_| results::shows_layers(state, source)) else { return };
    let run = key.run();
    match state.results.runs.contains(&run) || state.results.layers.contains(&key) {
        true => wants.ask(key),
        false => wants.ask(run),
    }
}

impl Computes for DeviationKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Deviation>> {
        let (estimate, tool, _) = results::registered(state, &self.0)?;
        let pose = results::pose_of(state, &self.0)?.grasp_from_object;
        Some(Job::new(Worker::Compute, "Distances to the model", move |_| {
            Ok(deviation::deviation(estimate.surface(), &tool.model, pose))
        }))
    }
}

/// The distances of the contact points of an imprint from the model at its registered pose.
pub fn deviation(state: &State, source: ImprintSource) -> Lookup<'_, Deviation> {
    let key = results::pose_key(state, source).map(|key| key.map(DeviationKey));
    state.look_or(key, || None).value()
}

/// The distances of an imprint, once its pose is there.
pub(crate) fn want_deviation(wants: &mut Demands<'_>, source: ImprintSource) {
    let state = wants.state;
    let Ok(Some(pose)) = results::pose_key(state, source) else { return };
    if results::shows_deviation(state, source) && results::pose_of(state, &pose).is_some() {
        wants.ask(DeviationKey(pose));
    }
}

impl Computes for RankingKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Vec<Candidate>>> {
        let open = state.library.open.as_ref()?;
        let ((estimate, _, sample), by) = (results::registered(state, &self.0)?, self.0.pose.as_ref()?.1);
        let source = open.source.clone();
        let known = |name: String| {
            let key = ToolKey { dataset: open.seq, name: name.as_str().into() };
            (name, state.results.tools.get(&key).cloned())
        };
        let tools: Vec<(String, Option<Arc<LoadedTool>>)> = open.index().tools().into_iter().map(known).collect();
        Some(Job::new(Worker::Compute, "Which tool", move |cx| {
            let mut models = Vec::with_capacity(tools.len());
            for (name, known) in tools {
                if cx.cancel.is_cancelled() {
                    return Err(TaskError::cancelled("Which tool"));
                }
                // A model that cannot be used is no candidate.
                let read = || Some(Arc::new(load_tool(&source.dataset, &name).ok()?));
                models.extend(known.or_else(read));
            }
            let tools = models.iter().map(|tool| (tool.name.as_str(), &tool.model));
            estimate.which_tool(&sample, tools, &*by.method())
        }))
    }

    fn wanted(wants: &mut Demands<'_>) {
        for source in ImprintSource::iter() {
            if let Some(key) = ranking_key(wants.state, source)
                && results::pose_of(wants.state, &key.0).is_some()
            {
                wants.ask(key);
            }
        }
    }
}

/// The key of the ranking; `None` where nobody asked for one, or there is no pose.
fn ranking_key(state: &State, source: ImprintSource) -> Option<RankingKey> {
    let asked = state.workbench.tools_tried.filter(|asked| state.pair_key() == Some(*asked));
    asked.and_then(|_| Some(RankingKey(results::pose_key(state, source).ok()??)))
}

/// The tools of the data set, ranked for a side of the selected pair; `None` where nobody asked for it.
pub fn ranking(state: &State, source: ImprintSource) -> Option<Lookup<'_, Vec<Candidate>>> {
    let key = ranking_key(state, source)?;
    Some(state.look_or(Ok(Some(key)), || None).value())
}

/// The imprint that a pose is made from, where all fingers show the same.
pub(crate) fn shown_imprint(state: &State, source: ImprintSource) -> Option<ImprintOf> {
    let rig = state.rig();
    let mut of = rig.pads().filter_map(|pad| results::mask_place(state, source, pad)).map(|place| place.of);
    let first = of.next()?;
    of.all(|other| other == first).then_some(first)
}

/// The pose that was accepted of the imprint of the selected pair that is shown.
pub fn accepted(state: &State, source: ImprintSource) -> Option<AcceptedPose> {
    state.document.pair(state.pair_name())?.accepted(&shown_imprint(state, source)?)
}

/// The other predictions of the selected pair that a pose was accepted of.
pub fn accepted_elsewhere(state: &State) -> Vec<&ImprintOf> {
    let shown = shown_imprint(state, ImprintSource::Predicted);
    let poses = state.document.pair(state.pair_name()).map(|labels| labels.accepted.keys());
    let other = |of: &&ImprintOf| of.source() == ImprintSource::Predicted && **of != ImprintOf::unknown();
    poses.into_iter().flatten().filter(other).filter(|of| Some(*of) != shown.as_ref()).collect()
}

/// The pose that a person set and accepted.
pub fn by_hand(state: &State, source: ImprintSource) -> Option<PlanarPose> {
    hand_pose(None, accepted(state, source))
}

/// The pose at which setting one by hand begins.
pub fn manual_begins(state: &State, source: ImprintSource) -> PlanarPose {
    let accepted = accepted(state, source).map(|a| a.pose);
    accepted.or_else(|| Some(results::pose(state, source).shown()?.grasp_from_object)).unwrap_or_default()
}

/// The difference between the registered poses of measurement and prediction, where both are there.
pub(crate) fn sides_apart(state: &State) -> Option<PoseDifference> {
    let pose = |source| Some(results::pose(state, source).ready()?.grasp_from_object);
    Some(PoseDifference::between(pose(ImprintSource::Measured)?, pose(ImprintSource::Predicted)?))
}
