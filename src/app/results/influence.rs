//! Which pixels a registered angle hangs on.

use std::sync::Arc;

use super::super::pane::Demand;
use super::pose::{PoseKey, Registered};
use super::{Computes, Demands, ImprintSource, Job, Lane, Lookup, SharedServices, State};
use touch2touch_work::influence::{Influence, influence};

/// The influence of the pixels on a registered angle.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct InfluenceKey(pub PoseKey);

impl Computes for InfluenceKey {
    type Value = Influence;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Influence>> {
        let Registered { clouds, tool, .. } = self.0.find(state)?;
        let pose = state.results.poses.get(&self.0)?.grasp_from_object;
        let sample = state.results.samples.get(&self.0.cloud.place()?.0)?.clone();
        let registration = self.0.registration;
        Some(Job::new(Lane::Compute, "Influence of the pixels", move |_| {
            influence(&clouds, &sample, &tool.model, registration, pose)
        }))
    }

    fn bytes(found: &Influence) -> usize {
        found.bytes()
    }

    fn arrived(&self, state: &mut State, _: &Arc<Influence>) {
        if let Some(at) = self.0.cloud.place().filter(|(_, side)| state.influence_key(*side) == Some(self.clone())) {
            state.results.latest.entry(at).or_default().influence = Some(self.clone());
        }
    }
}

impl State {
    /// Whether the influence of the pixels is shown over an imprint.
    pub(crate) fn shows_influence(&self, source: ImprintSource) -> bool {
        self.selection.influence && self.needs(Demand::Imprint(source))
    }

    /// The recipe of the influence; `None` while, or where, there is no pose.
    pub(crate) fn influence_key(&self, source: ImprintSource) -> Option<InfluenceKey> {
        Some(InfluenceKey(self.pose_key(source).ok()??))
    }

    /// Which pixels the registered angle of an imprint hangs on; meanwhile those that it hung on before.
    pub fn influence(&self, source: ImprintSource) -> Lookup<'_, Arc<Influence>> {
        let pose = self.pose(source);
        if matches!(pose, Lookup::Failed(_) | Lookup::Absent(_)) {
            return pose.without();
        }
        let before = || Some(self.shown_influence(source)?.1);
        self.look_or(Ok(self.influence_key(source)), before)
    }

    /// The influence that is drawn over an imprint, with its recipe: that of the pose now, else the last one.
    pub fn shown_influence(&self, source: ImprintSource) -> Option<(InfluenceKey, &Arc<Influence>)> {
        let found = |key: InfluenceKey| Some((key.clone(), self.results.influences.get(&key)?));
        let now = self.influence_key(source).and_then(found);
        now.or_else(|| found(self.latest(source)?.influence.clone()?))
    }
}

impl Demands<'_> {
    /// The influence of the pixels, where it is shown and the pose is there.
    pub(crate) fn influence(&mut self, source: ImprintSource) {
        let state = self.state;
        let Some(key) = state.influence_key(source).filter(|_| state.shows_influence(source)) else { return };
        if state.results.poses.contains(&key.0) {
            self.ask(key);
        }
    }
}
