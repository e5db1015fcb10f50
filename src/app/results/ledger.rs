//! The depth chain of a prediction, stage by stage.

use super::super::jobs::{Job, Lane};
use super::super::keys::LedgerKey;
use super::super::pane::Demand;
use super::super::results;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::rig::PadId;
use touch2touch_work::ledger::{LedgerResult, of_prediction};
use touch2touch_work::on_pad::OnPad;

impl Computes for LedgerKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<LedgerResult>> {
        let Self(recipe, shift) = self.clone();
        let prediction = state.results.predictions.get(&recipe)?.clone();
        let sample = state.results.samples.get(&recipe.touch.pair)?.clone();
        Some(Job::new(Lane::Compute, "Depth chain", move |_| {
            of_prediction(&prediction, shift, false, OnPad { sample: &sample, pad: recipe.touch.finger })
        }))
    }

    fn wanted(wants: &mut Demands<'_>) {
        let state = wants.state;
        let Some(touch) = state.touch_key(state.selection.finger).filter(|_| state.needs(Demand::Ledger)) else {
            return;
        };
        let Some(recipe) = results::shown(state, touch) else { return };
        let there = state.results.samples.contains(&touch.pair) && state.results.predictions.contains(recipe);
        if there && !state.library.predicts_color(&recipe.bundle) {
            wants.ask(LedgerKey(recipe.clone(), state.settings.shift));
        }
    }
}

/// The depth chain of the prediction shown for one finger.
pub fn ledger(state: &State, finger: PadId) -> Lookup<'_, LedgerResult> {
    let Some(recipe) = results::chosen(state, finger) else {
        return results::touch(state, finger).and_then(Absent::NoPrediction, |_| None);
    };
    if state.library.predicts_color(&recipe.bundle) {
        return Lookup::Absent(Absent::PredictsColor);
    }
    state.look(LedgerKey(recipe.clone(), state.settings.shift)).value()
}
