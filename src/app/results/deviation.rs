//! Signed distances between contact points and the registered model.

use super::super::jobs::{Job, Lane};
use super::super::keys::{DeviationKey, ImprintSource};
use super::super::results;
use super::super::results::{Computes, Demands, Registered};
use super::super::services::SharedServices;
use super::super::state::{Lookup, State};
use touch2touch_pipeline::compare::deviation::Deviation;

impl Computes for DeviationKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Deviation>> {
        let Registered { clouds, tool, .. } = results::registered(state, &self.0)?;
        let pose = state.results.poses.get(&self.0)?.grasp_from_object;
        Some(Job::new(Lane::Compute, "Distances to the model", move |_| {
            Ok(touch2touch_pipeline::compare::deviation::deviation(&clouds, &tool.model, pose))
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
    if results::shows_deviation(state, source) && state.results.poses.contains(&pose) {
        wants.ask(DeviationKey(pose));
    }
}
