//! Predictions of one pair, in one go.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Instant;

use super::super::error::TaskError;
use super::super::keys::Recipe;
use super::super::library::BundleInfo;
use super::super::results::Prediction;
use super::super::services::{DataSource, GenerateItem, Services};
use super::JobCx;
use crate::domain::grid::RgbGrid;
use crate::domain::sample::Sample;

/// Makes `recipes`, all of one pair and bundle. A finger without a GelSlim image is left out where another has one.
/// `sample` is the pair, if it is loaded.
///
/// # Errors
/// If no finger has a GelSlim image, the pair or the model cannot be loaded or run, or the job was told to stop.
pub fn generate(
    services: &dyn Services,
    recipes: Vec<Recipe>,
    bundle: &BundleInfo,
    source: &dyn DataSource,
    sample: Option<Arc<Sample>>,
    cx: &JobCx,
) -> Result<Vec<Arc<Prediction>>, TaskError> {
    let Some(first) = recipes.first() else { return Ok(Vec::new()) };
    let rig = source.rig();
    let ends = bundle.ends(&rig).transpose().map_err(|err| TaskError::from_error("Generate", &err))?;
    let input = ends.ok_or_else(|| TaskError::new("Generate", "the bundle is not a generator"))?.input;
    let sensor = rig.sensor(input).map_or("input", |sensor| &*sensor.name).to_owned();
    let fingers: Vec<_> = recipes.iter().map(|recipe| rig.pad_key(recipe.touch.finger)).collect();
    let missing = format!("there is no {sensor} image of the {} finger", fingers.join(" or "));
    let start = Instant::now();
    let sample = match sample {
        Some(sample) => sample,
        None => Arc::new(source.load(first.touch.pair.pair)?),
    };
    let pictures: Vec<(Recipe, Cow<'_, RgbGrid>, [usize; 2])> = recipes
        .into_iter()
        .filter_map(|recipe| {
            let touch = sample.pad(recipe.touch.finger)?;
            let size = touch.depth().map_or([0, 0], |bubble| bubble.imprint.size());
            Some((recipe, touch.picture(input)?, size))
        })
        .collect();
    let items: Vec<GenerateItem<'_>> = pictures
        .iter()
        .map(|(recipe, difference, size)| GenerateItem { recipe: recipe.clone(), difference, size: *size })
        .collect();
    if items.is_empty() {
        return Err(TaskError::new("Generate", missing));
    }
    let made = services.generate(bundle, &items, cx)?;
    // What was made together took its time together.
    let fresh = made.iter().filter(|output| output.kept.is_none()).count().max(1);
    let each = start.elapsed().as_secs_f64() / fresh as f64;
    let prediction = |(item, output): (GenerateItem<'_>, _)| {
        let output: super::super::services::Generated = output;
        Arc::new(Prediction { recipe: item.recipe, seconds: output.kept.unwrap_or(each), output })
    };
    Ok(items.iter().cloned().zip(made).map(prediction).collect())
}
