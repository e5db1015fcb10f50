//! [`Models`]: the models of a run of the program, loaded when first needed and kept loaded; predictions come from the
//! disk where they were made before.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use strum::IntoEnumIterator as _;

use crate::error::TaskError;
use crate::infer::bundle::GeneratorSpec;
use crate::infer::engine::{EngineChoice, EngineKind, resolve};
use crate::infer::generator::{GenerateError, Generator, Item, Observer};
use crate::infer::kept_key::{KeptKey, input_digest};
use crate::infer::mask::{ImprintError, MaskModel};
use crate::infer::store::Store;
use crate::io::catch_panic::{catch_panic, lock};
use crate::job::{JobCx, PreviewPicture};
use crate::steps::bundles::{BundleInfo, BundleKind, by_id};
use crate::steps::imprint::in_meters;
use crate::steps::prediction::{Chains, Prediction};
use touch2touch_core::contact::ContactMask;
use touch2touch_core::diffusion::{GenerateConfig, Progress};
use touch2touch_core::fit::Fitted;
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};
use touch2touch_core::postprocess::{ColorChain, RawPrediction, ShiftMode};

/// Predictions of one touch that are read back; older ones stay on the disk.
const LISTED: usize = 16;

/// A prediction to be made.
#[derive(Clone, Copy, Debug)]
pub struct GenerateInput<'a> {
    /// The condition: [`touch2touch_core::sample::PadTouch::picture`] of the sensor that the bundle starts from.
    pub difference: &'a RgbGrid,
    /// Seed of its noise.
    pub seed: u64,
    /// `[width, height]` of the bubble image, for pictures on the way; `[0, 0]` where there is none.
    pub size: [usize; 2],
}

/// A generator, the engine that runs it, and its choices.
#[derive(Clone, Copy, Debug)]
pub struct Generating<'a> {
    /// The bundle.
    pub bundle: &'a BundleInfo,
    /// The engine.
    pub engine: EngineChoice,
    /// The choices.
    pub config: &'a GenerateConfig,
}

/// A prediction from the disk, with the choices that made it.
#[derive(Clone, Debug)]
pub struct KeptPrediction {
    /// The engine to ask for to make it again.
    pub engine: EngineChoice,
    /// The choices.
    pub config: GenerateConfig,
    /// The prediction.
    pub prediction: Prediction,
}

/// A model in memory, with the bundle's identity and the engine it was loaded for.
type Loaded<T> = Option<((Arc<str>, EngineChoice), T)>;

/// The models of a run of the program. Shared by threads; each model runs on one at a time.
#[derive(Debug, Default)]
pub struct Models {
    store: Option<Mutex<Store>>,
    generator: Mutex<Loaded<Generator>>,
    mask_model: Mutex<Loaded<MaskModel>>,
    outputs: Mutex<BTreeMap<Arc<str>, OutputChains>>,
}

/// Runs what holds a model's lock while the engine computes. A thread of a pool takes on other work of the pool while it
/// waits for the engine's threads, and that work may want the same lock, which it then waits for for ever: such a thread has
/// another one do it.
pub fn outside_of_pools<T: Send>(job: impl FnOnce() -> T + Send) -> T {
    if rayon::current_thread_index().is_none() {
        return job();
    }
    let done = std::thread::scope(|scope| scope.spawn(job).join());
    done.unwrap_or_else(|panicked| std::panic::resume_unwind(panicked))
}

/// Output of a bundle: ways to meters, steps to a color picture, and the size of its condition.
#[derive(Clone, Debug, Default)]
struct OutputChains {
    chains: Chains,
    fit: Option<Arc<Fitted>>,
    color: Option<ColorChain>,
    input: [usize; 2],
}

impl OutputChains {
    fn prediction(
        self,
        raw: RawPrediction,
        bundle: &BundleInfo,
        engine: EngineKind,
        seconds: f64,
        kept: bool,
    ) -> Prediction {
        let Self { chains, fit, color, .. } = self;
        let engine = engine.label().to_owned();
        Prediction { raw, chains, fit, color, bundle: bundle.id.clone(), engine, seconds, kept }
    }
}

fn output_chains_of(spec: &GeneratorSpec, fit: Option<&Arc<Fitted>>) -> OutputChains {
    let chain = |mode| (mode, spec.depth_chain(mode).map_err(|err| err.to_string()));
    OutputChains {
        chains: Arc::new(ShiftMode::iter().map(chain).collect()),
        fit: fit.cloned(),
        color: spec.color_chain(),
        input: spec.input.sensor.size,
    }
}

