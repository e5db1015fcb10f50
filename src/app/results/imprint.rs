//! Imprints: those measured lie in the sample, those predicted are made of a raw prediction.

use std::sync::Arc;

use super::super::keys::ShiftMode;
use super::picture::PictureKey;
use super::prediction::PredictionKey;
use super::{Absent, Computes, Demands, ImprintSource, Job, Lane, Lookup, SharedServices, State, TouchKey};
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::rig::{PadId, SensorKind};
use touch2touch_core::sample::Sample;
use touch2touch_work::compare::Beside;
use touch2touch_work::ensemble::Ensemble;
use touch2touch_work::error::TaskError;
use touch2touch_work::imprint;
use touch2touch_work::labels::ImprintOf;

/// A prediction in meters.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MetersKey(pub PredictionKey, pub ShiftMode);

impl Computes for MetersKey {
    type Value = DepthMap;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<DepthMap>> {
        let Self(recipe, shift) = self;
        let prediction = state.results.predictions.get(recipe)?.clone();
        let sample = state.results.samples.get(&recipe.touch.pair)?.clone();
        let (shift, finger) = (*shift, recipe.touch.finger);
        Some(Job::new(Lane::Compute, "Prediction in meters", move |_| {
            imprint::imprint_of(&prediction, shift, &sample, finger)
        }))
    }

    fn bytes(imprint: &DepthMap) -> usize {
        imprint.len() * 4
    }
}

/// A prediction of a color sensor, as a picture.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ColorKey(pub PredictionKey);

impl Computes for ColorKey {
    type Value = RgbGrid;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<RgbGrid>> {
        let prediction = state.results.predictions.get(&self.0)?.clone();
        Some(Job::new(Lane::Compute, "Predicted color picture", move |_| {
            imprint::color(&prediction, [0, 0])?.ok_or_else(gone)
        }))
    }

    fn bytes(picture: &RgbGrid) -> usize {
        picture.len() * 12
    }
}

/// Several predictions of one touch, as far as they are there.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EnsembleKey {
    /// The touch.
    pub touch: TouchKey,
    /// At least one; they differ in their seeds.
    pub recipes: Vec<PredictionKey>,
    /// How they become meters.
    pub shift: ShiftMode,
}

/// One imprint in meters.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ImprintKey {
    /// Measured: it is in the sample.
    Measured(TouchKey),
    /// Derived from a prediction.
    Predicted(PredictionKey, ShiftMode),
    /// The mean of several predictions.
    Mean(EnsembleKey),
    /// The prediction of another program that lies beside the pair.
    Picture(TouchKey),
}

impl ImprintKey {
    /// The touch it belongs to.
    pub fn touch(&self) -> TouchKey {
        match self {
            Self::Measured(touch) | Self::Picture(touch) => *touch,
            Self::Predicted(recipe, _) => recipe.touch,
            Self::Mean(key) => key.touch,
        }
    }

    /// What masks drawn on it are told by; `None` where nobody can have drawn on it.
    pub fn of(&self) -> Option<ImprintOf> {
        match self {
            Self::Measured(_) => Some(ImprintOf::Measured),
            Self::Predicted(recipe, shift) => Some(ImprintOf::predicted(&recipe.bundle, &recipe.config, *shift)),
            Self::Mean(_) | Self::Picture(_) => None,
        }
    }

    /// The side that it is shown on where there are two.
    pub fn side(&self) -> ImprintSource {
        match self {
            Self::Measured(_) => ImprintSource::Measured,
            Self::Predicted(..) | Self::Mean(_) | Self::Picture(_) => ImprintSource::Predicted,
        }
    }
}

impl ImprintKey {
    /// The imprint it names; `None` if it is not there.
    pub(crate) fn find(&self, state: &State) -> Option<Imprint> {
        Some(match self {
            Self::Measured(touch) => Imprint::Measured(state.results.samples.get(&touch.pair)?.clone(), *touch),
            Self::Predicted(recipe, shift) => {
                Imprint::Predicted(state.results.imprints.get(&MetersKey(recipe.clone(), *shift))?.clone())
            }
            Self::Mean(key) => Imprint::Mean(state.results.ensembles.get(key)?.clone()),
            Self::Picture(touch) => Imprint::Picture(state.results.pictures.get(&PictureKey(*touch))?.clone()),
        })
    }
}

