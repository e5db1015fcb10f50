//! Raw predictions: those kept on the disk and those that a pane needs.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::{Key, Keyed, PredictionKey, StoredKey, TouchKey};
use super::super::results;
use super::super::results::preview::Onlooker;
use super::super::results::{Computes, Demands};
use super::super::services::{Services, SharedServices};
use super::super::source::DataSource;
use super::super::state::State;
use touch2touch_core::grid::RgbGrid;
use touch2touch_core::rig::{PadId, SensorId};
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::steps::bundles::BundleInfo;
use touch2touch_pipeline::steps::models;
use touch2touch_pipeline::steps::prediction::Prediction;

impl Computes for PredictionKey {
    fn job(&self, state: &State, services: &SharedServices) -> Option<Job<Prediction>> {
        let (services, recipe) = (services.clone(), self.clone());
        let source = state.library.open.as_ref()?.source.clone();
        let bundle = state.library.bundle(&recipe.bundle)?.clone();
        let sample = state.results.samples.get(&recipe.touch.pair).cloned();
        Some(Job::new(Lane::Models, format!("Generate with {}", bundle.name), move |cx| {
            let made = generate(&*services, vec![recipe], &bundle, &*source, sample, cx, None)?.pop();
            made.map(|(_, made)| Arc::unwrap_or_clone(made)).ok_or_else(|| TaskError::new("Generate", "no answer"))
        }))
    }

    fn arrived(&self, state: &mut State, _: &Arc<Prediction>) {
        state.results.list_made(self, true);
    }
}

impl Computes for StoredKey {
    fn job(&self, state: &State, services: &SharedServices) -> Option<Job<Keyed>> {
        let (services, touch) = (services.clone(), self.0);
        let bundles = state.library.bundles.clone();
        let runtime = state.settings.runtime;
        let sample = state.results.samples.get(&touch.pair)?.clone();
        // Only sensors that some bundle starts from.
        let starts = bundles.iter().filter_map(|bundle| bundle.ends(&sample.rig)?.ok()).map(|ends| ends.input);
        let inputs: BTreeSet<SensorId> = starts.collect();
        Some(Job::new(Lane::Files, "Look for earlier predictions", move |_| {
            let pictures = inputs.iter().filter_map(|input| sample.pad(touch.finger)?.picture(*input));
            let found = pictures.flat_map(|picture| services.stored(&bundles, runtime, touch, &picture));
            Ok(found.map(|(key, made)| (key, Arc::new(made))).collect())
        }))
    }

    /// Shows the one used last where the settings name none of them, unless something is shown already.
    fn arrived(&self, state: &mut State, found: &Arc<Keyed>) {
        state.results.looked_up.insert(self.0);
        let nothing = results::shown(state, self.0).is_none();
        for (key, made) in found.iter() {
            if !state.results.predictions.contains(key) {
                keep_prediction(state, key.clone(), made.clone(), nothing);
            }
        }
    }
}

/// Makes `recipes`, all of one pair and bundle. A finger without a GelSlim image is left out where another has one.
/// `sample` is the pair, if it is loaded; `onlooker` sees pictures on the way.
///
/// # Errors
/// If no finger has a GelSlim image, the pair or the model cannot be loaded or run, or the job was told to stop.
pub(crate) fn generate(
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
    let (engine, config) = (first.runtime, first.config);
    let touched = |recipe: PredictionKey| {
        let touch = sample.pad(recipe.touch.finger)?;
        let size = touch.depth().map_or([0, 0], |bubble| bubble.imprint.size());
        Some((recipe, (touch.picture(input)?, size)))
    };
    // One picture for each finger, whatever the number of predictions: it is encoded once.
    let mut pictures: BTreeMap<PadId, (Cow<'_, RgbGrid>, [usize; 2])> = BTreeMap::new();
    let mut keys: Vec<PredictionKey> = Vec::new();
    for (key, found) in recipes.into_iter().filter_map(touched) {
        pictures.entry(key.touch.finger).or_insert(found);
        keys.push(key);
    }
    let wanted = |key: &PredictionKey| {
        let (picture, size) = &pictures[&key.touch.finger];
        models::GenerateInput { difference: picture, seed: key.config.seed, size: *size }
    };
    let wanted: Vec<models::GenerateInput<'_>> = keys.iter().map(wanted).collect();
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

/// Asks for the predictions of a touch that were made before this start of the program.
pub(crate) fn want_stored(wants: &mut Demands<'_>, finger: PadId, touch: TouchKey) {
    let state = wants.state;
    if results::can_start(state, finger) {
        wants.ask_unless(state.results.looked_up.contains(&touch), StoredKey(touch));
    }
}

/// The prediction of a finger that nobody looked at when the other one's was made.
pub(crate) fn want_other_finger(wants: &mut Demands<'_>, finger: PadId) {
    let state = wants.state;
    let made = state.rig().pads().filter(|pad| *pad != finger).find_map(|pad| results::chosen(state, pad));
    let (Some(touch), Some(made)) = (state.touch_key(finger), made) else { return };
    let looked_up = state.results.looked_up.contains(&touch);
    let recipe = PredictionKey { touch, ..made.clone() };
    if !state.settings.generate.both_fingers || !looked_up || state.results.predictions.contains(&recipe) {
        return;
    }
    let under_way = state.tasks.generating(&recipe).is_some();
    if state.library.bundle(&recipe.bundle).is_some() && results::can_start(state, finger) && !under_way {
        wants.ask(recipe);
    }
}

/// Keeps a prediction of the open data set; with `in_front` it is shown where the settings name none that is there.
pub(crate) fn keep_prediction(state: &mut State, recipe: PredictionKey, made: Arc<Prediction>, in_front: bool) {
    if state.library.open.as_ref().is_none_or(|open| open.seq != recipe.touch.pair.dataset) {
        return;
    }
    let results = &mut state.results;
    let bytes = PredictionKey::bytes(&made);
    results.predictions.insert(recipe.clone(), made, bytes);
    results.list_made(&recipe, in_front);
}
