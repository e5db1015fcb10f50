//! Basin maps: where starts lead.

use std::sync::Arc;

use super::super::pane::Demand;
use super::pose::{PoseKey, Registered};
use super::{Absent, Computes, Demands, Job, Lane, Lookup, SharedServices, State};
use touch2touch_core::align::basin::{Basin, Plane};
use touch2touch_work::pose::basin;

/// A basin map.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BasinKey {
    /// What is registered, and how.
    pub pose: PoseKey,
    /// Which starts are tried.
    pub plane: Plane,
}

impl Computes for BasinKey {
    type Value = Basin;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Basin>> {
        let Registered { clouds, tool, .. } = self.pose.find(state)?;
        let (registration, plane) = (self.pose.registration, self.plane);
        Some(Job::new(Lane::Compute, "Basin map", move |cx| {
            basin(&clouds.contact_points(), &tool.model, registration, plane, cx)
        }))
    }

    fn bytes(found: &Basin) -> usize {
        found.bytes()
    }

    fn arrived(&self, state: &mut State, _: &Arc<Basin>) {
        if let Some(at) = self.pose.cloud.place() {
            state.results.latest.entry(at).or_default().basin = Some(self.clone());
        }
    }
}

impl State {
    /// The recipe of the basin map; `Ok(None)` while something it is made from is missing.
    ///
    /// # Errors
    /// Why there can be none.
    pub(crate) fn basin_key(&self) -> Result<Option<BasinKey>, Absent> {
        let pose = self.pose_key(self.inspect.source)?;
        Ok(pose.map(|pose| BasinKey { pose, plane: self.inspect.plane }))
    }

    /// The basin map.
    pub fn basin(&self) -> Lookup<'_, Basin> {
        if let failed @ Lookup::Failed(_) = self.tool() {
            return failed.without();
        }
        let before = || {
            let map = self.results.basins.get(self.latest(self.inspect.source)?.basin.as_ref()?)?;
            (map.config.plane == self.inspect.plane).then_some(map)
        };
        self.look_or(self.basin_key(), before).value()
    }
}

impl Demands<'_> {
    pub(crate) fn basin(&mut self) {
        if let (true, Ok(Some(key))) = (self.state.needs(Demand::Basin), self.state.basin_key()) {
            self.ask(key);
        }
    }
}
