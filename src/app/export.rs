//! The room of what is taken away: pictures in 3D, pairs for other programs, masks.

mod command;
mod setup;

pub use super::keys::ImportForm;
pub use super::state::export::{Output, StillAsked};
pub use command::{equivalent, equivalent_words};
pub use setup::{PairExport, pair_export};
pub(crate) use setup::{can_draw, still_setup};

use std::path::PathBuf;

use super::effect::Effect;
use super::jobs::Worker;
use super::labels::ImportMasks;
use super::results;
use super::state::State;
use super::state::tasks::TaskKind;
use super::state::view::UiRequest;
use super::tasks::{self, Write};
use crate::spatial;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::{DrawnMasks, ExportChoice, ExportSetup, export_masks};
use touch2touch_pipeline::labels::Labels;
use touch2touch_pipeline::still::still;

/// A command to what is taken away.
#[derive(Clone, Debug)]
pub enum ExportCommand {
    /// Opens or closes the form of an export of masks.
    AskMasks(bool),
    /// Changes what it says.
    SetMasks(ExportChoice),
    /// Says what an import of masks from a folder or file would change; `None` asks no more.
    AskImport(Option<PathBuf>),
    /// True where it replaces what was painted by hand as well.
    ImportOverHand(bool),
    /// Does it.
    Import,
    /// Asks where something is to be written.
    Place(Output),
    /// Writes it.
    Write(Output, PathBuf),
}

pub(super) fn step(state: &mut State, command: ExportCommand, effects: &mut Vec<Effect>) {
    match command {
        ExportCommand::AskMasks(asking) => {
            state.close_dialogs();
            state.export.asking_masks = asking;
        }
        ExportCommand::SetMasks(choice) => state.export.masks = choice,
        ExportCommand::AskImport(from) => {
            state.close_dialogs();
            state.export.imports += 1;
            let asked = state.export.imports;
            state.export.importing = from.map(|from| ImportForm { from, over_drawn: false, asked });
        }
        ExportCommand::ImportOverHand(over_drawn) => {
            if let Some(form) = &mut state.export.importing {
                form.over_drawn = over_drawn;
            }
        }
        ExportCommand::Import => import(state, effects),
        ExportCommand::Place(output) => effects.push(Effect::Ui(UiRequest::PickOutput(output))),
        ExportCommand::Write(output, file) => write(state, output, file, effects),
    }
}

fn import(state: &mut State, effects: &mut Vec<Effect>) {
    let (Some(setup), Some(open)) = (results::import_setup(state), &state.library.open) else { return };
    if state.tasks.of_kind(TaskKind::Import).is_some() {
        return;
    }
    let source = open.source.clone();
    state.export.importing = None;
    tasks::start(state, TaskKind::Import.name(), ImportMasks { source, setup }, effects);
}

fn write(state: &mut State, output: Output, file: PathBuf, effects: &mut Vec<Effect>) {
    match output {
        Output::Masks => {
            let Some(source) = state.library.open.as_ref().map(|open| open.source.clone()) else { return };
            state.export.asking_masks = false;
            let (labels, choice) = (state.document.finished_labels(), state.export.masks);
            let write = Write::new(Worker::Compute, "Export masks", file, move |folder, _, cx| {
                let setup = ExportSetup { pairs: None, choice };
                let masks = DrawnMasks { labels: &Labels::of(&source.dataset), changed: &labels };
                let (plan, _) = export_masks(&source.dataset, &masks, &setup, &folder, None, cx)?;
                Ok((format!("Exported to {}: {}", folder.display(), plan.lines().join("; ")), folder))
            });
            tasks::start(state, "Export masks", write, effects);
        }
        Output::Pair(source) => {
            let Some(pair) = pair_export(state, source) else {
                let err = TaskError::new("Export the pair", format!("it has no {} points", source.key()));
                return state.log.error(&err.with_hint("Show it in 3D first."));
            };
            let write = Write::new(Worker::Compute, "Export the pair", file, move |folder, _, _| {
                let files = pair.write(&folder)?;
                let names = files.iter().filter_map(|file| file.file_name()).map(|name| name.to_string_lossy());
                let text = format!("Saved {}", names.collect::<Vec<_>>().join(", "));
                Ok((text, files.into_iter().next().unwrap_or_default()))
            });
            tasks::start(state, "Export the pair", write, effects);
        }
        Output::Still(asked) => {
            let Some((setup, open)) = still_setup(state, asked).zip(state.library.open.as_ref()) else { return };
            let source = open.source.clone();
            let png = asked.turntable.is_none() && file.extension().is_none();
            let file = if png { file.with_extension("png") } else { file };
            let write = Write::new(Worker::Models, "Still", file, move |file, access, cx| {
                let drawer = spatial::stills()?;
                let done = still(&source.dataset, &setup, &access.services.models, drawer, &file, cx)?;
                let ([width, height], count) = (done.size_px, done.files.len());
                let frames = if count == 1 { String::new() } else { format!("{count} frames of ") };
                Ok((format!("Saved {} ({frames}{width} x {height} pixels)", file.display()), file))
            });
            tasks::start(state, "Draw the still", write, effects);
        }
    }
}
