//! The room of the results table.

pub use super::state::evaluate::ScoreChoice;

use std::path::PathBuf;
use std::sync::Arc;

use super::effect::{Access, Effect};
use super::jobs::{Job, Worker};
use super::keys::ScoredKey;
use super::results::{self, Computes, Demands};
use super::services::Services;
use super::state::State;
use super::state::tasks::{Level, TaskKind};
use super::tasks::{self, Start};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::scores::evaluate::{self, Evaluation, Kept};

/// A command to the results table.
#[derive(Clone, Debug)]
pub enum EvaluateCommand {
    /// Gives a generator a row, or none.
    Choose(Arc<str>, bool),
    /// Shows what was published, or not.
    Published(bool),
    /// Predicts and scores every pair of the open data set.
    Start,
    /// Writes the table into a folder.
    Export(PathBuf),
}

pub(super) fn step(state: &mut State, command: EvaluateCommand, effects: &mut Vec<Effect>) {
    match command {
        EvaluateCommand::Choose(bundle, chosen) => {
            if chosen {
                state.table.left_out.remove(&bundle);
            } else {
                state.table.left_out.insert(bundle);
            }
        }
        EvaluateCommand::Published(shown) => state.table.published = shown,
        // One at a time: a second would only take the cores from the first.
        EvaluateCommand::Start => {
            let (Some(setup), Some(open)) = (results::evaluation_setup(state), &state.library.open) else { return };
            let source = open.source.clone();
            let start = Start::new(TaskKind::Evaluate, format!("Predict all of {}", source.dataset.title));
            let run = move |access: &Access, cx: &JobCx| {
                let folder = access.services.evaluations.as_ref();
                // As the data are now: what changes meanwhile is not scored.
                let kept = folder.map(|folder| Kept::of(folder, &source.dataset, &setup));
                let evaluation = evaluate::evaluate(&source.dataset, &setup, &access.services.models, cx)?;
                if let Some(kept) = kept.filter(|_| evaluation.complete)
                    && let Err(err) = kept.write(&evaluation)
                {
                    log::warn!("The scores could not be kept for the next start: {err}");
                }
                Ok(Arc::new(evaluation))
            };
            tasks::start(state, start, effects, run, scored);
        }
        EvaluateCommand::Export(folder) => {
            let Some(evaluation) = state.table.result.clone() else { return };
            let published = state.table.published;
            let what = "Export the table";
            tasks::write(state, (Worker::Files, what, what), folder, effects, move |folder, _, _| {
                let folder = evaluate::export(&evaluation, published, &folder)?;
                let line = format!("Wrote evaluation.csv and .json to {}", folder.display());
                Ok((line, folder))
            });
        }
    }
}

/// A data set was scored.
pub fn scored(evaluation: &Arc<Evaluation>, state: &mut State, _: &mut Vec<Effect>) {
    if !evaluation.complete {
        state.log.info("The evaluation was stopped: the table holds what was scored until then");
    }
    if let Some(first) = evaluation.skipped.first() {
        let text = format!("{} items could not be scored", evaluation.skipped.len());
        let why = format!("the first: {}: {}", first.what, first.why);
        state.log.push(Level::Warning, text, Some(why), None);
    }
    state.table.result = Some(evaluation.clone());
    if let Some(open) = &state.library.open {
        state.table.take(evaluation, &open.source.dataset.index);
        state.reorder();
    }
}

impl Computes for ScoredKey {
    fn job(&self, state: &State, services: &Arc<Services>) -> Option<Job<Option<Arc<Evaluation>>>> {
        let (setup, open) = (results::evaluation_setup(state)?, state.library.open.as_ref()?);
        let (source, services) = (open.source.clone(), services.clone());
        // A look at every file of a large data set: nothing else waits for it.
        Some(Job::new(Worker::Batch, "Look for earlier scores", move |_| {
            let kept = services.evaluations.as_ref().map(|folder| Kept::of(folder, &source.dataset, &setup));
            Ok(kept.and_then(|kept| kept.read(setup)).map(Arc::new))
        }))
    }

    fn is_there(&self, state: &State) -> bool {
        state.table.looked_up == Some(self.0)
    }

    fn wanted(wants: &mut Demands<'_>) {
        let state = wants.state;
        if let Some(open) = state.library.open.as_ref().filter(|_| results::evaluation_setup(state).is_some()) {
            wants.ask(ScoredKey(open.seq));
        }
    }

    fn arrived(&self, state: &mut State, found: &Arc<Option<Arc<Evaluation>>>) {
        state.table.looked_up = Some(self.0);
        if let Some(evaluation) = found.as_ref().as_ref().filter(|_| state.table.result.is_none()) {
            scored(evaluation, state, &mut Vec::new());
        }
    }
}
