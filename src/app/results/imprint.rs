//! Imprints: those measured lie in the sample, those predicted are made of a raw prediction.

use super::super::jobs::{Job, Lane};
use super::super::keys::{ColorKey, ImprintSource, MetersKey, PictureKey, TouchKey};
use super::super::results;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::compare::{Beside, beside};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::steps::imprint;

impl Computes for MetersKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<DepthMap>> {
        let Self(recipe, shift) = self;
        let prediction = state.results.predictions.get(recipe)?.clone();
        let sample = state.results.samples.get(&recipe.touch.pair)?.clone();
        let (shift, finger) = (*shift, recipe.touch.finger);
        Some(Job::new(Lane::Compute, "Prediction in meters", move |_| {
            imprint::imprint_of(&prediction, shift, &sample, finger)
        }))
    }
}

impl Computes for ColorKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<RgbGrid>> {
        let prediction = state.results.predictions.get(&self.0)?.clone();
        Some(Job::new(Lane::Compute, "Predicted color picture", move |_| {
            imprint::color(&prediction, [0, 0])?.ok_or_else(gone)
        }))
    }
}

impl Computes for PictureKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Beside>> {
        let pair = self.0.pair;
        let source = state.library.open.as_ref()?.source.clone();
        let sample = state.results.samples.get(&pair)?.clone();
        Some(Job::new(Lane::Files, "Stored picture", move |_| {
            let dataset = source.as_dataset().ok_or_else(gone)?;
            beside(dataset, pair.pair, &sample)?.ok_or_else(|| {
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

/// An input of a job that was there when it was prepared: a defect if it ever shows.
pub(crate) fn gone() -> TaskError {
    TaskError::new("Compute", "the measured imprint is not there")
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
        Some(false) => wants.ask(MetersKey(recipe, state.settings.shift)),
        None => {}
    }
}
