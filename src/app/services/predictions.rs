//! Predictions of the program: from the disk where they were made before, else by the model.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use strum::IntoEnumIterator as _;

use super::super::error::TaskError;
use super::super::jobs::{JobCx, compute};
use super::super::keys::{Recipe, ShiftMode, TouchKey};
use super::super::library::BundleInfo;
use super::super::results::{Prediction, Preview};
use super::super::settings::RuntimeChoice;
use super::live::{LiveServices, lock, open_bundle};
use super::{GenerateItem, Generated};
use crate::domain::diffusion::Progress;
use crate::domain::grid::RgbGrid;
use crate::domain::postprocess::{ColorChain, DepthChain, RawPrediction};
use crate::infer::bundle::GeneratorSpec;
use crate::infer::engine::{EngineKind, resolve};
use crate::infer::generator::{GenerateError, Generator, Item, Observer};
use crate::infer::recipe::{self, input_digest};

/// Predictions of one touch that are read back; older ones stay on the disk.
const LISTED: usize = 16;

type Chains = (BTreeMap<ShiftMode, Result<DepthChain, String>>, Option<ColorChain>);

fn chains(spec: &GeneratorSpec) -> Chains {
    let depth = ShiftMode::iter().map(|mode| (mode, spec.depth_chain(mode).map_err(|err| err.to_string()))).collect();
    (depth, spec.color_chain())
}

/// The recipe on the disk: what the recipe of the studio stands for on this machine.
fn stored_recipe(item: &GenerateItem<'_>, input: String, bundle: &BundleInfo, engine: EngineKind) -> recipe::Recipe {
    recipe::Recipe::new(input, bundle.id.as_ref().to_owned(), engine, &item.recipe.config())
}

pub(super) fn generate<'i>(
    services: &LiveServices,
    bundle: &BundleInfo,
    items: &'i [GenerateItem<'i>],
    cx: &JobCx,
) -> Result<Vec<Generated>, TaskError> {
    let what = format!("Generate with {}", bundle.name);
    let fail = |err: GenerateError| match err {
        GenerateError::Cancelled => TaskError::cancelled(&what),
        err => TaskError::from_error(&what, &err),
    };
    let Some(first) = items.first() else { return Ok(Vec::new()) };
    let runtime = first.recipe.runtime;
    let engine = resolve(runtime.into()).map_err(|err| fail(err.into()))?;
    // Two fingers of one sample, or many seeds of one image: each image is looked at once.
    let mut images: Vec<(&RgbGrid, String)> = Vec::new();
    let mut image_of =
        |difference: &'i RgbGrid| match images.iter().position(|(known, _)| std::ptr::eq(*known, difference)) {
            Some(at) => at,
            None => {
                images.push((difference, input_digest(difference)));
                images.len() - 1
            }
        };
    let image: Vec<usize> = items.iter().map(|item| image_of(item.difference)).collect();
    let keys: Vec<recipe::Recipe> =
        items.iter().zip(&image).map(|(item, at)| stored_recipe(item, images[*at].1.clone(), bundle, engine)).collect();
    let mut kept: Vec<Option<(RawPrediction, f64)>> = match &services.store {
        Some(store) => {
            let store = lock(store);
            keys.iter().map(|key| store.get(key).map(|found| (found.raw, found.seconds))).collect()
        }
        None => vec![None; items.len()],
    };
    let fresh: Vec<usize> = (0..items.len()).filter(|at| kept[*at].is_none()).collect();

    if fresh.is_empty() {
        // Nothing has to be loaded to show what is there.
        let (chains, color) = open_bundle(&what, bundle)?.generator().map(chains).unwrap_or_default();
        let answer = |(raw, seconds)| Generated {
            raw,
            chains: chains.clone(),
            color,
            runtime: engine.label().into(),
            kept: Some(seconds),
        };
        return Ok(kept.into_iter().flatten().map(answer).collect());
    }
    let mut loaded = lock(&services.generator);
    let key = (bundle.id.clone(), runtime);
    if loaded.as_ref().is_none_or(|(k, _)| *k != key) {
        cx.progress(0, first.recipe.steps.into(), "loading the model");
        // Before the new one is loaded, so that both are never in memory.
        *loaded = None;
        let checked = open_bundle(&what, bundle)?;
        *loaded = Some((key, Generator::open(&checked, runtime.into()).map_err(fail)?));
    }
    let Some((_, generator)) = loaded.as_mut() else { return Err(TaskError::new(what, "no model is loaded")) };
    let (chains, color) = chains(generator.spec());
    let label = generator.engine().label();
    let begin = std::time::Instant::now();
    let differences: Vec<&RgbGrid> = images.iter().map(|(difference, _)| *difference).collect();
    let wanted: Vec<Item> = fresh.iter().map(|at| Item { image: image[*at], seed: items[*at].recipe.seed }).collect();
    let shown: Vec<&GenerateItem<'_>> = fresh.iter().map(|at| &items[*at]).collect();
    let mut follow = Follow { cx, items: &shown, chains: &chains };
    let made = generator.run(&differences, &wanted, &first.recipe.config(), &mut follow).map_err(fail)?;
    let each = begin.elapsed().as_secs_f64() / fresh.len() as f64;
    for (at, raw) in fresh.iter().zip(made) {
        if let Some(store) = &services.store
            && let Err(err) = lock(store).put(&keys[*at], &raw, each)
        {
            log::warn!("a prediction could not be kept on the disk: {err}");
        }
        kept[*at] = Some((raw, each));
    }
    let answer = |(at, made): (usize, Option<(RawPrediction, f64)>)| {
        let (raw, seconds) = made?;
        let kept = (!fresh.contains(&at)).then_some(seconds);
        Some(Generated { raw, chains: chains.clone(), color, runtime: label.to_owned(), kept })
    };
    Ok(kept.into_iter().enumerate().filter_map(answer).collect())
}