/// An imprint wherever it lies, as an input of jobs.
pub(crate) enum Imprint {
    Measured(Arc<Sample>, TouchKey),
    Predicted(Arc<DepthMap>),
    Mean(Arc<Ensemble>),
    Picture(Arc<Beside>),
}

impl Imprint {
    /// The imprint, meters.
    ///
    /// # Errors
    /// Without a measurement, which was there when the job was prepared: a defect if it ever shows.
    pub(crate) fn get(&self) -> Result<&DepthMap, TaskError> {
        match self {
            Self::Measured(sample, touch) => {
                let bubble = sample.pad(touch.finger).and_then(|t| t.depth());
                bubble.map(|bubble| &bubble.imprint).ok_or_else(gone)
            }
            Self::Predicted(depth) => Ok(depth),
            Self::Mean(found) => Ok(&found.spread.mean),
            Self::Picture(found) => Ok(&found.imprint),
        }
    }
}

/// An input of a job that was there when it was prepared: a defect if it ever shows.
pub(crate) fn gone() -> TaskError {
    TaskError::new("Compute", "the measured imprint is not there")
}

impl State {
    /// Whether a prediction is a color picture.
    pub(crate) fn is_color(&self, recipe: &PredictionKey) -> bool {
        let bundle = self.library.bundle(&recipe.bundle).and_then(|bundle| bundle.generator.as_ref());
        bundle.is_some_and(|generator| generator.sensors.output.kind == SensorKind::Color)
    }

    /// The recipe of the imprint shown for one finger.
    ///
    /// # Errors
    /// Why there is none.
    pub fn imprint_key(&self, source: ImprintSource, finger: PadId) -> Result<ImprintKey, Absent> {
        let touch = self.touch_key(finger).ok_or(Absent::NothingSelected)?;
        match source {
            ImprintSource::Measured => Ok(ImprintKey::Measured(touch)),
            ImprintSource::Predicted => {
                let recipe = self.shown(touch).ok_or(Absent::NoPrediction)?;
                if self.is_color(recipe) {
                    return Err(Absent::PredictsColor);
                }
                Ok(ImprintKey::Predicted(recipe.clone(), self.settings.shift))
            }
        }
    }

    /// The imprint shown for one finger, meters, raw bubble orientation.
    pub fn imprint(&self, source: ImprintSource, finger: PadId) -> Lookup<'_, DepthMap> {
        match self.imprint_key(source, finger) {
            Ok(key) => self.imprint_of(key),
            Err(Absent::NoPrediction) if self.prefetch(finger).is_some() => Lookup::Waiting,
            Err(absent) => Lookup::Absent(absent),
        }
    }

    /// An imprint of the selected pair by its recipe, meters, raw bubble orientation.
    pub(crate) fn imprint_of(&self, key: ImprintKey) -> Lookup<'_, DepthMap> {
        match key {
            ImprintKey::Measured(touch) => self.bubble(touch.finger).and_then(Absent::NoBubble, |b| Some(&b.imprint)),
            ImprintKey::Predicted(recipe, shift) => self.look(MetersKey(recipe, shift)).value(),
            ImprintKey::Mean(key) => self.look(key).map(|found| &found.spread.mean),
            ImprintKey::Picture(touch) => self.look(PictureKey(touch)).map(|found| &found.imprint),
        }
    }

    /// The predicted color picture shown for one finger, where that is what the model predicts.
    pub fn predicted_color(&self, finger: PadId) -> Option<Lookup<'_, RgbGrid>> {
        let recipe = self.chosen(finger).filter(|recipe| self.is_color(recipe))?;
        Some(self.look(ColorKey(recipe.clone())).value())
    }
}

impl Demands<'_> {
    pub(crate) fn imprint(&mut self, finger: PadId, touch: TouchKey) {
        let state = self.state;
        let Some(recipe) = state.shown(touch).cloned() else { return };
        // The sample says how large the bubble image is.
        if state.touch(finger).ready().is_none() {
            return;
        }
        match state.results.predictions.get(&recipe).map(|prediction| prediction.color.is_some()) {
            Some(true) => self.ask(ColorKey(recipe)),
            Some(false) => self.ask(MetersKey(recipe, state.settings.shift)),
            None => {}
        }
    }
}
