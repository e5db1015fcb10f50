//! The plan of an import of masks: what it would change.

use super::super::jobs::{Job, Lane};
use super::super::keys::{ImportPlanKey, Revision};
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::State;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::import::{Import, ImportSetup, plan_import};

impl Computes for ImportPlanKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Import>> {
        let source = state.library.open.as_ref()?.source.clone();
        let setup = import_setup(state)?;
        Some(Job::new(Lane::Files, "Plan of an import", move |cx| {
            plan_import(source.on_disk("Plan of an import")?, &setup, cx)
        }))
    }

    /// The form says it.
    fn failed(&self, _: &mut State, _: &TaskError) -> bool {
        false
    }
}

/// The plan of the import that the form describes, while the form is open.
pub fn import_plan_key(state: &State) -> Option<ImportPlanKey> {
    let (open, form) = (state.library.open.as_ref()?, state.export.importing.clone()?);
    Some(ImportPlanKey { dataset: open.seq, form, revision: Revision(state.document.last_revision) })
}

pub(crate) fn want_import_plan(wants: &mut Demands<'_>) {
    // Over what is on the disk: a stroke must have come there first.
    let at_rest = wants.state.document.stroke.is_none() && wants.state.document.unsaved.is_empty();
    if let Some(key) = import_plan_key(wants.state).filter(|_| at_rest) {
        wants.ask(key);
    }
}

/// The setup of the import that the form describes, while it is open.
pub(crate) fn import_setup(state: &State) -> Option<ImportSetup> {
    let form = state.export.importing.as_ref()?;
    let (from, over_drawn, person) = (form.from.clone(), form.over_drawn, state.settings.known_labeler());
    Some(ImportSetup { from, format: None, over_drawn, person })
}