/// Progress, Cancel and previews of a run.
struct Follow<'a> {
    cx: &'a JobCx,
    items: &'a [&'a GenerateItem<'a>],
    chains: &'a BTreeMap<ShiftMode, Result<DepthChain, String>>,
}

impl Observer for Follow<'_> {
    fn progress(&mut self, p: Progress) -> ControlFlow<()> {
        self.cx.progress(p.step.into(), p.of.into(), format!("step {} of {}", p.step, p.of));
        if self.cx.cancel.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn wants_preview(&mut self, after: Progress, item: usize) -> bool {
        self.items.get(item).is_some_and(|item| self.cx.wants_preview(item.recipe.touch, after.step).is_some())
    }

    fn preview(&mut self, after: Progress, item: usize, raw: RawPrediction) {
        let Some(item) = self.items.get(item) else { return };
        let Some(shift) = self.cx.wants_preview(item.recipe.touch, after.step) else { return };
        let Some(Ok(chain)) = self.chains.get(&shift) else { return };
        if let Ok(depth) = compute::in_metres(chain, &raw, item.size) {
            let recipe = item.recipe.clone();
            self.cx.preview(Preview { recipe, step: after.step, of: after.of, depth });
        }
    }
}

pub(super) fn stored(
    services: &LiveServices,
    bundles: &[BundleInfo],
    runtime: RuntimeChoice,
    touch: TouchKey,
    difference: &RgbGrid,
) -> Vec<Prediction> {
    let Some(store) = &services.store else { return Vec::new() };
    let found = lock(store).of_input(&input_digest(difference), LISTED);
    let engine = resolve(runtime.into()).ok();
    let mut opened: BTreeMap<&str, Option<Chains>> = BTreeMap::new();
    let mut predictions = Vec::new();
    // Oldest first: the last one is the one shown.
    for stored in found.into_iter().rev() {
        let Some(bundle) = bundles.iter().find(|bundle| *bundle.id == *stored.recipe.bundle) else { continue };
        let chains = opened.entry(&bundle.id).or_insert_with(|| {
            let checked = open_bundle("Look for earlier predictions", bundle).ok()?;
            checked.generator().map(chains)
        });
        let Some((chains, color)) = chains.clone() else { continue };
        let runtime = match stored.recipe.engine {
            made if Some(made) == engine => runtime,
            EngineKind::Rten => RuntimeChoice::Rten,
            EngineKind::Ort => RuntimeChoice::Ort,
        };
        let recipe = Recipe::new(touch, bundle.id.clone(), runtime, &stored.recipe.config());
        let (label, seconds) = (stored.recipe.engine.label().to_owned(), stored.seconds);
        let output = Generated { raw: stored.raw, chains, color, runtime: label, kept: Some(seconds) };
        predictions.push(Prediction { recipe, output, seconds });
    }
    predictions
}
