//! A prediction against the measurement: one pair of imprints among those that can be compared.

use super::versus::VersusKey;
use super::{Absent, Demands, ImprintSource, Lookup, State, TouchKey};
use touch2touch_core::rig::PadId;
use touch2touch_work::compare::Comparison;

impl State {
    /// Prediction against measurement of one finger.
    pub fn comparison(&self, finger: PadId) -> Lookup<'_, Comparison> {
        let Some(recipe) = self.chosen(finger) else {
            return self.sample().and_then(Absent::NoPrediction, |_| None);
        };
        if self.is_color(recipe) {
            return Lookup::Absent(Absent::PredictsColor);
        }
        if self.bubble(finger).ready().is_none() {
            return self.bubble(finger).without();
        }
        self.look(VersusKey::measured(recipe.clone(), self.settings.shift)).value()
    }
}

impl Demands<'_> {
    pub(crate) fn comparison(&mut self, finger: PadId, touch: TouchKey) {
        let state = self.state;
        let Some(recipe) = state.shown(touch) else { return };
        let there = |source| state.imprint(source, finger).ready().is_some();
        if there(ImprintSource::Measured) && there(ImprintSource::Predicted) {
            self.ask(VersusKey::measured(recipe.clone(), state.settings.shift));
        }
    }
}
