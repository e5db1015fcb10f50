//! The scores that are kept of the open data set.

use super::super::evaluate::state::ScoreTable;
use super::super::pane::Demand;
use super::{Computes, DatasetSeq, Demands, Job, Lane, SharedServices, State};
use std::sync::Arc;
use touch2touch_work::evaluate::{self, Setup};

/// Everything that decides which scores are there.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ScoresKey {
    dataset: DatasetSeq,
    /// Pairs that the data set has by now.
    pairs: usize,
    /// How they are scored, as text.
    setup: String,
    /// How often scores were computed since.
    round: u64,
}

impl Computes for ScoresKey {
    type Value = ScoreTable;

    fn job(&self, state: &State, services: &SharedServices) -> Option<Job<ScoreTable>> {
        let (services, setup) = (services.clone(), state.setup_of_all()?);
        let source = state.library.open.as_ref()?.source.clone();
        Some(Job::new(Lane::Compute, "Look for scores", move |_| {
            let dataset = source.on_disk("Look for scores")?;
            Ok(ScoreTable::new(source.index(), evaluate::known(dataset, &setup, services.models())?))
        }))
    }

    fn bytes(table: &ScoreTable) -> usize {
        table.bytes()
    }

    fn arrived(&self, state: &mut State, table: &Arc<ScoreTable>) {
        if state.scores_key().as_ref() == Some(self) {
            state.table.scores = table.clone();
            state.reorder();
        }
    }
}

impl State {
    /// How all pairs of the open data set are scored: as the results table does it, without leaving grasps out.
    pub(crate) fn setup_of_all(&self) -> Option<Setup> {
        Some(Setup { grasps_per_tool: None, ..self.evaluation_setup()? })
    }

    /// The recipe of the scores in force.
    pub(in crate::app) fn scores_key(&self) -> Option<ScoresKey> {
        let open = self.library.open.as_ref().filter(|open| open.source.as_dataset().is_some())?;
        let setup = self.setup_of_all()?;
        Some(ScoresKey {
            dataset: open.seq,
            pairs: open.index().pairs.len(),
            setup: serde_json::to_string(&setup).ok()?,
            round: self.table.round,
        })
    }
}

impl Demands<'_> {
    /// The scores that lists and pictures of all pairs show.
    pub(crate) fn scores(&mut self) {
        if self.state.needs(Demand::Scores)
            && let Some(key) = self.state.scores_key()
        {
            self.ask(key);
        }
    }
}
