//! The plan of a training of the mask model: what it would learn from.

use super::super::jobs::{Job, Lane};
use super::super::keys::{Revision, TrainPlanKey};
use super::super::pane::Demand;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::State;
use super::super::state::learn::Network;
use super::super::state::tasks::TaskKind;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::DrawnMasks;
use touch2touch_pipeline::labels::Labels;
use touch2touch_pipeline::learn::train::{TrainPlan, plan};

impl Computes for TrainPlanKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<TrainPlan>> {
        let source = state.library.open.as_ref()?.source.clone();
        let (changed, choice) = (state.document.labels.clone(), self.choice);
        Some(Job::new(Lane::Files, "Plan of a training", move |_| {
            let dataset = source.on_disk("Plan of a training")?;
            plan(dataset, &DrawnMasks { labels: &Labels::of(dataset), changed: &changed }, choice)
        }))
    }

    /// The pane says it.
    fn failed(&self, _: &mut State, _: &TaskError) -> bool {
        false
    }
}

/// The plan of the training that the pane describes.
pub(crate) fn train_plan_key(state: &State) -> Option<TrainPlanKey> {
    let open = state.library.open.as_ref()?;
    let revision = Revision(state.document.last_revision);
    Some(TrainPlanKey { dataset: open.seq, choice: state.learn.form.choice, revision })
}

pub(crate) fn want_train_plan(wants: &mut Demands<'_>) {
    let state = wants.state;
    if !state.needs(Demand::Training)
        || state.learn.shown != Network::Masks
        || state.document.stroke.is_some()
        || state.tasks.of_kind(TaskKind::Learn).is_some()
    {
        return;
    }
    if let Some(key) = train_plan_key(state) {
        wants.ask(key);
    }
}
