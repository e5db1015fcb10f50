//! Imprints: those measured lie in the sample, those predicted are made of a raw prediction.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::{ColorKey, ImprintKey, ImprintSource, MetersKey, PictureKey, TouchKey};
use super::super::results;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::compare::Beside;
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

/// The imprint that a key names, as an input of jobs; `None` if it is not there.
pub(crate) fn imprint_input(state: &State, key: &ImprintKey) -> Option<Imprint> {
    Some(match key {
        ImprintKey::Measured(touch) => Imprint::Measured(state.results.samples.get(&touch.pair)?.clone(), *touch),
        ImprintKey::Predicted(recipe, shift) => {
            Imprint::Predicted(state.results.imprints.get(&MetersKey(recipe.clone(), *shift))?.clone())
        }
        ImprintKey::Mean(several) => Imprint::Predicted(state.results.means.get(several)?.clone()),
        ImprintKey::Picture(touch) => Imprint::Picture(state.results.pictures.get(&PictureKey(*touch))?.clone()),
    })
}

/// An imprint wherever it lies, as an input of jobs.
pub(crate) enum Imprint {
    Measured(Arc<Sample>, TouchKey),
    Predicted(Arc<DepthMap>),
    Picture(Arc<Beside>),
}

impl Imprint {
    /// The imprint, meters.
    ///
    /// # Errors
    /// Without a measurement, which was there when the job was prepared: a defect if it ever shows.
    pub(crate) fn get(&self) -> Result<&DepthMap, TaskError> {
        match self {
            Self::Measured(sample, touch) => {
                let bubble = sample.pad(touch.finger).and_then(|t| t.depth());
                bubble.map(|bubble| &bubble.imprint).ok_or_else(gone)
            }
            Self::Predicted(depth) => Ok(depth),
            Self::Picture(found) => Ok(&found.imprint),
        }
    }
}

/// An input of a job that was there when it was prepared: a defect if it ever shows.
pub(crate) fn gone() -> TaskError {
    TaskError::new("Compute", "the measured imprint is not there")
}

/// The imprint shown for one finger, meters, raw bubble orientation.
pub fn imprint(state: &State, source: ImprintSource, finger: PadId) -> Lookup<'_, DepthMap> {
    match results::imprint_key(state, source, finger) {
        Ok(key) => results::imprint_of(state, key),
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
