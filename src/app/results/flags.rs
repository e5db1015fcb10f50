//! Flags: implausible things about the way of a prediction to meters.

use super::super::jobs::{Job, Lane};
use super::super::keys::FlagsKey;
use super::super::pane::Demand;
use super::super::results;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::postprocess::Flag;
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::steps::imprint::flags_of;

impl Computes for FlagsKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Vec<Flag>>> {
        let Self(recipe, shift) = self.clone();
        let prediction = state.results.predictions.get(&recipe)?.clone();
        let sample = state.results.samples.get(&recipe.touch.pair)?.clone();
        Some(Job::new(Lane::Compute, "Depth chain", move |_| {
            flags_of(&prediction, shift, &sample, recipe.touch.finger)
        }))
    }

    fn wanted(wants: &mut Demands<'_>) {
        let state = wants.state;
        let Some(touch) = state.touch_key(state.selection.finger).filter(|_| state.needs(Demand::Flags)) else {
            return;
        };
        let Some(recipe) = results::shown(state, touch) else { return };
        let there = state.results.samples.contains(&touch.pair) && state.results.predictions.contains(recipe);
        if there && !state.library.predicts_color(&recipe.bundle) {
            wants.ask(FlagsKey(recipe.clone(), state.settings.shift));
        }
    }
}

/// Everything implausible about the way to meters of the prediction shown for one finger, the worst first.
pub fn flags(state: &State, finger: PadId) -> Lookup<'_, Vec<Flag>> {
    let Some(recipe) = results::chosen(state, finger) else {
        return results::touch(state, finger).and_then(Absent::NoPrediction, |_| None);
    };
    if state.library.predicts_color(&recipe.bundle) {
        return Lookup::Absent(Absent::PredictsColor);
    }
    state.look(FlagsKey(recipe.clone(), state.settings.shift)).value()
}
