//! The trial of a robot with the pose of the selected pair.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::{ImprintSource, TrialKey};
use super::super::results;
use super::super::results::{Computes, Demands, Registered};
use super::super::services::SharedServices;
use super::super::state::{Absent, Lookup, State};
use touch2touch_work::trials::{PairTrial, of_pair};

impl Computes for TrialKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<PairTrial>> {
        let Registered { tool, truth, .. } = results::registered(state, &self.0)?;
        let (truth, estimate) = (truth?, state.results.poses.get(&self.0)?.grasp_from_object);
        Some(Job::new(Lane::Compute, "Trial of a robot", move |_| of_pair(&tool.model, truth, estimate)))
    }
}

/// The trial of a robot with the registered pose of an imprint.
pub fn trial(state: &State, source: ImprintSource) -> Lookup<'_, Arc<PairTrial>> {
    let pose = results::pose(state, source);
    if matches!(pose, Lookup::Failed(_) | Lookup::Absent(_)) {
        return pose.without();
    }
    if pose.ready().is_some() && results::truth(state).is_none() {
        return Lookup::Absent(Absent::NoTruth);
    }
    let key = results::pose_key(state, source).map(|key| key.map(TrialKey));
    state.look_or(key, || None)
}

/// The trial, once its pose is there.
pub(crate) fn want_trial(wants: &mut Demands<'_>, source: ImprintSource) {
    let state = wants.state;
    let Ok(Some(pose)) = results::pose_key(state, source) else { return };
    let asked = results::shows_trial(state, source) && results::truth(state).is_some();
    if asked && state.results.poses.contains(&pose) {
        wants.ask(TrialKey(pose));
    }
}
