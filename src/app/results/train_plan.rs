//! What a training of the mask model would learn from.

use super::super::keys::{DatasetSeq, Revision};
use super::super::pane::Demand;
use super::super::state::tasks::TaskKind;
use super::{Computes, Demands, Job, Lane, SharedServices, State};
use touch2touch_work::error::TaskError;
use touch2touch_work::export::DrawnMasks;
use touch2touch_work::labels::Labels;
use touch2touch_work::train::{TrainChoice, TrainPlan, plan};

/// The plan of a training, on what is drawn and marked now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TrainPlanKey {
    /// The data set.
    pub dataset: DatasetSeq,
    /// How it is divided.
    pub choice: TrainChoice,
    /// The last change of the document.
    pub revision: Revision,
}

impl Computes for TrainPlanKey {
    type Value = TrainPlan;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<TrainPlan>> {
        let source = state.library.open.as_ref()?.source.clone();
        let (changed, choice) = (state.document.labels.clone(), self.choice);
        Some(Job::new(Lane::Files, "Plan of a training", move |_| {
            let dataset = source.on_disk("Plan of a training")?;
            plan(dataset, &DrawnMasks { labels: &Labels::of(dataset), changed: &changed }, choice)
        }))
    }

    fn bytes(plan: &TrainPlan) -> usize {
        (plan.masks() + plan.held_out[0]) * 256
    }

    /// The pane says it.
    fn failed(&self, _: &mut State, _: &TaskError) -> bool {
        false
    }
}

impl State {
    /// The plan of the training that the pane describes.
    pub(crate) fn train_plan_key(&self) -> Option<TrainPlanKey> {
        let open = self.library.open.as_ref()?;
        let revision = Revision(self.document.last_revision);
        Some(TrainPlanKey { dataset: open.seq, choice: self.train.form.choice, revision })
    }
}

impl Demands<'_> {
    pub(crate) fn train_plan(&mut self) {
        let state = self.state;
        if !state.needs(Demand::Training) || state.document.stroke.is_some() || state.running(TaskKind::Train).is_some()
        {
            return;
        }
        if let Some(key) = state.train_plan_key() {
            self.ask(key);
        }
    }
}
