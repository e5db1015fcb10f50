//! Proposals for all pairs of the list at once.

use super::super::effect::Effect;
use super::super::state::State;
use super::super::tasks::state::{Level, Task, Ticket};
use super::end_stroke;
use touch2touch_work::bundles::BundleKind;
use touch2touch_work::import::Import;
use touch2touch_work::labels::ImprintSource;
use touch2touch_work::propose::{Batch, BatchSetup, ProposeSetup};

impl State {
    /// Whether masks can be proposed for the listed pairs.
    pub fn can_propose_all(&self) -> bool {
        let predicts = self.worked_on(self.selection.finger) == ImprintSource::Predicted;
        let has_model = !predicts || self.bundle(BundleKind::Generator).is_ok();
        !self.library.order.is_empty() && has_model && self.batching().is_none()
    }

    /// What proposing masks for the listed pairs does.
    fn batch_setup(&self) -> BatchSetup {
        let imprint = self.worked_on(self.selection.finger);
        let mask = &self.settings.mask;
        let recipe = self.in_force(imprint);
        BatchSetup {
            propose: ProposeSetup { source: mask.proposal, recipe, pose: None, carry_from: None },
            pairs: self.library.order.clone(),
            over_hand: mask.over_hand,
            person: self.known_person(),
        }
    }

    /// The proposing for many pairs that is under way.
    pub fn batching(&self) -> Option<(Ticket, &Task)> {
        let ticket = self.document.batch?;
        Some((ticket, self.tasks.running.get(&ticket)?))
    }
}

/// Starts it.
pub(super) fn propose_all(state: &mut State, effects: &mut Vec<Effect>) {
    end_stroke(state, effects);
    let Some(open) = state.library.open.as_ref().filter(|_| state.can_propose_all()) else { return };
    let (source, setup) = (open.source.clone(), state.batch_setup());
    let ticket = state.tasks.start(format!("Propose masks for {} pairs", setup.pairs.len()), Vec::new());
    state.document.batch = Some(ticket);
    effects.push(Effect::ProposeAll { ticket, source, setup: Box::new(setup) });
}

/// Has the masks that were proposed read again where they are looked at, and says what became of them.
pub(in crate::app) fn proposed(state: &mut State, ticket: Ticket, batch: &Batch) {
    if state.document.batch.take_if(|running| *running == ticket).is_none() {
        return;
    }
    reread(state, &batch.changed);
    state.selection.proposing &= batch.masks == 0;
    let level = if batch.left_out.is_empty() { Level::Info } else { Level::Warning };
    let why = batch.left_out.first().map(|first| format!("the first: {}: {}", first.name, first.why));
    state.log.push(level, batch.text(), why, None);
}

/// Has the masks that were imported read again where they are looked at, and says what became of them.
pub(in crate::app) fn imported(state: &mut State, import: &Import) {
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
        if drawn_on || doc.unsaved.contains(name) || doc.repeats.contains_key(name) {
            continue;
        }
        doc.reread(name);
        state.history.forget(name);
    }
}
