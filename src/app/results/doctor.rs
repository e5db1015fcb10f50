//! The lines about the open data set, as far as they cost no more than a second.

use super::super::jobs::{Job, Lane};
use super::super::keys::{AboutKey, Revision};
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::State;
use touch2touch_pipeline::doctor::{Fact, facts};
use touch2touch_pipeline::export::DrawnMasks;
use touch2touch_pipeline::labels::Labels;

impl Computes for AboutKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Vec<Fact>>> {
        let source = state.library.open.as_ref()?.source.clone();
        let changed = state.document.labels.clone();
        Some(Job::new(Lane::Compute, "About this data", move |_| {
            let dataset = source.on_disk("About this data")?;
            Ok(facts(dataset, &DrawnMasks { labels: &Labels::of(dataset), changed: &changed }))
        }))
    }
}

/// The key of the lines about the open data set.
pub(crate) fn doctor_key(state: &State) -> Option<AboutKey> {
    let open = state.library.open.as_ref()?;
    let (pairs, revision) = (open.index().pairs.len(), Revision(state.document.last_revision));
    Some(AboutKey { dataset: open.seq, pairs, revision, units_named: state.library.units_named })
}

/// Asks for them while the panel is looked at.
pub(crate) fn want_doctor(wants: &mut Demands<'_>) {
    if wants.state.doctor.shown
        && wants.state.document.stroke.is_none()
        && let Some(key) = doctor_key(wants.state)
    {
        wants.ask(key);
    }
}