/// The model of `key`, loaded by `load` if it is not there.
fn ready<T>(
    loaded: &mut Loaded<T>,
    key: (Arc<str>, EngineChoice),
    load: impl FnOnce() -> Result<T, TaskError>,
) -> Result<&mut T, TaskError> {
    if loaded.as_ref().is_none_or(|(known, _)| *known != key) {
        // Before the new one is loaded, so that both are never in memory.
        *loaded = None;
        *loaded = Some((key, load()?));
    }
    Ok(&mut loaded.as_mut().expect("it was just put there").1)
}

impl Models {
    /// Nothing is loaded yet. Predictions are kept in `store` and taken from it; `None` keeps none.
    pub fn new(store: Option<Store>) -> Self {
        Self { store: store.map(Mutex::new), ..Self::default() }
    }

    /// Further models, with the same kept predictions.
    #[must_use]
    pub fn beside(&self) -> Self {
        let again = |store: &Mutex<Store>| {
            let store = lock(store);
            Store::new(store.folder().to_owned(), store.budget())
        };
        Self { store: self.store.as_ref().map(again).map(Mutex::new), ..Self::default() }
    }

    /// Forgets everything that was loaded: a bug may have left it half changed.
    pub fn forget(&self) {
        *lock(&self.generator) = None;
        *lock(&self.mask_model) = None;
    }

    /// Sets what kept predictions may take, bytes.
    pub fn keep_at_most(&self, bytes: u64) {
        if let Some(store) = &self.store {
            lock(store).set_budget(bytes);
        }
    }

    /// The ways to meters that a generator's bundle offers; none for another kind.
    ///
    /// # Errors
    /// If the bundle cannot be opened.
    pub fn chains(&self, bundle: &BundleInfo) -> Result<Chains, TaskError> {
        Ok(self.outputs(bundle)?.chains)
    }

    fn outputs(&self, bundle: &BundleInfo) -> Result<OutputChains, TaskError> {
        if let Some(known) = lock(&self.outputs).get(&bundle.id) {
            return Ok(known.clone());
        }
        let opened = bundle.open(&format!("Open {}", bundle.name))?;
        Ok(opened.generator().map(|spec| self.output_chains_by(bundle, spec, opened.fit())).unwrap_or_default())
    }

    /// Output chains of a bundle that is open already.
    fn output_chains_by(&self, bundle: &BundleInfo, spec: &GeneratorSpec, fit: Option<&Arc<Fitted>>) -> OutputChains {
        lock(&self.outputs).entry(bundle.id.clone()).or_insert_with(|| output_chains_of(spec, fit)).clone()
    }

