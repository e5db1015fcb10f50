//! Predictions of one pair, in one go.

use std::sync::Arc;

use super::super::keys::PredictionKey;
use super::super::services::{DataSource, Services};
use super::Onlooker;
use crate::domain::sample::Sample;
use crate::work::bundles::BundleInfo;
use crate::work::error::TaskError;
use crate::work::job::JobCx;
use crate::work::models::Wanted;
use crate::work::prediction::Prediction;

/// Predictions with their keys.
pub type Keyed = Vec<(PredictionKey, Arc<Prediction>)>;

/// Makes `recipes`, all of one pair and bundle. A finger without a GelSlim image is left out where another has one.
/// `sample` is the pair, if it is loaded; `onlooker` sees pictures on the way.
///
/// # Errors
/// If no finger has a GelSlim image, the pair or the model cannot be loaded or run, or the job was told to stop.
pub fn generate(
    services: &dyn Services,
    recipes: Vec<PredictionKey>,
    bundle: &BundleInfo,
    source: &dyn DataSource,
    sample: Option<Arc<Sample>>,
    cx: &JobCx,
    onlooker: Option<Onlooker>,
) -> Result<Keyed, TaskError> {
    let Some(first) = recipes.first() else { return Ok(Vec::new()) };
    let fingers: Vec<&str> = recipes.iter().map(|recipe| recipe.touch.finger.name()).collect();
    let missing = format!("there is no GelSlim image of the {} finger", fingers.join(" or "));
    let sample = match sample {
        Some(sample) => sample,
        None => Arc::new(source.load(first.touch.pair.pair)?),
    };
    let (engine, config) = (first.runtime, first.config());
    let touched = |recipe: PredictionKey| {
        let touch = sample.finger(recipe.touch.finger)?;
        let size = touch.bubble.as_ref().map_or([0, 0], |bubble| bubble.imprint.size());
        let wanted = Wanted { difference: &touch.gelslim.as_ref()?.difference, seed: recipe.seed, size };
        Some((recipe, wanted))
    };
    let (keys, wanted): (Vec<PredictionKey>, Vec<Wanted<'_>>) = recipes.into_iter().filter_map(touched).unzip();
    if keys.is_empty() {
        return Err(TaskError::new("Generate", missing));
    }
    let cx = match onlooker {
        Some(onlooker) => cx.clone().with_previews(onlooker.of(keys.clone())),
        None => cx.clone(),
    };
    let made = services.predict(bundle, engine, &config, &wanted, &cx)?;
    Ok(keys.into_iter().zip(made.into_iter().map(Arc::new)).collect())
}
