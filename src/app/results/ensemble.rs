//! Mean and spreads of several predictions of one touch.

pub(crate) use super::imprint::EnsembleKey;
use super::imprint::MetersKey;
use super::prediction::PredictionKey;
use super::{Absent, Computes, Job, Lane, Lookup, SharedServices, State};
use touch2touch_core::rig::PadId;
use touch2touch_work::ensemble::{Ensemble, ensemble};
use touch2touch_work::on_pad::OnPad;

impl Computes for EnsembleKey {
    type Value = Ensemble;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Ensemble>> {
        let (results, shift) = (&state.results, self.shift);
        let meters = |recipe: &PredictionKey| results.imprints.get(&MetersKey(recipe.clone(), shift)).cloned();
        let predictions: Option<Vec<_>> = self.recipes.iter().map(|r| results.predictions.get(r).cloned()).collect();
        let imprints: Option<Vec<_>> = self.recipes.iter().map(meters).collect();
        let (predictions, imprints) = (predictions?, imprints?);
        let touch = self.touch;
        let sample = results.samples.get(&touch.pair)?.clone();
        Some(Job::new(Lane::Compute, "Spread of the seeds", move |_| {
            ensemble(&predictions, &imprints, shift, OnPad { sample: &sample, pad: touch.finger })
        }))
    }

    fn bytes(found: &Ensemble) -> usize {
        found.bytes()
    }
}

impl State {
    /// The ensemble of what is there of one finger; `None` before the first seed.
    pub(crate) fn ensemble_key(&self, finger: PadId) -> Option<EnsembleKey> {
        let there = |r: &PredictionKey| self.results.predictions.contains(r) && self.seed_imprint(r).is_some();
        let recipes: Vec<PredictionKey> = self.seed_recipes(finger).ok()?.into_iter().filter(there).collect();
        let touch = self.touch_key(finger)?;
        (!recipes.is_empty()).then_some(EnsembleKey { touch, recipes, shift: self.settings.shift })
    }

    /// Mean and spreads of the seeds that are there; the ensemble before while the next is computed.
    pub fn ensemble(&self, finger: PadId) -> Lookup<'_, Ensemble> {
        let Some(key) = self.ensemble_key(finger) else { return Lookup::Absent(Absent::NoPrediction) };
        let mut before = key.clone();
        let before = || {
            while before.recipes.len() > 1 {
                before.recipes.pop();
                if let Some(found) = self.results.ensembles.get(&before) {
                    return Some(found);
                }
            }
            None
        };
        self.look_or(Ok(Some(key)), before).value()
    }
}
