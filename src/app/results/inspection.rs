//! The steps of a recorded registration, made ready to be looked through.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::{ImprintSource, Inspection, InspectionKey, RunKey};
use super::super::results;
use super::super::results::{Computes, Demands, Registered};
use super::super::services::SharedServices;
use super::super::state::inspect::Inspected;
use super::super::state::{Absent, Lookup, State};

impl Computes for InspectionKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Inspection>> {
        let (Registered { clouds, tool, .. }, registration) =
            (results::registered(state, &self.0.pose)?, self.0.pose.registration);
        let run = state.results.runs.get(&self.0)?.clone();
        Some(Job::new(Lane::Compute, "Steps of the registration", move |_| {
            Ok(Inspection::new(run, clouds.contact_points(), &tool.model, registration))
        }))
    }

    fn arrived(&self, state: &mut State, _: &Arc<Inspection>) {
        if let Some(at) = self.0.pose.cloud.place() {
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
    let before = || state.results.inspections.get(results::latest(state, state.inspect.source)?.inspection.as_ref()?);
    let key = inspection_key(state);
    let run = key.clone().ok().flatten().and_then(|run| state.failure(run));
    state.look_or(key.map(|key| key.map(InspectionKey)), before).or_failed(run)
}

/// The steps that are looked at, or the recorded registration that they are of.
pub(crate) fn want_inspection(wants: &mut Demands<'_>) {
    let state = wants.state;
    if let (true, Ok(Some(run))) = (results::shows_steps(state, state.inspect.source), inspection_key(state)) {
        let there = state.results.runs.contains(&run);
        let key = InspectionKey(run.clone());
        match there || state.results.inspections.contains(&key) {
            true => wants.ask(key),
            false => wants.ask(run),
        }
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
