//! The prediction shown for each touch: that of the settings in force, else an earlier one, which says so.

use super::super::keys::{EstimateKey, ImprintKey, ImprintSource, PictureKey, PredictionKey, TouchKey};
use super::super::recipe;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::PadId;

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
            let felt = sample.and_then(Absent::NoFinger, |sample| sample.pad(touch.finger));
            felt.and_then(Absent::NoBubble, |felt| Some(&felt.depth()?.imprint))
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
