//! Proposals for all pairs of the list at once.

use std::sync::Arc;

use super::super::effect::{Access, Effect, Errand};
use super::super::source::DataSource;
use super::super::state::State;
use super::super::state::tasks::{Level, TaskKind};
use super::super::{recipe, results, tasks};
use super::end_stroke;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::import::{Import, ImportSetup, import_masks};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::masks::propose::{self, Batch, BatchSetup, ProposeSetup};
use touch2touch_pipeline::steps::bundles::BundleKind;

/// Starts it.
pub(super) fn propose_all(state: &mut State, effects: &mut Vec<Effect>) {
    end_stroke(state, effects);
    let Some(open) = state.library.open.as_ref().filter(|_| can_propose_all(state)) else { return };
    let (source, setup) = (open.source.clone(), batch_setup(state));
    let title = format!("Propose masks for {} pairs", setup.pairs.len());
    tasks::start(state, title, ProposeAll { source, setup }, effects);
}

/// Proposes masks for many pairs, and stores them.
pub struct ProposeAll {
    source: Arc<dyn DataSource>,
    setup: BatchSetup,
}

impl Errand for ProposeAll {
    type End = Batch;
    const KIND: TaskKind = TaskKind::Propose;

    fn run(self, access: &Access, cx: &JobCx) -> Result<Batch, TaskError> {
        let dataset = self.source.on_disk(Self::KIND.name())?;
        propose::propose_all(dataset, &self.setup, access.services.models(), cx)
    }

    fn ended(batch: &Batch, state: &mut State, _: &mut Vec<Effect>) {
        reread(state, &batch.changed);
        state.selection.proposing &= batch.masks == 0;
        let level = if batch.left_out.is_empty() { Level::Info } else { Level::Warning };
        let why = batch.left_out.first().map(|first| format!("the first: {}: {}", first.name, first.why));
        state.log.push(level, batch.text(), why, None);
    }
}

/// Takes masks over that lie in a form of other programs.
pub struct ImportMasks {
    pub(in crate::app) source: Arc<dyn DataSource>,
    pub(in crate::app) setup: ImportSetup,
}

impl Errand for ImportMasks {
    type End = Import;
    const KIND: TaskKind = TaskKind::Import;

    fn run(self, _: &Access, cx: &JobCx) -> Result<Import, TaskError> {
        let Self { source, mut setup } = self;
        let dataset = source.on_disk(Self::KIND.name())?;
        setup.from = std::path::absolute(&setup.from).unwrap_or(setup.from);
        import_masks(dataset, &setup, cx)
    }

    fn ended(import: &Import, state: &mut State, _: &mut Vec<Effect>) {
        reread(state, &import.changed);
        let level = if import.complete { Level::Info } else { Level::Warning };
        state.log.push(level, import.text(), None, None);
        if import.total() > 0 {
            state.log.place_last(import.labels.clone());
        }
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

/// True where masks can be proposed for the listed pairs.
pub(crate) fn can_propose_all(state: &State) -> bool {
    let predicts = results::worked_on(state, state.selection.finger) == ImprintSource::Predicted;
    let has_model = !predicts || recipe::bundle(state, BundleKind::Generator).is_ok();
    !state.library.order.is_empty() && has_model && state.tasks.of_kind(TaskKind::Propose).is_none()
}

/// The setup of proposing masks for the listed pairs.
fn batch_setup(state: &State) -> BatchSetup {
    let imprint = results::worked_on(state, state.selection.finger);
    let mask = &state.settings.mask;
    let recipe = recipe::in_force(state, imprint);
    BatchSetup {
        propose: ProposeSetup { source: mask.proposal, recipe, pose: None },
        pairs: state.library.order.clone(),
        over_drawn: mask.over_drawn,
        person: state.settings.known_labeler(),
    }
}
