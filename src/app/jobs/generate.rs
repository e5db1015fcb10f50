//! Predictions of one pair, in one go.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::super::keys::PredictionKey;
use super::super::services::{DataSource, Services};
use super::Onlooker;
use crate::domain::grid::RgbGrid;
use crate::domain::rig::PadId;
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
    let rig = source.rig();
    let ends = bundle.ends(&rig).transpose().map_err(|err| TaskError::from_error("Generate", &err))?;
    let input = ends.ok_or_else(|| TaskError::new("Generate", "the bundle is not a generator"))?.input;
    let sensor = rig.sensor(input).map_or("input", |sensor| &*sensor.name).to_owned();
    let fingers: Vec<_> = recipes.iter().map(|recipe| rig.pad_key(recipe.touch.finger)).collect();
    let missing = format!("there is no {sensor} image of the {} finger", fingers.join(" or "));
    let sample = match sample {
        Some(sample) => sample,
        None => Arc::new(source.load(first.touch.pair.pair)?),
    };
    let (engine, config) = (first.runtime, first.config());
    let touched = |recipe: PredictionKey| {
        let touch = sample.pad(recipe.touch.finger)?;
        let size = touch.depth().map_or([0, 0], |bubble| bubble.imprint.size());
        Some((recipe, (touch.picture(input)?, size)))
    };
    // One picture for each finger, whatever the number of seeds: it is encoded once.
    let mut pictures: BTreeMap<PadId, (Cow<'_, RgbGrid>, [usize; 2])> = BTreeMap::new();
    let mut keys: Vec<PredictionKey> = Vec::new();
    for (key, found) in recipes.into_iter().filter_map(touched) {
        pictures.entry(key.touch.finger).or_insert(found);
        keys.push(key);
    }
    let wanted = |key: &PredictionKey| {
        let (picture, size) = &pictures[&key.touch.finger];
        Wanted { difference: picture, seed: key.seed, size: *size }
    };
    let wanted: Vec<Wanted<'_>> = keys.iter().map(wanted).collect();
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
