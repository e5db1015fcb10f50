//! The depth chain of a prediction, stage by stage.

use super::super::keys::ShiftMode;
use super::prediction::PredictionKey;
use super::{Absent, Computes, Demands, Job, Lane, Lookup, SharedServices, State, TouchKey};
use touch2touch_core::rig::PadId;
use touch2touch_work::ledger::{LedgerResult, of_prediction};
use touch2touch_work::on_pad::OnPad;

/// The depth chain of a prediction.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LedgerKey(pub PredictionKey, pub ShiftMode);

impl Computes for LedgerKey {
    type Value = LedgerResult;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<LedgerResult>> {
        let Self(recipe, shift) = self.clone();
        let prediction = state.results.predictions.get(&recipe)?.clone();
        let sample = state.results.samples.get(&recipe.touch.pair)?.clone();
        Some(Job::new(Lane::Compute, "Depth chain", move |_| {
            of_prediction(&prediction, shift, false, OnPad { sample: &sample, pad: recipe.touch.finger })
        }))
    }

    fn bytes(found: &LedgerResult) -> usize {
        found.ledger.bytes()
    }
}

impl State {
    /// The depth chain of the prediction shown for one finger.
    pub fn ledger(&self, finger: PadId) -> Lookup<'_, LedgerResult> {
        let Some(recipe) = self.chosen(finger) else {
            return self.touch(finger).and_then(Absent::NoPrediction, |_| None);
        };
        if self.is_color(recipe) {
            return Lookup::Absent(Absent::PredictsColor);
        }
        self.look(LedgerKey(recipe.clone(), self.settings.shift)).value()
    }
}

impl Demands<'_> {
    pub(crate) fn ledger(&mut self, touch: TouchKey) {
        let state = self.state;
        let Some(recipe) = state.shown(touch) else { return };
        let there = state.results.samples.contains(&touch.pair) && state.results.predictions.contains(recipe);
        if there && !state.is_color(recipe) {
            self.ask(LedgerKey(recipe.clone(), state.settings.shift));
        }
    }
}
