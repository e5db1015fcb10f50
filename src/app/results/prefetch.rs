//! Predictions of the pair on screen that nobody asked for, because they cost little.

use std::sync::Arc;
use std::time::Duration;

use super::super::jobs::Job;
use super::super::keys::{ImprintSource, PredictionKey, PrefetchKey};
use super::super::pane::Demand;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::State;
use super::super::{recipe, results};
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::steps::prediction::Prediction;

/// The highest cost of a prediction that is made without being asked for, seconds.
pub(crate) const CHEAP_S: f64 = 1.0;
/// The time between two looks whether the pair is still on screen, before its prediction begins.
const LOOK: Duration = Duration::from_millis(10);

impl Computes for PrefetchKey {
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
        results::keep_prediction(state, self.0.clone(), made.clone(), true);
    }
}

/// The prediction of a finger of the pair on screen that is made without being asked for, if one is.
pub(crate) fn prefetch(state: &State, finger: PadId) -> Option<PrefetchKey> {
    let needs = [Demand::Imprint(ImprintSource::Predicted), Demand::Comparison];
    let (_, cloud) = results::shows_cloud(state, ImprintSource::Predicted);
    let shown = cloud || needs.into_iter().any(|need| state.needs(need));
    if !state.settings.generate.by_itself
        || !shown
        || state.tasks.any_generating().is_some()
        || !results::fingers_to_generate(state).contains(&finger)
    {
        return None;
    }
    let touch = state.touch_key(finger).filter(|touch| state.results.looked_up.contains(touch))?;
    let key = PrefetchKey(recipe::prediction(state, touch)?);
    // What a person picked under these settings is meant.
    let there = state.results.predictions.contains(&key.0) || results::picked(state, touch).is_some();
    if there || !results::can_start(state, finger) {
        return None;
    }
    let cheap = state.results.cost_of(&key.0).is_none_or(|seconds| seconds < CHEAP_S);
    (cheap && state.failure(key.clone()).is_none()).then_some(key)
}

/// The predictions of the pair on screen that cost little.
pub(crate) fn want_predictions_ahead(wants: &mut Demands<'_>) {
    let fingers = results::fingers_to_generate(wants.state);
    for key in fingers.into_iter().filter_map(|finger| prefetch(wants.state, finger)) {
        wants.ask_unless(false, key);
    }
}
