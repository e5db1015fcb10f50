//! The room of what is taken away: pictures in 3D, pairs for other programs, masks.

mod command;
mod still;

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use command::{equivalent, equivalent_words};
pub(crate) use still::{still_key, still_setup};

use super::effect::{Access, Effect};
use super::jobs::Worker;
pub use super::keys::ImportForm;
use super::keys::{ImprintSource, Registration};
use super::results;
use super::state::State;
pub use super::state::export::{Output, StillAsked};
use super::state::tasks::{Level, TaskKind};
use super::state::view::{Purpose, UiRequest};
use super::tasks::{self, Start};
use crate::spatial;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::import::{Import, ImportSetup, import_masks};
use touch2touch_pipeline::export::pair_files::{self, PairParts};
use touch2touch_pipeline::export::{DrawnMasks, ExportChoice, ExportSetup, export_masks};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::Labels;
use touch2touch_pipeline::steps::estimate::Estimate;
use touch2touch_pipeline::steps::prediction::predicted_by;
use touch2touch_pipeline::steps::tool::LoadedTool;
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
    /// Opens, changes or closes the form of a 3D picture.
    AskStill(Option<StillAsked>),
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
            state.export.asked += 1;
            let asked = state.export.asked;
            state.export.importing = from.map(|from| ImportForm { from, over_drawn: false, asked });
        }
        ExportCommand::AskStill(asked) => {
            state.close_dialogs();
            state.export.asked += 1;
            state.export.still = asked.map(|asked| (asked, state.export.asked));
        }
        ExportCommand::ImportOverHand(over_drawn) => {
            if let Some(form) = &mut state.export.importing {
                form.over_drawn = over_drawn;
            }
        }
        ExportCommand::Import => import(state, effects),
        ExportCommand::Place(output) => effects.push(Effect::Ui(UiRequest::Pick(Purpose::Output(output)))),
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
    let run = move |_: &Access, cx: &JobCx| {
        let from = std::path::absolute(&setup.from).unwrap_or_else(|_| setup.from.clone());
        import_masks(&source.dataset, &ImportSetup { from, ..setup }, cx)
    };
    tasks::start(state, Start::new(TaskKind::Import, TaskKind::Import.name()), effects, run, imported);
}

fn write(state: &mut State, output: Output, file: PathBuf, effects: &mut Vec<Effect>) {
    match output {
        Output::Masks => {
            let Some(source) = state.library.open.as_ref().map(|open| open.source.clone()) else { return };
            state.export.asking_masks = false;
            let (labels, choice) = (state.document.finished_labels(), state.export.masks);
            let job = (Worker::Compute, "Export masks", "Export masks");
            tasks::write(state, job, file, effects, move |folder, _, cx| {
                let setup = ExportSetup { pairs: None, choice };
                let masks = DrawnMasks { labels: &Labels::of(&source.dataset), changed: &labels };
                let (plan, _) = export_masks(&source.dataset, &masks, &setup, &folder, None, cx)?;
                Ok((format!("Exported to {}: {}", folder.display(), plan.lines().join("; ")), folder))
            });
        }
        Output::Pair(source) => {
            let Some(pair) = pair_export(state, source) else {
                let err = TaskError::new("Export the pair", format!("it has no {} points", source.key()));
                return state.log.error(&err.with_hint("Show it in 3D first."));
            };
            let job = (Worker::Compute, "Export the pair", "Export the pair");
            tasks::write(state, job, file, effects, move |folder, _, _| {
                let files = pair.write(&folder)?;
                let names = files.iter().filter_map(|file| file.file_name()).map(|name| name.to_string_lossy());
                let text = format!("Saved {}", names.collect::<Vec<_>>().join(", "));
                Ok((text, files.into_iter().next().unwrap_or_default()))
            });
        }
        Output::Still(asked) => {
            state.export.still = None;
            let Some((setup, open)) = still_setup(state, asked).zip(state.library.open.as_ref()) else { return };
            let source = open.source.clone();
            let png = asked.turntable.is_none() && file.extension().is_none();
            let file = if png { file.with_extension("png") } else { file };
            let job = (Worker::Models, "Still", "Draw the still");
            tasks::write(state, job, file, effects, move |file, access, cx| {
                let done = still(&source.dataset, &setup, &access.services.models, spatial::still, &file, cx)?;
                let ([width, height], count) = (done.size_px, done.files.len());
                let frames = if count == 1 { String::new() } else { format!("{count} frames of ") };
                Ok((format!("Saved {} ({frames}{width} x {height} pixels)", file.display()), file))
            });
        }
    }
}

