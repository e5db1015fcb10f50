//! What the generator in force can start from, and what it predicts.

use crate::app::keys::{PredictionKey, Request};
use crate::app::state::{Absent, Lookup, State};
use crate::domain::grid::RgbGrid;
use crate::domain::rig::{PadId, SensorKind};
use crate::domain::sample::Sample;
use crate::work::bundles::BundleKind;

impl State {
    /// Whether something can be generated for the selected pair.
    ///
    /// # Errors
    /// Why not.
    pub fn can_generate(&self) -> Result<(), Absent> {
        self.pair_key().ok_or(if self.library.open.is_none() {
            Absent::NothingOpen
        } else {
            Absent::NothingSelected
        })?;
        self.bundle(BundleKind::Generator)?;
        // While the sample loads, the job loads it itself.
        let Some(sample) = self.sample().ready() else {
            return Ok(());
        };
        if sample.rig.pads().any(|finger| self.has_input(sample, finger)) { Ok(()) } else { Err(Absent::NoInput) }
    }

    /// Whether a finger has a reading of the sensor that the generator starts from.
    fn has_input(&self, sample: &Sample, finger: PadId) -> bool {
        let ends = self.bundle(BundleKind::Generator).ok().and_then(|bundle| bundle.ends(&sample.rig)?.ok());
        ends.is_some_and(|ends| sample.pad(finger).is_some_and(|touch| touch.reading(ends.input).is_some()))
    }

    /// Whether something can be generated for a finger of the selected pair, which is loaded.
    pub fn can_start(&self, finger: PadId) -> bool {
        self.sample().ready().is_some_and(|sample| self.has_input(sample, finger))
    }

    /// Whether a prediction is a color picture.
    pub(in crate::app) fn is_color(&self, recipe: &PredictionKey) -> bool {
        let bundle = self.library.bundle(&recipe.bundle).and_then(|bundle| bundle.generator.as_ref());
        bundle.is_some_and(|generator| generator.sensors.output.kind == SensorKind::Color)
    }

    /// The predicted color picture shown for one finger, where that is what the model predicts.
    pub fn predicted_color(&self, finger: PadId) -> Option<Lookup<'_, RgbGrid>> {
        let recipe = self.chosen(finger).filter(|recipe| self.is_color(recipe))?;
        Some(match self.results.colors.get(recipe) {
            Some(picture) => Lookup::Ready(picture),
            None => self.missing(&Request::Imprint(recipe.clone(), self.settings.shift)),
        })
    }
}
