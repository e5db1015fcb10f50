//! The plan of an export of masks: what it would write where.

use super::super::jobs::{Job, Lane};
use super::super::keys::{MaskPlanKey, Revision};
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::State;
use touch2touch_pipeline::export::Plan;

impl Computes for MaskPlanKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Plan>> {
        let source = state.library.open.as_ref()?.source.clone();
        let (changed, choice) = (state.document.finished_labels(), self.choice);
        Some(Job::new(Lane::Files, "Plan of an export", move |_| source.plan_masks(&changed, choice)))
    }

    /// The form says it.
    fn failed(&self, _: &mut State, _: &touch2touch_pipeline::error::TaskError) -> bool {
        false
    }
}

/// The plan of the export that the form describes, while the form is open.
pub fn mask_plan_key(state: &State) -> Option<MaskPlanKey> {
    let open = state.library.open.as_ref().filter(|_| state.export.asking_masks)?;
    let revision = Revision(state.document.last_revision);
    Some(MaskPlanKey { dataset: open.seq, choice: state.export.masks, revision })
}

pub(crate) fn want_mask_plan(wants: &mut Demands<'_>) {
    if let Some(key) = mask_plan_key(wants.state).filter(|_| wants.state.document.stroke.is_none()) {
        wants.ask(key);
    }
}
