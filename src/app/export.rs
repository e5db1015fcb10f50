//! The room of what is taken away: figures and pictures.

mod command;
pub mod state;

pub use state::{ExportState, FigureForm, MOST_PAIRS, Output, PairExport, SCALES};

use std::path::PathBuf;

use super::effect::Effect;
use super::state::State;
use super::view::state::UiRequest;
use crate::work::error::TaskError;
use crate::work::figure::FigureSetup;

/// What can happen to what is taken away.
#[derive(Clone, Debug)]
pub enum ExportCommand {
    /// Opens or closes the form of a figure.
    Ask(bool),
    /// Changes what it says.
    SetForm(FigureForm),
    /// Asks where something is to be written.
    Place(Output),
    /// Writes it.
    Write(Output, PathBuf),
}

pub(super) fn step(state: &mut State, command: ExportCommand, effects: &mut Vec<Effect>) {
    match command {
        ExportCommand::Ask(asking) => state.export.asking = asking,
        ExportCommand::SetForm(form) => state.export.form = form.validated(),
        ExportCommand::Place(output) => effects.push(Effect::Ui(UiRequest::PickOutput(output))),
        ExportCommand::Write(output, file) => write(state, output, file, effects),
    }
}

fn write(state: &mut State, output: Output, file: PathBuf, effects: &mut Vec<Effect>) {
    match output {
        Output::Figure => {
            state.export.asking = false;
            let setup = state.figure_setup();
            draw(state, "Draw the figure", setup, ended(file, "png"), effects);
        }
        Output::Pair(source) => {
            let Some(pair) = state.pair_export(source) else {
                let err = TaskError::new("Export the pair", format!("there is no {} cloud of it", source.key()));
                return state.log.error(&err.with_hint("Show it in 3D first."));
            };
            let ticket = state.tasks.start("Export the pair".into(), Vec::new());
            effects.push(Effect::ExportPair { ticket, pair: Box::new(pair), folder: file });
        }
        Output::Picture { pane, scale, error_m } => {
            let Some(setup) = state.picture_setup(pane, scale, error_m) else { return };
            let ending = if scale.is_some() { "png" } else { "svg" };
            draw(state, &format!("Save {}", pane.title()), setup, ended(file, ending), effects);
        }
    }
}

/// The file with an ending, where a person gave none.
fn ended(file: PathBuf, ending: &str) -> PathBuf {
    if file.extension().is_some() { file } else { file.with_extension(ending) }
}

fn draw(state: &mut State, title: &str, setup: FigureSetup, file: PathBuf, effects: &mut Vec<Effect>) {
    let Some(source) = state.library.open.as_ref().map(|open| open.source.clone()) else {
        return state.log.error(&TaskError::new(title, "no data set is open"));
    };
    let recipes = state.figure_recipes(&setup);
    let ticket = state.tasks.start(title.to_owned(), Vec::new());
    effects.push(Effect::Figure { ticket, source, setup: Box::new(setup), recipes, file });
}
