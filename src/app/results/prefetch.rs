//! Predictions of the pair on screen that nobody asked for, because they cost little.

use std::sync::Arc;
use std::time::Duration;

use super::super::pane::Demand;
use super::prediction::PredictionKey;
use super::{Computes, Demands, Job, SharedServices, State};
use touch2touch_core::rig::PadId;
use touch2touch_work::prediction::Prediction;

/// What a prediction may cost to be made without being asked for, seconds.
pub(crate) const CHEAP_S: f64 = 1.0;
/// How often it is looked whether the pair is still on screen, before its prediction begins.
const LOOK: Duration = Duration::from_millis(10);

/// A prediction that nobody asked for. Whoever goes on to another pair has it stopped.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PrefetchKey(pub PredictionKey);

impl Computes for PrefetchKey {
    type Value = Prediction;

    fn job(&self, state: &State, services: &SharedServices) -> Option<Job<Prediction>> {
        let Job { lane, what, body } = self.0.job(state, services)?;
        // Once for a pair and settings: the other finger follows at once.
        let beside = |pad| PredictionKey { touch: self.0.touch.pair.finger(pad), ..self.0.clone() };
        let first = !state.rig().pads().any(|pad| state.results.predictions.contains(&beside(pad)));
        let patience = if first { services.patience() } else { Duration::ZERO };
        let told = what.clone();
        Some(Job::new(lane, what, move |cx| {
            // Who pages on does not want it.
            let mut waited = Duration::ZERO;
            while waited < patience {
                cx.check(&told)?;
                std::thread::sleep(LOOK);
                waited += LOOK;
            }
            cx.check(&told)?;
            body(cx)
        }))
    }

    fn arrived(&self, state: &mut State, made: &Arc<Prediction>) {
        state.keep_prediction(self.0.clone(), made.clone(), true);
    }
}

impl State {
    /// What a prediction made as this one would be cost on this machine, seconds: the median of those of the open data
    /// set; `None` if there are none.
    pub fn cost_of(&self, recipe: &PredictionKey) -> Option<f64> {
        let same = |made: &PredictionKey| {
            PredictionKey { touch: recipe.touch, ..made.with_seed(recipe.config.seed) } == *recipe
        };
        let made = self.results.predictions.iter().filter(|(key, _)| same(key));
        let mut seconds: Vec<f64> = made.map(|(_, prediction)| prediction.seconds).collect();
        seconds.sort_by(f64::total_cmp);
        seconds.get(seconds.len() / 2).copied()
    }

    /// The prediction of a finger of the pair on screen that is made without being asked for, if one is.
    pub(crate) fn prefetch(&self, finger: PadId) -> Option<PrefetchKey> {
        let needs = [Demand::Imprint(super::ImprintSource::Predicted), Demand::Comparison, Demand::Ledger];
        let (_, cloud) = self.shows_cloud(super::ImprintSource::Predicted);
        let shown = cloud || needs.into_iter().any(|need| self.needs(need));
        let asked_for = self.tasks.any_generating().is_some() || (self.seeds_asked() && self.needs(Demand::Seeds));
        if !self.settings.generate.by_itself || !shown || asked_for || !self.fingers_to_generate().contains(&finger) {
            return None;
        }
        let touch = self.touch_key(finger).filter(|touch| self.results.looked_up.contains(touch))?;
        let key = PrefetchKey(self.recipe(touch)?);
        // What a person picked under these settings is meant.
        let there = self.results.predictions.contains(&key.0) || self.picked(touch).is_some();
        if there || !self.can_start(finger) {
            return None;
        }
        let cheap = self.cost_of(&key.0).is_none_or(|seconds| seconds < CHEAP_S);
        (cheap && self.failure(key.clone()).is_none()).then_some(key)
    }
}

impl Demands<'_> {
    /// The predictions of the pair on screen that cost little.
    pub(crate) fn predictions_ahead(&mut self) {
        let fingers = self.state.fingers_to_generate();
        for key in fingers.into_iter().filter_map(|finger| self.state.prefetch(finger)) {
            self.ask_unless(false, key);
        }
    }
}
