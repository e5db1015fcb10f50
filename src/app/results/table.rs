//! The results table of the scores that are kept: there at once, without computing any.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::TableKey;
use super::super::pane::Pane;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::State;
use super::super::state::tasks::TaskKind;
use super::scores::{evaluation_setup, key_of};
use touch2touch_pipeline::scores::evaluate::{self, Evaluation};

/// The recipe of the table, as the choices are now.
fn table_key(state: &State) -> Option<TableKey> {
    Some(TableKey(key_of(state, &evaluation_setup(state)?)?))
}

/// The table, where it is looked at. What is being scored is shown when all of it is there.
pub(crate) fn want_table(wants: &mut Demands<'_>) {
    let state = wants.state;
    if state.selection.panes.contains(&Pane::Results) && state.tasks.of_kind(TaskKind::Evaluate).is_none() {
        let Some(key) = table_key(state) else { return };
        wants.ask_unless(state.table.looked_up.as_ref() == Some(&key), key);
    }
}

impl Computes for TableKey {
    fn job(&self, state: &State, services: &SharedServices) -> Option<Job<Option<Arc<Evaluation>>>> {
        let (services, setup) = (services.clone(), evaluation_setup(state)?);
        let source = state.library.open.as_ref()?.source.clone();
        Some(Job::new(Lane::Compute, "Look for results", move |_| {
            let dataset = source.on_disk("Look for results")?;
            Ok(evaluate::kept(dataset, &setup, services.models())?.map(Arc::new))
        }))
    }

    fn arrived(&self, state: &mut State, found: &Arc<Option<Arc<Evaluation>>>) {
        if table_key(state).as_ref() != Some(self) {
            return;
        }
        state.table.looked_up = Some(self.clone());
        // What could not be kept is in the table of this run alone.
        let more = |found: &&Arc<Evaluation>| {
            let shown = state.table.result.as_ref();
            shown.is_none_or(|shown| shown.setup != found.setup || shown.scored <= found.scored)
        };
        if let Some(found) = found.as_ref().as_ref().filter(more) {
            state.table.result = Some(found.clone());
        }
    }
}
