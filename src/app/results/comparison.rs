//! A prediction against the measurement.

use super::super::keys::ShiftMode;
use super::imprint::MetersKey;
use super::prediction::PredictionKey;
use super::{Absent, Computes, ImprintSource, Job, Lane, Lookup, SharedServices, State, TouchKey, Wanted};
use crate::domain::rig::PadId;
use crate::work::compare::{Comparison, of_pad, tile_of};
use crate::work::error::TaskError;

/// A prediction in meters, compared.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ComparisonKey(pub PredictionKey, pub ShiftMode);

impl Computes for ComparisonKey {
    type Value = Comparison;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Comparison>> {
        let touch = self.0.touch;
        let predicted = state.results.imprints.get(&MetersKey(self.0.clone(), self.1))?.clone();
        let prediction = state.results.predictions.get(&self.0)?.clone();
        let shift = self.1;
        let sample = state.results.samples.get(&touch.pair)?.clone();
        let source = state.library.open.as_ref()?.source.clone();
        const WHAT: &str = "Compare prediction and measurement";
        Some(Job::new(Lane::Compute, WHAT, move |_| {
            let tile = match source.as_dataset() {
                Some(dataset) => tile_of(dataset, touch.pair.pair, &sample)?,
                None => None,
            };
            let found = of_pad(&predicted, Some((&prediction, shift)), &sample, touch.finger, tile.as_ref())?;
            found.ok_or_else(|| TaskError::new(WHAT, "the measured imprint is not there"))
        }))
    }

    fn bytes(comparison: &Comparison) -> usize {
        comparison.error.len() * 4
    }
}

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
        self.look(ComparisonKey(recipe.clone(), self.settings.shift)).value()
    }
}

impl Wanted<'_> {
    pub(crate) fn comparison(&mut self, finger: PadId, touch: TouchKey) {
        let state = self.state;
        let Some(recipe) = state.results.chosen.get(&touch) else { return };
        let there = |source| state.imprint(source, finger).ready().is_some();
        if there(ImprintSource::Measured) && there(ImprintSource::Predicted) {
            self.ask(ComparisonKey(recipe.clone(), state.settings.shift));
        }
    }
}
