//! What an export of masks would write where.

use super::super::keys::{DatasetSeq, Revision};
use super::{Computes, Demands, Job, Lane, SharedServices, State};
use touch2touch_work::export::{ExportChoice, Plan};

/// The plan of an export, of what is drawn and marked now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaskPlanKey {
    /// The data set.
    pub dataset: DatasetSeq,
    /// What is asked for.
    pub choice: ExportChoice,
    /// The last change of the document.
    pub revision: Revision,
}

impl Computes for MaskPlanKey {
    type Value = Plan;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Plan>> {
        let source = state.library.open.as_ref()?.source.clone();
        let (changed, choice) = (state.document.own_labels(), self.choice);
        Some(Job::new(Lane::Files, "Plan of an export", move |_| source.plan_masks(&changed, choice)))
    }

    fn bytes(plan: &Plan) -> usize {
        plan.total() * 128
    }

    /// The form says it.
    fn failed(&self, _: &mut State, _: &touch2touch_work::error::TaskError) -> bool {
        false
    }
}

impl State {
    /// The plan of the export that the form describes, while the form is open.
    pub fn mask_plan_key(&self) -> Option<MaskPlanKey> {
        let open = self.library.open.as_ref().filter(|_| self.export.asking_masks)?;
        let revision = Revision(self.document.last_revision);
        Some(MaskPlanKey { dataset: open.seq, choice: self.export.masks, revision })
    }
}

impl Demands<'_> {
    pub(crate) fn mask_plan(&mut self) {
        if let Some(key) = self.state.mask_plan_key().filter(|_| self.state.document.stroke.is_none()) {
            self.ask(key);
        }
    }
}
