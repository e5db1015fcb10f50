//! The room of the results table.

pub mod state;

pub use state::{GRASPS, ScoreChoice, ScoreTable, SourceScores, Standing, TableState};

use std::path::PathBuf;
use std::sync::Arc;

use super::effect::Effect;
use super::state::State;
use super::tasks::state::{Level, Ticket};
use touch2touch_work::evaluate::{Evaluation, Setup};
use touch2touch_work::job::Progress;
use touch2touch_work::queue::measured_only;

/// How often what was scored so far is looked up while all pairs are scored.
const LOOKS: u64 = 24;

/// What can happen to the results table.
#[derive(Clone, Debug)]
pub enum EvaluateCommand {
    /// Gives a generator a row, or none.
    Choose(Arc<str>, bool),
    /// How many grasps of each tool.
    Grasps(Option<usize>),
    /// Shows what was published, or not.
    Published(bool),
    /// Scores the open data set.
    Start,
    /// Predicts and scores every pair of it.
    All,
    /// Scores the measured imprints of every pair, so that the most uncertain masks are known; runs no generator.
    Rank,
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
        EvaluateCommand::Grasps(grasps) => state.table.grasps_per_tool = grasps.map(|n| n.max(1)),
        EvaluateCommand::Published(shown) => state.table.published = shown,
        EvaluateCommand::Start => start(state, state.evaluation_setup(), "Evaluate", effects),
        EvaluateCommand::All => start(state, state.setup_of_all(), "Predict all of", effects),
        EvaluateCommand::Rank => rank(state, effects),
        EvaluateCommand::Export(folder) => {
            let Some(evaluation) = state.table.result.clone() else { return };
            let ticket = state.tasks.start("Export the table".into(), Vec::new());
            effects.push(Effect::ExportTable { ticket, evaluation, published: state.table.published, folder });
        }
    }
}

/// Has the measured imprints of every pair scored.
pub(super) fn rank(state: &mut State, effects: &mut Vec<Effect>) {
    let setup = state.setup_of_all().map(|setup| measured_only(&setup));
    start(state, setup, "Rank the masks of", effects);
}

/// Has the open data set scored. One at a time: a second would only take the cores from the first.
fn start(state: &mut State, setup: Option<Setup>, what: &str, effects: &mut Vec<Effect>) {
    if state.evaluating().is_some() {
        return;
    }
    let (Some(setup), Some(open)) = (setup, &state.library.open) else { return };
    let source = open.source.clone();
    let ticket = state.tasks.start(format!("{what} {}", source.title()), Vec::new());
    (state.table.running, state.table.next_look) = (Some(ticket), 0);
    effects.push(Effect::Evaluate { ticket, source, setup: Box::new(setup) });
}

/// Has what was scored so far looked up now and then.
pub(super) fn progressed(state: &mut State, ticket: Ticket, progress: &Progress) {
    let table = &mut state.table;
    if table.running == Some(ticket) && progress.done >= table.next_look {
        table.next_look = progress.done + (progress.total / LOOKS).max(1);
        table.round += 1;
    }
}

/// Shows a table; one that another data set's opening stopped has nowhere to be shown.
pub(super) fn arrived(state: &mut State, ticket: Ticket, evaluation: Arc<Evaluation>) {
    if state.table.running.take_if(|running| *running == ticket).is_none() {
        return;
    }
    if !evaluation.complete {
        state.log.info("The evaluation was stopped: the table holds what was scored until then");
    }
    if let Some(first) = evaluation.skipped.first() {
        let text = format!("{} things could not be scored", evaluation.skipped.len());
        let why = format!("the first: {}: {}", first.what, first.why);
        state.log.push(Level::Warning, text, Some(why), None);
    }
    // A ranking is no results table.
    if !evaluation.setup.bundles.is_empty() {
        state.table.result = Some(evaluation);
    }
    state.table.round += 1;
}
