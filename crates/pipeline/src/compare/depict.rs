//! Imprints that the subjects of a comparison stand for ([`depict`]).

use std::borrow::Cow;

use crate::compare::subject::MadeFrom;
use crate::compare::{Depicted, beside, tile_of};
use crate::error::TaskError;
use crate::job::JobCx;
use crate::labels::ImprintSource;
use crate::steps::estimate::{Estimate, Touch, estimate};
use crate::steps::imprint::imprint_of;
use crate::steps::models::Models;
use crate::steps::on_pad::OnPad;
use crate::steps::recipe::{Recipe, Stage};
use touch2touch_core::ensemble::Spread;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;

const WHAT: &str = "Compare A and B";

/// A subject as a pair has it.
#[derive(Clone, Debug)]
pub struct SubjectImprints {
    /// The touch until its imprints; it can be felt further.
    pub estimate: Estimate,
    /// Imprint as its file has it, of pairs that are pictures.
    pub tile: Option<DepthMap>,
}

impl SubjectImprints {
    /// The imprint of a pad with its picture; `None` where the pad has none. `tile` is the measured one's picture.
    ///
    /// # Errors
    /// As [`Depicted::predicted`].
    pub fn of_pad<'a>(
        &'a self,
        sample: &Sample,
        pad: PadId,
        tile: Option<&'a DepthMap>,
    ) -> Result<Option<Depicted<'a>>, TaskError> {
        let Some(imprint) = &self.estimate.imprints[pad] else { return Ok(None) };
        if let Some(own) = &self.tile {
            return Ok(Some(Depicted { imprint, tile: Some(Cow::Borrowed(own)) }));
        }
        let drawn = self.estimate.predictions[pad].as_ref().map(|made| (made, self.estimate.recipe().shift));
        Depicted::predicted(imprint, drawn, sample, pad, tile).map(Some)
    }
}

/// Makes the imprints that a subject stands for. `recipe` is that of what is not predicted.
///
/// # Errors
/// If it cannot be predicted, or a picture that it asks for is not there.
pub fn depict(
    from: &MadeFrom,
    recipe: &Recipe,
    touch: Touch<'_>,
    models: &Models,
    cx: &JobCx,
) -> Result<SubjectImprints, TaskError> {
    let Touch { dataset, pair, sample, .. } = touch;
    let recipe = Recipe { imprint: ImprintSource::Measured, ..recipe.clone() };
    match from {
        MadeFrom::Measurement => {
            let tile = tile_of(dataset, pair, sample)?;
            Ok(SubjectImprints { estimate: estimate(touch, &recipe, Stage::Imprint, models, cx)?, tile })
        }
        MadeFrom::Picture => {
            let found = beside(dataset, pair, sample)?;
            let found = found.ok_or_else(|| TaskError::new(WHAT, "there is no NAME_vqvae.png beside this pair"))?;
            // Picture pairs have one finger.
            let pads = sample.rig.pads().map(|pad| sample.pad(pad).map(|_| found.imprint.clone()));
            Ok(SubjectImprints { estimate: Estimate::of_imprints(&recipe, pads.collect()), tile: Some(found.tile) })
        }
        MadeFrom::Prediction(recipe) => {
            Ok(SubjectImprints { estimate: estimate(touch, recipe, Stage::Imprint, models, cx)?, tile: None })
        }
        MadeFrom::Mean(recipes) => {
            let recipe = recipes.first().ok_or_else(|| TaskError::new(WHAT, "no seed is asked for"))?;
            let generating = recipe.generating()?;
            let seeds: Vec<u64> = recipes.iter().filter_map(|one| Some(one.generator.as_ref()?.1.seed)).collect();
            let mut imprints = PerPad::default();
            for (pad, _) in sample.pads.entries() {
                if generating.picture(sample, pad)?.is_some() {
                    let made = generating.seeds(models, OnPad { sample, pad }, &seeds, cx)?;
                    let meters = made.iter().map(|made| imprint_of(made, recipe.shift, sample, pad));
                    let meters = meters.collect::<Result<Vec<_>, _>>()?;
                    imprints[pad] = Some(mean(&meters.iter().collect::<Vec<_>>())?);
                }
            }
            Ok(SubjectImprints { estimate: Estimate::of_imprints(recipe, imprints), tile: None })
        }
    }
}

/// The mean of several predictions of a touch, meters.
///
/// # Errors
/// If there is none, or their sizes differ.
pub fn mean(imprints: &[&DepthMap]) -> Result<DepthMap, TaskError> {
    let spread = Spread::of(imprints).map(|spread| spread.mean);
    spread.ok_or_else(|| TaskError::new("Mean of the seeds", "the predictions differ in size"))
}
