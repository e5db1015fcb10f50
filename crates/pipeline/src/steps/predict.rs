//! [`Generating`]: a generator with its choices, and what it predicts for whole pairs.

use std::borrow::Cow;

use crate::error::TaskError;
use crate::job::JobCx;
pub use crate::steps::models::Generating;
use crate::steps::models::{GenerateInput, Models};
use crate::steps::on_pad::OnPad;
use crate::steps::prediction::Prediction;
use touch2touch_core::grid::RgbGrid;
use touch2touch_core::rig::{PadId, PerPad, Rig, SensorId};
use touch2touch_core::sample::Sample;

/// The predictions of a pair's pads, or why a pad has none.
pub type Predicted = PerPad<Result<Prediction, TaskError>>;

impl Generating<'_> {
    /// The sensor that it starts from.
    ///
    /// # Errors
    /// If the bundle is not a generator, or not one of the sensors of `rig`.
    pub fn input(self, rig: &Rig) -> Result<SensorId, TaskError> {
        let what = || format!("Generate with {}", self.bundle.name);
        let ends = self.bundle.ends(rig).ok_or_else(|| TaskError::new(what(), "the bundle is not a generator"))?;
        Ok(ends.map_err(|err| TaskError::from_error(what(), &err))?.input)
    }

    /// Error for a rig of which no touch has a reading of the sensor that the generator starts from.
    pub fn no_input(self, rig: &Rig) -> TaskError {
        let sensor = self.input(rig).ok().and_then(|input| rig.sensor(input));
        let name = sensor.map_or("GelSlim", |sensor| &sensor.name);
        TaskError::new(format!("Generate with {}", self.bundle.name), format!("no {name} image"))
    }

    /// The picture of a pad that it starts from; `None` where the pad has no such reading.
    ///
    /// # Errors
    /// As [`Self::input`].
    pub fn picture(self, sample: &Sample, pad: PadId) -> Result<Option<Cow<'_, RgbGrid>>, TaskError> {
        let input = self.input(&sample.rig)?;
        Ok(sample.pad(pad).and_then(|touch| touch.picture(input)))
    }

    /// The predictions of a pad with several seeds.
    ///
    /// # Errors
    /// If the pad has no picture to start from, or as [`Models::predict`].
    pub fn seeds(
        self,
        models: &Models,
        OnPad { sample, pad }: OnPad<'_>,
        seeds: &[u64],
        cx: &JobCx,
    ) -> Result<Vec<Prediction>, TaskError> {
        let picture = self.picture(sample, pad)?.ok_or_else(|| self.no_input(&sample.rig))?;
        let wanted = |&seed: &u64| GenerateInput { difference: &picture, seed, size: [0, 0] };
        models.predict(self, &seeds.iter().map(wanted).collect::<Vec<_>>(), cx)
    }

    /// The predictions of pictures that it starts from, in their order.
    ///
    /// # Errors
    /// As [`Models::predict`].
    pub fn of(self, models: &Models, pictures: &[Cow<'_, RgbGrid>], cx: &JobCx) -> Result<Vec<Prediction>, TaskError> {
        let wanted: Vec<_> = pictures.iter().map(|picture| self.starting_from(picture)).collect();
        models.predict(self, &wanted, cx)
    }

    pub(crate) fn starting_from(self, difference: &RgbGrid) -> GenerateInput<'_> {
        GenerateInput { difference, seed: self.config.seed, size: [0, 0] }
    }

    /// The predictions of a pair's pads. Pads without a picture to start from have none.
    ///
    /// # Errors
    /// As [`Self::input`] and [`Models::predict`].
    pub fn pair(self, models: &Models, sample: &Sample, cx: &JobCx) -> Result<PerPad<Prediction>, TaskError> {
        self.pads(models, sample, &sample.rig.pad_list(), cx)
    }

    /// As [`Self::pair`] of some pads, in one call of the model; who looks on knows a pad by its place among those with a
    /// picture.
    ///
    /// # Errors
    /// As [`Self::pair`].
    pub fn pads(
        self,
        models: &Models,
        sample: &Sample,
        pads: &[PadId],
        cx: &JobCx,
    ) -> Result<PerPad<Prediction>, TaskError> {
        let mut pictures = Vec::new();
        for &pad in pads {
            let size = sample.pad(pad).and_then(|touch| touch.depth()).map_or([0, 0], |felt| felt.imprint.size());
            pictures.extend(self.picture(sample, pad)?.map(|picture| (pad, picture, size)));
        }
        let wanted: Vec<GenerateInput<'_>> = pictures
            .iter()
            .map(|(_, picture, size)| GenerateInput { size: *size, ..self.starting_from(picture) })
            .collect();
        let made = models.predict(self, &wanted, cx)?;
        let mut out = PerPad::default();
        for ((pad, ..), made) in pictures.iter().zip(made) {
            out[*pad] = Some(made);
        }
        Ok(out)
    }

    /// The predictions of several pairs' pads, or why one has none: it does not take the others with it.
    /// `None` once told to stop.
    ///
    /// # Errors
    /// As [`Self::input`].
    pub fn pairs(self, models: &Models, samples: &[&Sample], cx: &JobCx) -> Result<Option<Vec<Predicted>>, TaskError> {
        let mut pictures: Vec<(usize, PadId, Cow<'_, RgbGrid>)> = Vec::new();
        for (at, sample) in samples.iter().enumerate() {
            let input = self.input(&sample.rig)?;
            pictures.extend(sample.pads.entries().filter_map(|(pad, touch)| Some((at, pad, touch.picture(input)?))));
        }
        let wanted: Vec<_> = pictures.iter().map(|(.., picture)| self.starting_from(picture)).collect();
        let Some(made) = models.predict_each(self, &wanted, cx) else { return Ok(None) };
        let mut out: Vec<_> = samples.iter().map(|_| PerPad::default()).collect();
        for ((at, pad, _), made) in pictures.iter().zip(made) {
            out[*at][*pad] = Some(made);
        }
        Ok(Some(out))
    }
}
