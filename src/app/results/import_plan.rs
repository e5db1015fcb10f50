//! What an import of masks would change.

use super::super::keys::{DatasetSeq, Revision};
use super::super::state::export::ImportForm;
use super::{Computes, Demands, Job, Lane, SharedServices, State};
use touch2touch_work::error::TaskError;
use touch2touch_work::import::{Import, plan_import};

/// The plan of an import, over what is drawn and marked now.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImportPlanKey {
    /// The data set.
    pub dataset: DatasetSeq,
    /// What is asked about.
    pub form: ImportForm,
    /// The last change of the document.
    pub revision: Revision,
}

impl Computes for ImportPlanKey {
    type Value = Import;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Import>> {
        let source = state.library.open.as_ref()?.source.clone();
        let setup = state.import_setup()?;
        Some(Job::new(Lane::Files, "Plan of an import", move |cx| {
            plan_import(source.on_disk("Plan of an import")?, &setup, cx)
        }))
    }

    fn bytes(plan: &Import) -> usize {
        (plan.changed.len() + plan.unmatched.len() + plan.refused.len()) * 128
    }

    /// The form says it.
    fn failed(&self, _: &mut State, _: &TaskError) -> bool {
        false
    }
}

impl State {
    /// The plan of the import that the form describes, while the form is open.
    pub fn import_plan_key(&self) -> Option<ImportPlanKey> {
        let (open, form) = (self.library.open.as_ref()?, self.export.importing.clone()?);
        Some(ImportPlanKey { dataset: open.seq, form, revision: Revision(self.document.last_revision) })
    }
}

impl Demands<'_> {
    pub(crate) fn import_plan(&mut self) {
        // Over what is on the disk: a stroke must have come there first.
        let at_rest = self.state.document.stroke.is_none() && self.state.document.unsaved.is_empty();
        if let Some(key) = self.state.import_plan_key().filter(|_| at_rest) {
            self.ask(key);
        }
    }
}
