//! Imprints: those measured lie in the sample, those predicted are made of a raw prediction; and which prediction is
//! shown of each touch.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::{
    ColorKey, EstimateKey, FlagsKey, ImprintKey, ImprintSource, PictureKey, PredictionKey, TouchKey,
};
use super::super::pane::Demand;
use super::super::recipe;
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

/// The imprint whose mask the clean-ups work on: the one chosen, else the one that is there.
pub fn worked_on(state: &State, finger: PadId) -> ImprintSource {
    let chosen = state.selection.imprint;
    let is_there = |source: &ImprintSource| {
        imprint_key(state, *source, finger).is_ok_and(|key| imprint_of(state, &key).ready().is_some())
    };
    [chosen, chosen.other()].into_iter().find(is_there).unwrap_or(chosen)
}

/// The recipe of the imprint shown for one finger.
///
/// # Errors
/// Why there is none.
pub fn imprint_key(state: &State, source: ImprintSource, finger: PadId) -> Result<ImprintKey, Absent> {
    let touch = state.touch_key(finger).ok_or(Absent::NothingSelected)?;
    match source {
        ImprintSource::Measured => Ok(ImprintKey::Measured(touch)),
        ImprintSource::Predicted => {
            let recipe = shown(state, touch).ok_or(Absent::NoPrediction)?;
            if state.library.predicts_color(&recipe.bundle) {
                return Err(Absent::PredictsColor);
            }
            Ok(ImprintKey::Predicted(recipe.clone(), state.settings.shift))
        }
    }
}

/// An imprint by its recipe, meters, raw bubble orientation.
pub(crate) fn imprint_of<'a>(state: &'a State, key: &ImprintKey) -> Lookup<'a, DepthMap> {
    match key {
        ImprintKey::Measured(touch) => {
            let sample = state.look(touch.pair).value();
            let touch = sample.and_then(Absent::NoFinger, |sample| sample.pad(touch.finger));
            touch.and_then(Absent::NoBubble, |touch| Some(&touch.depth()?.imprint))
        }
        ImprintKey::Predicted(recipe, _) => {
            let made = state.look(EstimateKey::imprint(key));
            made.and_then(Absent::NoPrediction, |made| made.imprints[recipe.touch.finger].as_ref())
        }
        ImprintKey::Mean(key) => state.look(key.clone()).value(),
        ImprintKey::Picture(touch) => state.look(PictureKey(*touch)).map(|found| &found.imprint),
    }
}

/// The prediction shown for a touch, if one was made: the one picked among them under these settings, else the one
/// that the settings name, else the last.
pub fn shown(state: &State, touch: TouchKey) -> Option<&PredictionKey> {
    let made = state.results.made.get(&touch)?;
    if let Some(picked) = picked(state, touch) {
        return Some(picked);
    }
    let named = recipe::prediction(state, touch);
    let named = made.iter().find(|recipe| Some(*recipe) == named.as_ref());
    named.or_else(|| state.results.shown.last(touch)).filter(|recipe| state.results.predictions.contains(recipe))
}

/// The prediction that a person picked under the settings in force.
pub(crate) fn picked(state: &State, touch: TouchKey) -> Option<&PredictionKey> {
    let picked = state.results.shown.picked(touch, recipe::prediction(state, touch).as_ref())?;
    state.results.predictions.contains(picked).then_some(picked)
}

/// The prediction shown for one finger of the selected pair, if one was made.
pub fn chosen(state: &State, finger: PadId) -> Option<&PredictionKey> {
    shown(state, state.touch_key(finger)?)
}

/// Shows a prediction of those made until another setting asks for something else.
pub(crate) fn pick(state: &mut State, recipe: PredictionKey) {
    let named = recipe::prediction(state, recipe.touch);
    state.results.shown.pick(recipe, named);
}

/// Why a prediction is shown that the settings in force would not make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// A person picked it under these settings.
    Picked,
    /// The prediction that the settings ask for is on its way.
    OnItsWay,
    /// The prediction that the settings ask for was not made.
    NotMade,
}

/// Why a prediction is shown for a finger that the settings in force would not make; `None` where they would.
pub fn outdated(state: &State, finger: PadId) -> Option<Why> {
    let touch = state.touch_key(finger)?;
    let shown = results::shown(state, touch)?;
    let named = recipe::prediction(state, touch);
    if named.as_ref() == Some(shown) {
        return None;
    }
    let generating = || named.as_ref().is_some_and(|named| state.tasks.generating(named).is_some());
    Some(if results::picked(state, touch).is_some() {
        Why::Picked
    } else if generating() || results::prefetch(state, finger).is_some() {
        Why::OnItsWay
    } else {
        Why::NotMade
    })
}
