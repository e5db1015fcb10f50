//! Raw predictions: those kept on the disk, those that a pane needs, and those of several seeds.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::super::keys::{Bits64, Sampler, Spacing};
use super::super::services::{DataSource, Services};
use super::preview::Onlooker;
use super::{Computes, Demands, Job, Lane, Results, SharedServices, State, TouchKey};
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::ensemble::seeds;
use touch2touch_core::grid::RgbGrid;
use touch2touch_core::rig::{PadId, SensorId};
use touch2touch_core::sample::Sample;
use touch2touch_work::bundles::BundleInfo;
use touch2touch_work::error::TaskError;
use touch2touch_work::infer::engine::EngineChoice;
use touch2touch_work::job::JobCx;
use touch2touch_work::models;
use touch2touch_work::prediction::Prediction;
use touch2touch_work::recipe::Recipe;

/// Everything that decides a prediction.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PredictionKey {
    /// The touch whose GelSlim image is the condition.
    pub touch: TouchKey,
    /// The bundle's identity (its digest): a changed bundle is another recipe.
    pub bundle: Arc<str>,
    /// Denoising steps asked for.
    pub steps: u32,
    /// Seed of the noise.
    pub seed: u64,
    /// The sampler.
    pub sampler: Sampler,
    /// DDIM's noise share, 0..1.
    pub eta: Bits64,
    /// The training steps visited.
    pub spacing: Spacing,
    /// Scale of the guidance; 1 is none.
    pub guidance: Bits64,
    /// The model runtime: two of them round differently.
    pub runtime: EngineChoice,
}

impl PredictionKey {
    /// The recipe of a touch with a bundle, a runtime and the choices of one generation.
    pub fn new(touch: TouchKey, bundle: Arc<str>, runtime: EngineChoice, config: &GenerateConfig) -> Self {
        Self {
            touch,
            bundle,
            steps: config.steps,
            seed: config.seed,
            sampler: config.sampler,
            eta: config.eta.into(),
            spacing: config.spacing,
            guidance: config.guidance.into(),
            runtime,
        }
    }

    /// The prediction of a touch by a recipe; `None` where it names no generator.
    pub(crate) fn of(touch: TouchKey, recipe: &Recipe) -> Option<Self> {
        let (model, config) = recipe.generator.as_ref()?;
        Some(Self::new(touch, model.id.clone(), recipe.engine, config))
    }

    /// The recipes that differ from it in their seeds alone: `count` of them, from its own on.
    pub(crate) fn with_seeds(&self, count: usize) -> Vec<Self> {
        seeds(self.seed, count).into_iter().map(|seed| Self { seed, ..self.clone() }).collect()
    }

    /// The choices of one generation.
    pub fn config(&self) -> GenerateConfig {
        GenerateConfig {
            steps: self.steps,
            eta: self.eta.get(),
            seed: self.seed,
            sampler: self.sampler,
            spacing: self.spacing,
            guidance: self.guidance.get(),
        }
    }
}

impl Computes for PredictionKey {
    type Value = Prediction;

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

    fn bytes(prediction: &Prediction) -> usize {
        prediction.raw.channels.iter().map(|c| c.len() * 4).sum()
    }

    fn arrived(&self, state: &mut State, _: &Arc<Prediction>) {
        state.results.list_made(self, true);
    }
}

impl Results {
    /// Lists a prediction that was kept; with `in_front` it is shown where the settings name none that is there.
    pub(super) fn list_made(&mut self, recipe: &PredictionKey, in_front: bool) {
        let made = self.made.entry(recipe.touch).or_default();
        made.retain(|other| other != recipe);
        made.push(recipe.clone());
        self.shown.made(recipe, in_front);
        // Old predictions may have left the cache to make room.
        let kept = &self.predictions;
        self.made.values_mut().for_each(|list| list.retain(|recipe| kept.contains(recipe)));
        self.shown.retain(kept);
    }
}

/// A prediction with one of several seeds.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SeedKey(pub PredictionKey);

impl Computes for SeedKey {
    type Value = Prediction;

    fn job(&self, state: &State, services: &SharedServices) -> Option<Job<Prediction>> {
        self.0.job(state, services)
    }

    fn arrived(&self, state: &mut State, made: &Arc<Prediction>) {
        // A seed among several does not push away what is looked at.
        state.keep_prediction(self.0.clone(), made.clone(), false);
    }
}

/// The predictions of a touch that lie on the disk from before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StoredKey(pub TouchKey);

impl Computes for StoredKey {
    type Value = Keyed;

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

    /// Where the settings name none of them, the one used last is shown, unless something is already.
    fn arrived(&self, state: &mut State, found: &Arc<Keyed>) {
        state.results.looked_up.insert(self.0);
        let nothing = state.shown(self.0).is_none();
        for (key, made) in found.iter() {
            if !state.results.predictions.contains(key) {
                state.keep_prediction(key.clone(), made.clone(), nothing);
            }
        }
    }
}

impl Demands<'_> {
    /// What was made of a touch before this start of the program.
    pub(crate) fn stored(&mut self, finger: PadId, touch: TouchKey) {
        let state = self.state;
        if state.can_start(finger) {
            self.ask_unless(state.results.looked_up.contains(&touch), StoredKey(touch));
        }
    }

    /// The prediction of a finger that nobody looked at when the other one's was made.
    pub(crate) fn other_finger(&mut self, finger: PadId) {
        let state = self.state;
        let made = state.rig().pads().filter(|pad| *pad != finger).find_map(|pad| state.chosen(pad));
        let (Some(touch), Some(made)) = (state.touch_key(finger), made) else { return };
        let looked_up = state.results.looked_up.contains(&touch);
        let recipe = PredictionKey { touch, ..made.clone() };
        if !state.settings.generate.both_fingers || !looked_up || state.results.predictions.contains(&recipe) {
            return;
        }
        let under_way = state.tasks.generating(&recipe).is_some();
        if state.library.bundle(&recipe.bundle).is_some() && state.can_start(finger) && !under_way {
            self.ask(recipe);
        }
    }
}

/// Predictions with their keys.
pub(crate) type Keyed = Vec<(PredictionKey, Arc<Prediction>)>;

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
        models::GenerateInput { difference: picture, seed: key.seed, size: *size }
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
