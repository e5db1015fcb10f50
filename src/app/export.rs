//! The room of what is taken away: figures and pictures.

mod column;
mod command;
mod setup;

pub use super::keys::ImportForm;
pub use super::state::export::{FigureForm, FigureRows, Output, StillAsked};
pub(crate) use super::state::export::{MOST_PAIRS, SCALES};
pub(crate) use column::in_figure;
pub use command::{equivalent, equivalent_words};
pub use setup::{PairExport, pair_export};
pub(crate) use setup::{can_draw, compared, figure_recipes, figure_setup, picture_setup, space_recipe, still_setup};

use std::path::PathBuf;
use std::sync::Arc;

use super::effect::Effect;
use super::jobs::Lane;
use super::labels::ImportMasks;
use super::results;
use super::results::prediction::generate;
use super::state::State;
use super::state::tasks::TaskKind;
use super::state::view::UiRequest;
use super::tasks::{self, Write};
use crate::spatial;
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::PerPad;
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::compare::depict::apart;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::ExportChoice;
use touch2touch_pipeline::images::figure::{FigureMakers, FigurePane, FigureSetup, figure};
use touch2touch_pipeline::images::space::{SpaceInput, SpaceView, pictured};
use touch2touch_pipeline::images::still::still;
use touch2touch_pipeline::infer::bundle::Ends;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::PairLabels;

/// A command to what is taken away.
#[derive(Clone, Debug)]
pub enum ExportCommand {
    /// Opens or closes the form of a figure.
    Ask(bool),
    /// Changes what it says.
    SetForm(FigureForm),
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
        ExportCommand::Ask(asking) => state.export.asking = asking,
        ExportCommand::SetForm(form) => state.export.form = form.validated(),
        ExportCommand::AskMasks(asking) => state.export.asking_masks = asking,
        ExportCommand::SetMasks(choice) => state.export.masks = choice,
        ExportCommand::AskImport(from) => {
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
        Output::Figure => {
            state.export.asking = false;
            let setup = figure_setup(state);
            draw(state, "Draw the figure", setup, ended(file, "png"), effects);
        }
        Output::Masks => {
            let Some(source) = state.library.open.as_ref().map(|open| open.source.clone()) else { return };
            state.export.asking_masks = false;
            let (labels, choice) = (state.document.finished_labels(), state.export.masks);
            let write = Write::new(Lane::Compute, "Export masks", file, move |folder, _, cx| {
                Ok((source.export_masks(&labels, choice, &folder, cx)?, folder))
            });
            tasks::start(state, "Export masks", write, effects);
        }
        Output::Pair(source) => {
            let Some(pair) = pair_export(state, source) else {
                let err = TaskError::new("Export the pair", format!("there is no {} cloud of it", source.key()));
                return state.log.error(&err.with_hint("Show it in 3D first."));
            };
            let write = Write::new(Lane::Compute, "Export the pair", file, move |folder, _, _| {
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
            let file = if asked.turntable.is_none() { ended(file, "png") } else { file };
            let write = Write::new(Lane::Models, "Still", file, move |file, access, cx| {
                let drawer = spatial::stills()?;
                let dataset = source.on_disk("Still")?;
                let done = still(dataset, &setup, access.services.models(), &*drawer, &file, cx)?;
                let ([width, height], count) = (done.size_px, done.files.len());
                let frames = if count == 1 { String::new() } else { format!("{count} frames of ") };
                Ok((format!("Saved {} ({frames}{width} x {height} pixels)", file.display()), file))
            });
            tasks::start(state, "Draw the still", write, effects);
        }
        Output::Picture { pane, scale, error_m } => {
            let Some(setup) = picture_setup(state, pane, scale, error_m) else { return };
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
    let (recipes, space) = (figure_recipes(state, &setup), space_recipe(state, &setup));
    let compared = match setup.look.panes.contains(&FigurePane::Compare).then(|| compared(state)).transpose() {
        Ok(compared) => compared,
        Err(why) => return state.log.error(&TaskError::new(title, why)),
    };
    let write = Write::new(Lane::Models, "Figure", file, move |file, access, cx| {
        let predict = |pair: PairId, sample: &Arc<Sample>, cx: &JobCx| {
            let mut made = PerPad::default();
            for (key, bundle) in recipes.iter().filter(|(of, _)| *of == pair).flat_map(|(_, list)| list) {
                let finger = key.touch.finger;
                let ends = bundle.ends(&sample.rig).and_then(Result::ok);
                let input = |end: Ends| sample.pad(finger)?.picture(end.input).map(drop);
                if ends.and_then(input).is_none() {
                    continue;
                }
                let (one, sample) = (vec![key.clone()], Some(sample.clone()));
                let found = generate(&*access.services, one, bundle, &*source, sample, cx, None)?;
                made[finger] = found.into_iter().next().map(|(_, made)| Arc::unwrap_or_clone(made));
            }
            Ok(made)
        };
        let dataset = source.on_disk("Figure")?;
        let drawer = space.as_ref().map(|_| spatial::stills()).transpose()?;
        let in_space = |pair: PairId, sample: &Sample, view: &SpaceView, cx: &JobCx| {
            let lacks = || TaskError::new("Figure", "there is no 3D renderer");
            let ((recipe, labels), by) = space.as_ref().zip(drawer.as_deref()).ok_or_else(lacks)?;
            let none = PairLabels::default();
            let labels = labels.iter().find(|(of, _)| *of == pair).map_or(&none, |(_, labels)| labels);
            let input = SpaceInput { dataset, pair, recipe, labels, models: access.services.models() };
            pictured(input, sample, view, by, cx)
        };
        let apart = |pair: PairId, sample: &Arc<Sample>, cx: &JobCx| match &compared {
            Some(compared) => apart(compared, (dataset, pair), sample, access.services.models(), cx),
            None => Ok(PerPad::default()),
        };
        let makers = FigureMakers { predict, space: in_space, apart };
        let written = figure(dataset, &setup, makers, cx)?.write(&file)?;
        let [width, height] = written.size_px;
        Ok((format!("Saved {} ({width} x {height} pixels)", file.display()), file))
    });
    tasks::start(state, title, write, effects);
}
