//! What the panes show of the depth chain, and of what a GelSlim image leaves open.

use super::super::keys::{Request, TouchKey};
use super::super::state::{Absent, Lookup, State};
use super::Wanted;
use crate::domain::ambiguity::Ambiguity;
use crate::domain::rig::PadId;
use crate::work::ledger::LedgerResult;

impl State {
    /// The depth chain of the prediction shown for one finger.
    pub fn ledger(&self, finger: PadId) -> Lookup<'_, LedgerResult> {
        let Some(recipe) = self.chosen(finger) else {
            return self.touch(finger).and_then(Absent::NoPrediction, |_| None);
        };
        if self.is_color(recipe) {
            return Lookup::Absent(Absent::PredictsColor);
        }
        let key = (recipe.clone(), self.settings.shift);
        match self.results.ledgers.get(&key) {
            Some(ledger) => Lookup::Ready(ledger),
            None => self.missing(&Request::Ledger(key.0, key.1)),
        }
    }

    /// What the GelSlim image of one finger leaves open, once it is known.
    pub fn ambiguity(&self, finger: PadId) -> Option<Ambiguity> {
        **self.results.ambiguities.get(&self.touch_key(finger)?)?
    }
}

impl Wanted<'_> {
    pub(super) fn ambiguity(&mut self, finger: PadId, touch: TouchKey) {
        if self.state.gelslim(finger).ready().is_some() {
            self.ask(self.state.results.ambiguities.contains(&touch), Request::Ambiguity(touch));
        }
    }

    pub(super) fn ledger(&mut self, touch: TouchKey) {
        let state = self.state;
        let Some(recipe) = state.results.chosen.get(&touch) else { return };
        let there = state.results.samples.contains(&touch.pair) && state.results.predictions.contains(recipe);
        if there && !state.is_color(recipe) {
            let key = (recipe.clone(), state.settings.shift);
            self.ask(state.results.ledgers.contains(&key), Request::Ledger(key.0, key.1));
        }
    }
}
