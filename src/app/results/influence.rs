//! The influence of each pixel on a registered angle.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::{ImprintSource, InfluenceKey};
use super::super::results;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::{Lookup, State};
use touch2touch_work::influence::Influence;

impl Computes for InfluenceKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Influence>> {
        let registered = results::registered(state, &self.0)?;
        let (pose, registration) = (state.results.poses.get(&self.0)?.clone(), self.0.registration);
        Some(Job::new(Lane::Compute, "Influence of the pixels", move |_| {
            registered.influence(registration, &pose.report)
        }))
    }

    fn arrived(&self, state: &mut State, _: &Arc<Influence>) {
        if let Some(at) = self.0.cloud.place().filter(|(_, side)| influence_key(state, *side) == Some(self.clone())) {
            state.results.latest.entry(at).or_default().influence = Some(self.clone());
        }
    }
}

/// The recipe of the influence; `None` while, or where, there is no pose.
pub(crate) fn influence_key(state: &State, source: ImprintSource) -> Option<InfluenceKey> {
    Some(InfluenceKey(results::pose_key(state, source).ok()??))
}

/// The influence of the pixels on the registered angle of an imprint; meanwhile that on the one before.
pub fn influence(state: &State, source: ImprintSource) -> Lookup<'_, Arc<Influence>> {
    let pose = results::pose(state, source);
    if matches!(pose, Lookup::Failed(_) | Lookup::Absent(_)) {
        return pose.without();
    }
    let before = || Some(shown_influence(state, source)?.1);
    state.look_or(Ok(influence_key(state, source)), before)
}

/// The influence that is drawn over an imprint, with its recipe: that of the pose now, else the last one.
pub fn shown_influence(state: &State, source: ImprintSource) -> Option<(InfluenceKey, &Arc<Influence>)> {
    let found = |key: InfluenceKey| Some((key.clone(), state.results.influences.get(&key)?));
    let now = influence_key(state, source).and_then(found);
    now.or_else(|| found(results::latest(state, source)?.influence.clone()?))
}

/// The influence of the pixels, where it is shown and the pose is there.
pub(crate) fn want_influence(wants: &mut Demands<'_>, source: ImprintSource) {
    let state = wants.state;
    let Some(key) = influence_key(state, source).filter(|_| results::shows_influence(state, source)) else { return };
    if state.results.poses.contains(&key.0) {
        wants.ask(key);
    }
}
