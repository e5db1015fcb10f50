//! Basin maps: where starts lead.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::BasinKey;
use super::super::pane::Demand;
use super::super::results;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::align::basin::Basin;

impl Computes for BasinKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Basin>> {
        let registered = results::registered(state, &self.pose)?;
        let (registration, plane) = (self.pose.registration, self.plane);
        Some(Job::new(Lane::Compute, "Basin map", move |cx| registered.basin(registration, plane, cx)))
    }

    fn arrived(&self, state: &mut State, _: &Arc<Basin>) {
        if let Some(at) = self.pose.cloud.place() {
            state.results.latest.entry(at).or_default().basin = Some(self.clone());
        }
    }
}

/// The recipe of the basin map; `Ok(None)` while something it is made from is missing.
///
/// # Errors
/// Why there can be none.
pub(crate) fn basin_key(state: &State) -> Result<Option<BasinKey>, Absent> {
    let pose = results::pose_key(state, state.inspect.source)?;
    Ok(pose.map(|pose| BasinKey { pose, plane: state.inspect.plane }))
}

/// The basin map.
pub fn basin(state: &State) -> Lookup<'_, Basin> {
    if let failed @ Lookup::Failed(_) = results::tool(state) {
        return failed.without();
    }
    let before = || {
        let map = state.results.basins.get(results::latest(state, state.inspect.source)?.basin.as_ref()?)?;
        (map.config.plane == state.inspect.plane).then_some(map)
    };
    state.look_or(basin_key(state), before).value()
}

pub(crate) fn want_basin(wants: &mut Demands<'_>) {
    if let (true, Ok(Some(key))) = (wants.state.needs(Demand::Basin), basin_key(wants.state)) {
        wants.ask(key);
    }
}