    /// Predictions; one answer for each, in order. What was made before is not made
    /// again.
    ///
    /// # Errors
    /// If the model cannot be loaded or run, the choices are not for this bundle, or the job was told to stop.
    pub fn predict(
        &self,
        generating: Generating<'_>,
        wanted: &[GenerateInput<'_>],
        cx: &JobCx,
    ) -> Result<Vec<Prediction>, TaskError> {
        self.make(self.store.as_ref(), generating, wanted, cx)
    }

    /// Predictions, where a picture that fails, or makes a model panic, does not take the others with it. `None` once
    /// told to stop.
    pub(crate) fn predict_each(
        &self,
        generating: Generating<'_>,
        wanted: &[GenerateInput<'_>],
        cx: &JobCx,
    ) -> Option<Vec<Result<Prediction, TaskError>>> {
        let what = || format!("Generate with {}", generating.bundle.name);
        let run = |wanted: &[GenerateInput<'_>]| {
            let predict = || self.predict(generating, wanted, cx);
            catch_panic(predict).unwrap_or_else(|message| Err(TaskError::panicked(what(), &message)))
        };
        let one = |wanted: &GenerateInput<'_>| {
            let made = run(std::slice::from_ref(wanted))?.pop();
            made.ok_or_else(|| TaskError::new(what(), "the generator returned no prediction"))
        };
        let made = match run(wanted) {
            Ok(made) => made.into_iter().map(Ok).collect(),
            Err(err) if err.is_cancelled() => return None,
            Err(_) => wanted.iter().map(one).collect(),
        };
        (!cx.cancel.is_cancelled()).then_some(made)
    }

    fn make(
        &self,
        store: Option<&Mutex<Store>>,
        generating: Generating<'_>,
        wanted: &[GenerateInput<'_>],
        cx: &JobCx,
    ) -> Result<Vec<Prediction>, TaskError> {
        let Generating { bundle, engine, config } = generating;
        let what = format!("Generate with {}", bundle.name);
        let fail = |err: GenerateError| match err {
            GenerateError::Cancelled => TaskError::cancelled(&what),
            err => TaskError::from_error(&what, &err),
        };
        if wanted.is_empty() {
            return Ok(Vec::new());
        }
        let kind = resolve(engine).map_err(|err| fail(err.into()))?;
        let (images, image) = distinct(wanted);
        let mut answers: Vec<Option<(RawPrediction, f64, bool)>> = vec![None; wanted.len()];
        let mut keys = Vec::new();
        if let Some(store) = store {
            let digests: Vec<String> = images.iter().map(|difference| input_digest(difference)).collect();
            let recipe = |(item, at): (&GenerateInput<'_>, &usize)| {
                let config = GenerateConfig { seed: item.seed, ..*config };
                KeptKey { input: digests[*at].clone(), bundle: bundle.id.to_string(), engine: kind, config }
            };
            keys = wanted.iter().zip(&image).map(recipe).collect();
            let store = lock(store);
            for (answer, key) in answers.iter_mut().zip(&keys) {
                *answer = store.get(key).map(|found| (found.raw, found.seconds, true));
            }
        }
        let fresh: Vec<usize> = (0..wanted.len()).filter(|at| answers[*at].is_none()).collect();
        let outputs = if fresh.is_empty() {
            // Nothing has to be loaded to show what is there.
            self.outputs(bundle)?
        } else {
            outside_of_pools(|| {
                let mut loaded = lock(&self.generator);
                let generator = ready(&mut loaded, (bundle.id.clone(), engine), || {
                    cx.progress(0, config.steps.into(), "loading the model");
                    open_generator(bundle, engine)
                })?;
                let outputs = self.output_chains_by(bundle, generator.spec(), generator.fit());
                let begin = std::time::Instant::now();
                let items: Vec<Item> =
                    fresh.iter().map(|&at| Item { image: image[at], seed: wanted[at].seed }).collect();
                let mut follow = Follow { cx, wanted, fresh: &fresh, chains: &outputs.chains };
                let made = generator.run(&images, &items, config, &mut follow).map_err(fail)?;
                let each = begin.elapsed().as_secs_f64() / fresh.len() as f64;
                for (&at, raw) in fresh.iter().zip(made) {
                    if let Some(store) = store
                        && let Err(err) = lock(store).put(&keys[at], &raw, each)
                    {
                        log::warn!("a prediction could not be kept on the disk: {err}");
                    }
                    answers[at] = Some((raw, each, false));
                }
                Ok::<_, TaskError>(outputs)
            })?
        };
        let prediction = |(raw, seconds, kept)| outputs.clone().prediction(raw, bundle, kind, seconds, kept);
        Ok(answers.into_iter().flatten().map(prediction).collect())
    }

    /// Loads a generator or a mask model, so that one that cannot be used is known before the first touch.
    ///
    /// # Errors
    /// If it cannot be loaded, or is of another kind.
    pub fn load(&self, bundle: &BundleInfo, engine: EngineChoice) -> Result<(), TaskError> {
        let key = (bundle.id.clone(), engine);
        let generator = || ready(&mut lock(&self.generator), key.clone(), || open_generator(bundle, engine)).map(drop);
        let mask_model =
            || ready(&mut lock(&self.mask_model), key.clone(), || open_mask_model(bundle, engine)).map(drop);
        match bundle.kind {
            BundleKind::Generator => outside_of_pools(generator),
            BundleKind::Mask => outside_of_pools(mask_model),
            kind @ BundleKind::Classifier => {
                Err(TaskError::new(format!("Open {}", bundle.name), format!("it is a {}", kind.name())))
            }
        }
    }

    /// Loads a generator and runs it once on two blank images, so that the first touch does not wait for memory and
    /// kernels; the result is not kept.
    ///
    /// # Errors
    /// As [`Self::predict`].
    pub fn warm_up(&self, generating: Generating<'_>) -> Result<Prediction, TaskError> {
        let Generating { bundle, config, .. } = generating;
        let [width, height] = self.outputs(bundle)?.input;
        let blank = RgbGrid::filled(width, height, [0.0; 3]);
        // Both fingers of a grasp go through the model together.
        let item = |seed| GenerateInput { difference: &blank, seed, size: [0, 0] };
        let both = [item(config.seed), item(config.seed.wrapping_add(1))];
        let made = self.make(None, generating, &both, &JobCx::unwatched())?.pop();
        made.ok_or_else(|| TaskError::new(format!("Generate with {}", bundle.name), "the model returned nothing"))
    }

    /// Predictions of an image that were made before and are kept on the disk, oldest first, as far as their bundle is
    /// among `bundles`. `engine` is the choice in force: what it stands for is said so. Never fails: what cannot be
    /// read is not there.
    pub fn kept(&self, bundles: &[BundleInfo], engine: EngineChoice, difference: &RgbGrid) -> Vec<KeptPrediction> {
        let Some(store) = &self.store else { return Vec::new() };
        let found = lock(store).of_input(&input_digest(difference), LISTED);
        let in_force = resolve(engine).ok();
        let mut kept = Vec::new();
        // Oldest first: the last one is the one shown.
        for stored in found.into_iter().rev() {
            let Some(bundle) = by_id(bundles, &stored.recipe.bundle) else { continue };
            let Ok(outputs) = self.outputs(bundle) else { continue };
            let engine = match stored.recipe.engine {
                made if Some(made) == in_force => engine,
                made => made.into(),
            };
            let prediction = outputs.prediction(stored.raw, bundle, stored.recipe.engine, stored.seconds, true);
            kept.push(KeptPrediction { engine, config: stored.recipe.config, prediction });
        }
        kept
    }

    /// Contact mask by the mask model for an imprint in meters, with what it is made of in the end.
    ///
    /// # Errors
    /// If the model cannot be loaded or run.
    pub fn mask(
        &self,
        bundle: &BundleInfo,
        engine: EngineChoice,
        imprint: &DepthMap,
    ) -> Result<ContactMask, TaskError> {
        self.with_mask_model(bundle, engine, |model| model.contact(imprint))
    }

    /// The mask model's probability of contact at each pixel of its own grid, and from which on it calls that contact.
    ///
    /// # Errors
    /// As [`Self::mask`].
    pub fn probability(
        &self,
        bundle: &BundleInfo,
        engine: EngineChoice,
        imprint: &DepthMap,
    ) -> Result<(Grid<f32>, f32), TaskError> {
        self.with_mask_model(bundle, engine, |model| Ok((model.probability(imprint)?, model.least_probability())))
    }

    fn with_mask_model<T: Send>(
        &self,
        bundle: &BundleInfo,
        engine: EngineChoice,
        ask: impl FnOnce(&mut MaskModel) -> Result<T, ImprintError> + Send,
    ) -> Result<T, TaskError> {
        outside_of_pools(|| {
            let mut loaded = lock(&self.mask_model);
            let model = ready(&mut loaded, (bundle.id.clone(), engine), || open_mask_model(bundle, engine))?;
            ask(model).map_err(|err| TaskError::from_error(format!("Mask with {}", bundle.name), &err))
        })
    }
}

fn open_generator(bundle: &BundleInfo, engine: EngineChoice) -> Result<Generator, TaskError> {
    let what = format!("Generate with {}", bundle.name);
    Generator::open(&bundle.open(&what)?, engine).map_err(|err| TaskError::from_error(&what, &err))
}

fn open_mask_model(bundle: &BundleInfo, engine: EngineChoice) -> Result<MaskModel, TaskError> {
    let what = format!("Mask with {}", bundle.name);
    MaskModel::open(&bundle.open(&what)?, engine).map_err(|err| TaskError::from_error(&what, &err))
}

/// The images of some items, each once (both fingers of a grasp have their own, many seeds share one), and which is
/// whose.
fn distinct<'a>(wanted: &[GenerateInput<'a>]) -> (Vec<&'a RgbGrid>, Vec<usize>) {
    let mut images: Vec<&RgbGrid> = Vec::new();
    let mut of = |difference: &'a RgbGrid| match images.iter().position(|known| std::ptr::eq(*known, difference)) {
        Some(at) => at,
        None => {
            images.push(difference);
            images.len() - 1
        }
    };
    let image = wanted.iter().map(|item| of(item.difference)).collect();
    (images, image)
}

