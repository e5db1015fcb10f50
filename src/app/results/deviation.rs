//! Signed distances between contact points and the registered model.

use super::pose::{PoseKey, Registered};
use super::{Computes, Demands, ImprintSource, Job, Lane, Lookup, SharedServices, State};
use touch2touch_work::deviation::{Deviation, deviation};

/// The distances at a registered pose.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DeviationKey(pub PoseKey);

impl Computes for DeviationKey {
    type Value = Deviation;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Deviation>> {
        let Registered { clouds, tool, .. } = self.0.find(state)?;
        let pose = state.results.poses.get(&self.0)?.grasp_from_object;
        Some(Job::new(Lane::Compute, "Distances to the model", move |_| Ok(deviation(&clouds, &tool.model, pose))))
    }

    fn bytes(found: &Deviation) -> usize {
        found.bytes()
    }
}

impl State {
    /// How far the contact points of an imprint lie from the model at its registered pose.
    pub fn deviation(&self, source: ImprintSource) -> Lookup<'_, Deviation> {
        let key = self.pose_key(source).map(|key| key.map(DeviationKey));
        self.look_or(key, || None).value()
    }
}

impl Demands<'_> {
    /// The distances of an imprint, once its pose is there.
    pub(crate) fn deviation(&mut self, source: ImprintSource) {
        let state = self.state;
        let Ok(Some(pose)) = state.pose_key(source) else { return };
        if state.shows_deviation(source) && state.results.poses.contains(&pose) {
            self.ask(DeviationKey(pose));
        }
    }
}
