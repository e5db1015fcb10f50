//! A prediction against the measurement: one pair of imprints among those that can be compared.

use super::super::keys::{ImprintSource, TouchKey, VersusKey};
use super::super::results;
use super::super::results::Demands;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::compare::Comparison;

/// Prediction against measurement of one finger.
pub fn comparison(state: &State, finger: PadId) -> Lookup<'_, Comparison> {
    let Some(recipe) = results::chosen(state, finger) else {
        return results::sample(state).and_then(Absent::NoPrediction, |_| None);
    };
    if state.library.predicts_color(&recipe.bundle) {
        return Lookup::Absent(Absent::PredictsColor);
    }
    if results::bubble(state, finger).ready().is_none() {
        return results::bubble(state, finger).without();
    }
    state.look(VersusKey::measured(recipe.clone(), state.settings.shift)).value()
}

pub(crate) fn want_comparison(wants: &mut Demands<'_>, finger: PadId, touch: TouchKey) {
    let state = wants.state;
    let Some(recipe) = results::shown(state, touch) else { return };
    let there = |source| results::imprint(state, source, finger).ready().is_some();
    if there(ImprintSource::Measured) && there(ImprintSource::Predicted) {
        wants.ask(VersusKey::measured(recipe.clone(), state.settings.shift));
    }
}