/// The export of the selected pair for other programs, gathered for a job.
#[derive(Clone, Debug)]
pub struct PairExport {
    name: String,
    source: ImprintSource,
    prediction: Option<String>,
    rig: Arc<Rig>,
    estimate: Arc<Estimate>,
    registration: Registration,
    /// True where it has a pose.
    posed: bool,
    truth: Option<PlanarPose>,
    tool: Option<Arc<LoadedTool>>,
}

impl PairExport {
    /// Writes the files that there can be: without a pose only the cloud.
    ///
    /// # Errors
    /// As [`pair_files::write`].
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, TaskError> {
        let parts = PairParts {
            name: &self.name,
            source: self.source,
            prediction: self.prediction.as_deref(),
            rig: &self.rig,
            clouds: self.estimate.surface(),
            mask: &self.estimate.contact().made_of(),
            registration: self.registration,
            pose: if self.posed { self.estimate.pose().ok() } else { None },
            truth: self.truth,
            tool: self.tool.as_ref().map(|tool| (tool.name.as_str(), &tool.model)),
        };
        pair_files::write(&parts, folder)
    }
}

/// The export of the selected pair; `None` while its cloud is not there.
pub fn pair_export(state: &State, source: ImprintSource) -> Option<PairExport> {
    let cloud = results::cloud_key(state, source).ok()??;
    let posed = results::pose_key(state, source).ok().flatten();
    let posed = posed.filter(|key| results::pose_of(state, key).is_some());
    let recipe =
        state.rig().pads().find_map(|pad| results::chosen(state, pad)).filter(|_| source == ImprintSource::Predicted);
    let prediction =
        recipe.map(|made| predicted_by(state.library.model_name(&made.bundle), &made.config, state.settings.shift));
    Some(PairExport {
        name: state.pair_name().to_owned(),
        source,
        prediction,
        rig: state.rig(),
        posed: posed.is_some(),
        estimate: state.results.estimates.get(&posed.unwrap_or(cloud))?.clone(),
        registration: state.settings.registration,
        truth: results::sample(state).ready()?.grasp_from_object,
        tool: results::tool_key(state).ok().and_then(|key| state.results.tools.get(&key)).cloned(),
    })
}

/// True where the selected pair can be drawn in 3D.
pub(crate) fn can_draw(state: &State) -> bool {
    state.entry().is_some()
}

/// Masks were taken over.
pub fn imported(import: &Import, state: &mut State, _: &mut Vec<Effect>) {
    reread(state, &import.changed);
    let level = if import.complete { Level::Info } else { Level::Warning };
    state.log.push(level, import.text(), None, None);
    if import.total() > 0 {
        state.log.place_last(import.labels.clone());
    }
}

/// Has labels that were changed on the disk read again. What was done to them is in their journals, so that undo takes it
/// back too.
fn reread(state: &mut State, names: &[String]) {
    for name in names {
        let doc = &mut state.document;
        let drawn_on = doc.stroke.as_ref().is_some_and(|stroke| stroke.pair == *name);
        // What is on its way to the disk is merged there, and comes back merged.
        if drawn_on || doc.unsaved.contains(name) {
            continue;
        }
        doc.reread(name);
        state.history.forget(name);
    }
}
