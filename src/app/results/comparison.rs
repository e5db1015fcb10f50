//! A prediction against the measurement.

use super::super::keys::ShiftMode;
use super::imprint::{Imprint, MetersKey};
use super::prediction::PredictionKey;
use super::{Absent, Computes, ImprintSource, Job, Lane, Lookup, SharedServices, State, TouchKey, Wanted};
use crate::domain::rig::PadId;
use crate::work::compare::{Comparison, compare_parts};

/// A prediction in meters, compared.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ComparisonKey(pub PredictionKey, pub ShiftMode);

impl Computes for ComparisonKey {
    type Value = Comparison;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Comparison>> {
        let touch = self.0.touch;
        let predicted = state.results.imprints.get(&MetersKey(self.0.clone(), self.1))?.clone();
        let sample = state.results.samples.get(&touch.pair)?.clone();
        let measured = Imprint::Measured(sample.clone(), touch);
        Some(Job::new(Lane::Compute, "Compare prediction and measurement", move |_| {
            let measured = measured.get()?;
            let seen = sample.rig.seen_mask(touch.finger, measured.size());
            compare_parts(&predicted, measured, sample.scale, seen.as_ref())
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
