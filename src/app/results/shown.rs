//! The prediction shown for each touch: that of the settings in force, else an earlier one, which says so.

use std::collections::BTreeMap;
use std::sync::Arc;

use strum::IntoEnumIterator as _;

use super::super::state::State;
use super::imprint::MetersKey;
use super::prediction::PredictionKey;
use super::{Cache, Computes as _};
use crate::app::keys::{ShiftMode, TouchKey};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::postprocess::RawPrediction;
use touch2touch_core::rig::PadId;
use touch2touch_work::prediction::{Prediction, made_with};

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
    /// Why it is shown all the same.
    pub why: Why,
}

/// Why a prediction is shown that the settings in force would not make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// A person picked it under these settings.
    Picked,
    /// The open case holds it, and its model is not here.
    Held,
    /// What the settings ask for is on its way.
    OnItsWay,
    /// What the settings ask for was not made.
    NotMade,
}

impl Why {
    /// Whether it is meant to be shown.
    pub(crate) fn is_meant(self) -> bool {
        matches!(self, Self::Picked | Self::Held)
    }
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
        let generating = || named.as_ref().is_some_and(|named| self.tasks.generating(named).is_some());
        let why = if self.lacks(&shown.bundle) {
            Why::Held
        } else if self.picked(touch).is_some() {
            Why::Picked
        } else if generating() || self.prefetch(finger).is_some() {
            Why::OnItsWay
        } else {
            Why::NotMade
        };
        Some(Outdated { made_with: self.made_with(shown), why })
    }

    /// How a prediction was made, in the words that stand beside it wherever it is shown: `model · 2 steps · seed 42`.
    pub fn made_with(&self, recipe: &PredictionKey) -> String {
        made_with(self.model_name(recipe), &recipe.config)
    }

    /// The name of the model that made a prediction.
    pub(crate) fn model_name(&self, recipe: &PredictionKey) -> &str {
        let bundle = self.library.bundle(&recipe.bundle).map(|bundle| &*bundle.name);
        let lacking = self.library.lacking.as_ref().filter(|(id, _)| *id == recipe.bundle).map(|(_, name)| &**name);
        bundle.or(lacking).unwrap_or("a model that is not there any more")
    }

    /// Whether the open case was made with this generator, and it is not here.
    fn lacks(&self, bundle: &str) -> bool {
        self.library.lacking.as_ref().is_some_and(|(id, _)| **id == *bundle)
    }

    /// Keeps an imprint in place of the prediction that it was made of, which cannot be made here.
    pub(in crate::app) fn hold(
        &mut self,
        recipe: PredictionKey,
        shift: ShiftMode,
        imprint: Arc<DepthMap>,
        model: &str,
    ) {
        let why = format!("only this imprint is in the case; the model {model} that would make it anew is not here");
        let chains = ShiftMode::iter().map(|mode| (mode, Err(why.clone()))).collect();
        let made = Prediction {
            raw: RawPrediction { channels: vec![(*imprint).clone()] },
            chains: Arc::new(chains),
            fit: None,
            color: None,
            bundle: recipe.bundle.clone(),
            engine: "the case".into(),
            seconds: 0.0,
            kept: true,
        };
        self.keep_prediction(recipe.clone(), Arc::new(made), true);
        let bytes = MetersKey::bytes(&imprint);
        self.results.imprints.insert(MetersKey(recipe, shift), imprint, bytes);
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
