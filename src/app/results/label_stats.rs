//! How far the labeling of the open data set is, and what it took.

use std::sync::Arc;

use super::super::pane::Demand;
use super::{Computes, DatasetSeq, Demands, Job, Lane, SharedServices, State};
use touch2touch_core::bits::Bits;
use touch2touch_work::label_stats::LabelStats;
use touch2touch_work::repeats::Repeater;

/// Everything that decides what is counted.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LabelStatsKey {
    dataset: DatasetSeq,
    /// Pairs that the data set has by now.
    pairs: usize,
    /// How often review states were written since.
    marks: u64,
    /// Whose repeats.
    person: String,
    /// How many pairs come back, percent.
    repeats_percent: Bits,
}

impl Computes for LabelStatsKey {
    type Value = LabelStats;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<LabelStats>> {
        let source = state.library.open.as_ref()?.source.clone();
        let (reviews, person) = (state.document.reviews.clone(), self.person.clone());
        let share = f64::from(self.repeats_percent.get()) / 100.0;
        Some(Job::new(Lane::Compute, "Count the labels", move |_| {
            source.label_stats(&reviews, Repeater { person: &person, share })
        }))
    }

    fn bytes(stats: &LabelStats) -> usize {
        512 * stats.pairs.len() + 128 * stats.tools.len()
    }

    fn arrived(&self, state: &mut State, stats: &Arc<LabelStats>) {
        if state.label_stats_key().as_ref() == Some(self) {
            state.document.stats = Some(stats.clone());
        }
    }
}

impl State {
    fn label_stats_key(&self) -> Option<LabelStatsKey> {
        let open = self.library.open.as_ref()?;
        Some(LabelStatsKey {
            dataset: open.seq,
            pairs: open.index().pairs.len(),
            marks: self.document.marks,
            person: self.person(),
            repeats_percent: self.settings.repeats_percent.into(),
        })
    }
}

impl Demands<'_> {
    /// What the mask tools say about the data set.
    pub(crate) fn label_stats(&mut self) {
        if self.state.needs(Demand::LabelStats)
            && let Some(key) = self.state.label_stats_key()
        {
            self.ask(key);
        }
    }
}
