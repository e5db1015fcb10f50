//! The prediction shown for each touch: that of the settings in force, else an earlier one, which says so.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::super::state::State;
use super::prediction::PredictionKey;
use super::{Cache, Computes as _};
use crate::app::keys::TouchKey;
use crate::domain::rig::PadId;
use crate::work::prediction::Prediction;

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
}

/// A prediction on screen that the settings in force would not make.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outdated {
    /// How it was made: `model · 2 steps · seed 42`.
    pub made_with: String,
    /// Whether a person picked it, so that it is meant.
    pub picked: bool,
    /// Whether what the settings ask for is on its way.
    pub coming: bool,
}

impl State {
    /// The prediction shown for a touch, if one was made: the one picked among them under these settings, else the one
    /// that the settings name, else the last.
    pub fn shown(&self, touch: TouchKey) -> Option<&PredictionKey> {
        let made = self.results.made.get(&touch)?;
        if let Some(picked) = self.picked(touch) {
            return Some(picked);
        }
        let named = self.recipe(touch);
        let named = made.iter().find(|recipe| Some(*recipe) == named.as_ref());
        named.or_else(|| self.results.shown.last.get(&touch)).filter(|recipe| self.results.predictions.contains(recipe))
    }

    /// The prediction that a person picked under the settings in force.
    pub(super) fn picked(&self, touch: TouchKey) -> Option<&PredictionKey> {
        let (recipe, under) = self.results.shown.picked.get(&touch)?;
        (self.results.predictions.contains(recipe) && *under == self.recipe(touch)).then_some(recipe)
    }

    /// The prediction shown for one finger of the selected pair, if one was made.
    pub fn chosen(&self, finger: PadId) -> Option<&PredictionKey> {
        self.shown(self.touch_key(finger)?)
    }

    /// Shows a prediction of those made until another setting asks for something else.
    pub(crate) fn pick(&mut self, recipe: PredictionKey) {
        let named = self.recipe(recipe.touch);
        self.results.shown.picked.insert(recipe.touch, (recipe, named));
    }

    /// Shows what the settings name, or what is made next.
    pub(crate) fn unpick(&mut self, touch: TouchKey) {
        self.results.shown.picked.remove(&touch);
    }

    /// What is said of the prediction shown for a finger where the settings in force would make another one.
    pub fn outdated(&self, finger: PadId) -> Option<Outdated> {
        let touch = self.touch_key(finger)?;
        let shown = self.shown(touch)?;
        let named = self.recipe(touch);
        if named.as_ref() == Some(shown) {
            return None;
        }
        let picked = self.picked(touch).is_some();
        let generating = named.is_some_and(|named| self.tasks.generating(&named).is_some());
        let coming = generating || self.ahead(finger).is_some();
        Some(Outdated { made_with: self.made_with(shown), picked, coming })
    }

    /// How a prediction was made, in the words that stand beside it wherever it is shown: `model · 2 steps · seed 42`.
    pub fn made_with(&self, recipe: &PredictionKey) -> String {
        let bundle = self.library.bundle(&recipe.bundle);
        let model = bundle.map_or("a model that is not there any more", |bundle| &bundle.name);
        crate::work::prediction::made_with(model, &recipe.config())
    }

    /// Keeps a prediction of the open data set; with `in_front` it is shown where the settings name none that is there.
    pub(crate) fn keep_prediction(&mut self, recipe: PredictionKey, made: Arc<Prediction>, in_front: bool) {
        if self.library.open.as_ref().is_none_or(|open| open.seq != recipe.touch.pair.dataset) {
            return;
        }
        let results = &mut self.results;
        let bytes = PredictionKey::bytes(&made);
        results.predictions.insert(recipe.clone(), made, bytes);
        results.list_made(&recipe, in_front);
    }
}
