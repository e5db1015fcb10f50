//! Imprints: those measured lie in the sample, those predicted are made of a raw prediction.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::{ColorKey, EstimateKey, FlagsKey, ImprintKey, ImprintSource, PictureKey, TouchKey};
use super::super::pane::Demand;
use super::super::results::{self, Computes, Demands, gone};
use super::super::services::Services;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::postprocess::Flag;
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::compare::{Beside, beside};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::steps::imprint::{self, flags_of};

impl Computes for ColorKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<RgbGrid>> {
        let prediction = state.results.predictions.get(&self.0)?.clone();
        Some(Job::new(Worker::Compute, "Predicted color picture", move |_| {
            imprint::color(&prediction, [0, 0])?.ok_or_else(gone)
        }))
    }
}

impl Computes for PictureKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Beside>> {
        let pair = self.0.pair;
        let source = state.library.open.as_ref()?.source.clone();
        let sample = state.results.samples.get(&pair)?.clone();
        Some(Job::new(Worker::Files, "Stored picture", move |_| {
            beside(&source.dataset, pair.pair, &sample)?.ok_or_else(|| {
                let why = "no picture of another program's prediction lies beside this pair";
                TaskError::new("Stored picture", why)
                    .with_hint("It is read from NAME_vqvae.png beside NAME_bubble.png.")
            })
        }))
    }

    /// The pane says it in place of the picture.
    fn failed(&self, _: &mut State, _: &TaskError) -> bool {
        false
    }
}

/// The imprint shown for one finger, meters, raw bubble orientation.
pub fn imprint(state: &State, source: ImprintSource, finger: PadId) -> Lookup<'_, DepthMap> {
    match results::imprint_key(state, source, finger) {
        Ok(key) => results::imprint_of(state, &key),
        Err(Absent::NoPrediction) if results::prefetch(state, finger).is_some() => Lookup::Waiting,
        Err(absent) => Lookup::Absent(absent),
    }
}

/// The predicted color picture shown for one finger, where that is what the model predicts.
pub fn predicted_color(state: &State, finger: PadId) -> Option<Lookup<'_, RgbGrid>> {
    let recipe = results::chosen(state, finger).filter(|recipe| state.library.predicts_color(&recipe.bundle))?;
    Some(state.look(ColorKey(recipe.clone())).value())
}

pub(crate) fn want_imprint(wants: &mut Demands<'_>, finger: PadId, touch: TouchKey) {
    let state = wants.state;
    let Some(recipe) = results::shown(state, touch).cloned() else { return };
    // The sample says how large the bubble image is.
    if results::touch(state, finger).ready().is_none() {
        return;
    }
    match state.results.predictions.get(&recipe).map(|prediction| prediction.color.is_some()) {
        Some(true) => wants.ask(ColorKey(recipe)),
        Some(false) => wants.ask(EstimateKey::imprint(&ImprintKey::Predicted(recipe, state.settings.shift))),
        None => {}
    }
}

impl Computes for FlagsKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Vec<Flag>>> {
        let Self(recipe, shift) = self.clone();
        let prediction = state.results.predictions.get(&recipe)?.clone();
        let sample = state.results.samples.get(&recipe.touch.pair)?.clone();
        Some(Job::new(Worker::Compute, "Depth chain", move |_| {
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
