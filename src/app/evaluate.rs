//! The room of the results table.

pub use super::state::evaluate::ScoreChoice;

use std::path::PathBuf;
use std::sync::Arc;

use super::effect::{Access, Effect, Task};
use super::jobs::Worker;
use super::source::Source;
use super::state::State;
use super::state::tasks::{Level, TaskKind};
use super::{results, tasks};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::scores::evaluate::{self, Evaluation, Setup};

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
        EvaluateCommand::Start => start(state, results::evaluation_setup(state), "Predict all of", effects),
        EvaluateCommand::Export(folder) => {
            let Some(evaluation) = state.table.result.clone() else { return };
            let published = state.table.published;
            let what = "Export the table";
            let write = tasks::Write::new(Worker::Files, what, folder, move |folder, _, _| {
                let folder = evaluate::export(&evaluation, published, &folder)?;
                let line = format!("Wrote evaluation.csv and .json to {}", folder.display());
                Ok((line, folder))
            });
            tasks::start(state, what, write, effects);
        }
    }
}

/// Has the open data set scored. One at a time: a second would only take the cores from the first.
fn start(state: &mut State, setup: Option<Setup>, what: &str, effects: &mut Vec<Effect>) {
    let (Some(setup), Some(open)) = (setup, &state.library.open) else { return };
    let source = open.source.clone();
    let title = format!("{what} {}", source.dataset.title);
    tasks::start(state, title, Score { source, setup }, effects);
}

/// Scores a data set.
pub struct Score {
    source: Arc<Source>,
    setup: Setup,
}

impl Task for Score {
    type End = Arc<Evaluation>;
    const KIND: TaskKind = TaskKind::Evaluate;

    fn run(self, access: &Access, cx: &JobCx) -> Result<Self::End, TaskError> {
        evaluate::evaluate(&self.source.dataset, &self.setup, &access.services.models, cx).map(Arc::new)
    }

    fn ended(evaluation: &Self::End, state: &mut State, _: &mut Vec<Effect>) {
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
}
