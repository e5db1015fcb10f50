//! Masks taken over from files of other programs.

use std::sync::Arc;

use super::super::effect::{Access, Effect, Task};
use super::super::source::Source;
use super::super::state::State;
use super::super::state::tasks::{Level, TaskKind};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::import::{Import, ImportSetup, import_masks};
use touch2touch_pipeline::job::JobCx;

/// Takes masks over that lie in a form of other programs.
pub struct ImportMasks {
    pub(in crate::app) source: Arc<Source>,
    pub(in crate::app) setup: ImportSetup,
}

impl Task for ImportMasks {
    type End = Import;
    const KIND: TaskKind = TaskKind::Import;

    fn run(self, _: &Access, cx: &JobCx) -> Result<Import, TaskError> {
        let Self { source, mut setup } = self;
        setup.from = std::path::absolute(&setup.from).unwrap_or(setup.from);
        import_masks(&source.dataset, &setup, cx)
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
