//! [`Shown`]: the prediction shown for each touch where the settings do not say it.

use std::collections::BTreeMap;

use super::super::keys::{PredictionKey, TouchKey};
use super::super::state::cache::Cache;
use touch2touch_pipeline::steps::prediction::Prediction;

/// The predictions that are shown where the settings do not name one that is there.
#[derive(Clone, Debug, Default)]
pub struct Shown {
    /// The one made last for each touch.
    last: BTreeMap<TouchKey, PredictionKey>,
    /// The one that a person picked among those made, with what the settings asked for at the time: another setting
    /// ends the pick, its return brings the pick back.
    picked: BTreeMap<TouchKey, (PredictionKey, Option<PredictionKey>)>,
}

impl Shown {
    /// Notes that a prediction was made; with `in_front` it is shown where the settings name none that is there.
    pub(super) fn made(&mut self, recipe: &PredictionKey, in_front: bool) {
        if in_front || !self.last.contains_key(&recipe.touch) {
            self.last.insert(recipe.touch, recipe.clone());
        }
    }

    /// Forgets what left the cache.
    pub(super) fn retain(&mut self, kept: &Cache<PredictionKey, Prediction>) {
        self.last.retain(|_, recipe| kept.contains(recipe));
        self.picked.retain(|_, (recipe, _)| kept.contains(recipe));
    }

    /// The prediction made last for a touch.
    pub(in crate::app) fn last(&self, touch: TouchKey) -> Option<&PredictionKey> {
        self.last.get(&touch)
    }

    /// The prediction that a person picked while the settings asked for `named`.
    pub(in crate::app) fn picked(&self, touch: TouchKey, named: Option<&PredictionKey>) -> Option<&PredictionKey> {
        let (recipe, under) = self.picked.get(&touch)?;
        (under.as_ref() == named).then_some(recipe)
    }

    /// Shows a prediction of those made while the settings ask for `named`.
    pub(in crate::app) fn pick(&mut self, recipe: PredictionKey, named: Option<PredictionKey>) {
        self.picked.insert(recipe.touch, (recipe, named));
    }

    /// Shows what the settings name, or what is made next.
    pub(in crate::app) fn unpick(&mut self, touch: TouchKey) {
        self.picked.remove(&touch);
    }
}
