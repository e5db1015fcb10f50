//! The room of the results table.

pub mod state;

pub use state::{GRASPS, TableState};

use std::path::PathBuf;
use std::sync::Arc;

use super::effect::Effect;
use super::state::State;
use super::tasks::state::{Level, Ticket};
use crate::work::evaluate::Evaluation;

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
        EvaluateCommand::Start => {
            // One at a time: a second would only take the cores from the first.
            if state.evaluating().is_some() {
                return;
            }
            let (Some(setup), Some(open)) = (state.evaluation_setup(), &state.library.open) else { return };
            let source = open.source.clone();
            let ticket = state.tasks.start(format!("Evaluate {}", source.title()), Vec::new());
            state.table.running = Some(ticket);
            effects.push(Effect::Evaluate { ticket, source, setup: Box::new(setup) });
        }
        EvaluateCommand::Export(folder) => {
            let Some(evaluation) = state.table.result.clone() else { return };
            let ticket = state.tasks.start("Export the table".into(), Vec::new());
            effects.push(Effect::ExportTable { ticket, evaluation, published: state.table.published, folder });
        }
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
    state.table.set_result(Some(evaluation));
    state.reorder();
}
