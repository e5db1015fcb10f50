//! The progress of the labeling of the open data set, and what it took.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::LabelStatsKey;
use super::super::pane::Demand;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::State;
use touch2touch_work::label_stats::LabelStats;
use touch2touch_work::repeats::Repeater;

impl Computes for LabelStatsKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<LabelStats>> {
        let source = state.library.open.as_ref()?.source.clone();
        let (reviews, person) = (state.document.reviews.clone(), self.person.clone());
        let share = f64::from(self.repeats_percent.get()) / 100.0;
        Some(Job::new(Lane::Compute, "Count the labels", move |_| {
            source.label_stats(&reviews, Repeater { person: &person, share })
        }))
    }

    fn arrived(&self, state: &mut State, stats: &Arc<LabelStats>) {
        if label_stats_key(state).as_ref() == Some(self) {
            state.document.stats = Some(stats.clone());
        }
    }
}

fn label_stats_key(state: &State) -> Option<LabelStatsKey> {
    let open = state.library.open.as_ref()?;
    Some(LabelStatsKey {
        dataset: open.seq,
        pairs: open.index().pairs.len(),
        marks: state.document.marks,
        person: state.settings.labeler(),
        repeats_percent: state.settings.repeats_percent.into(),
    })
}

/// Asks for the counts that the mask tools say of the data set.
pub(crate) fn want_label_stats(wants: &mut Demands<'_>) {
    if wants.state.needs(Demand::LabelStats)
        && let Some(key) = label_stats_key(wants.state)
    {
        wants.ask(key);
    }
}