/// Progress, Cancel and previews of a run.
struct Follow<'a> {
    cx: &'a JobCx,
    wanted: &'a [GenerateInput<'a>],
    /// Positions in `wanted` of the predictions that are made.
    fresh: &'a [usize],
    chains: &'a Chains,
}

impl Follow<'_> {
    fn shift(&self, after: Progress, item: usize) -> Option<(usize, ShiftMode)> {
        let at = *self.fresh.get(item)?;
        Some((at, self.cx.previews()?.wants(at, after.step)?))
    }
}

impl Observer for Follow<'_> {
    fn progress(&mut self, p: Progress) -> ControlFlow<()> {
        self.cx.progress(p.step.into(), p.of.into(), format!("step {} of {}", p.step, p.of));
        if self.cx.cancel.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn wants_preview(&mut self, after: Progress, item: usize) -> bool {
        self.shift(after, item).is_some()
    }

    fn preview(&mut self, after: Progress, item: usize, raw: RawPrediction) {
        let Some((at, shift)) = self.shift(after, item) else { return };
        let Some(Ok(chain)) = self.chains.get(&shift) else { return };
        if let (Ok(depth), Some(previews)) = (in_meters(chain, &raw, self.wanted[at].size), self.cx.previews()) {
            previews.show(at, PreviewPicture { step: after.step, of: after.of, depth });
        }
    }
}
