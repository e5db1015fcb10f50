//! The room of predictions: starting them, choosing among them, and the refit of their range.

mod refit;

pub use refit::Refit;

use std::sync::Arc;

use super::effect::{Access, Effect, Task};
use super::keys::{Keyed, PredictionKey};
use super::results::prediction;
use super::source::Source;
use super::state::tasks::TaskKind;
use super::state::{Absent, State};
use super::{recipe, results, settings, tasks};
use touch2touch_core::rig::{PadId, Text};
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind};

/// A command to predictions.
#[derive(Clone, Debug)]
pub enum PredictCommand {
    /// Generates for the selected pair with the settings.
    Generate,
    /// Draws a new seed, then generates.
    GenerateNewSeed,
    /// Computes shift statistics of the open data set with the generator and its settings, then uses them.
    Refit,
    /// Shows another prediction of the same touch, until the settings ask for another one.
    Choose(PredictionKey),
}

pub(super) fn step(state: &mut State, command: PredictCommand, effects: &mut Vec<Effect>) {
    match command {
        PredictCommand::Generate => generate(state, false, effects),
        PredictCommand::GenerateNewSeed => generate(state, true, effects),
        PredictCommand::Refit => refit::start(state, effects),
        PredictCommand::Choose(recipe) => {
            if state.results.predictions.contains(&recipe) {
                results::pick(state, recipe);
            }
        }
    }
}

/// Starts the predictions of the fingers that are looked at, in one go; one that exists is shown instead.
fn generate(state: &mut State, new_seed: bool, effects: &mut Vec<Effect>) {
    if let Err(absent) = results::can_generate(state) {
        return state.log.error(&refusal(absent));
    }
    if new_seed || !state.settings.generate.seed_locked {
        state.settings.generate.seed = next_seed(state.settings.generate.seed);
        settings::save(state, effects);
    }
    same_seed(state, effects);
}

/// Starts the predictions with the seed as it is.
pub(super) fn same_seed(state: &mut State, effects: &mut Vec<Effect>) {
    if let Err(absent) = results::can_generate(state) {
        return state.log.error(&refusal(absent));
    }
    // A finger without a GelSlim image is left out; while the sample loads, the job finds out.
    let loaded = results::sample(state).ready().is_some();
    let mut fingers = results::fingers_to_generate(state);
    fingers.retain(|finger| !loaded || results::can_start(state, *finger));
    if fingers.is_empty() {
        return state.log.error(&refusal(Absent::NoInput));
    }
    start(state, &fingers, effects);
}

fn refusal(absent: Absent) -> TaskError {
    TaskError::new("Generate", absent.text().trim_end_matches('.'))
}

fn start(state: &mut State, fingers: &[PadId], effects: &mut Vec<Effect>) {
    let Ok(bundle) = recipe::bundle(state, BundleKind::Generator).cloned() else { return };
    let (Some(pair), Some(open)) = (state.pair_key(), &state.library.open) else { return };
    let (source, sample) = (open.source.clone(), state.results.samples.get(&pair).cloned());
    let mut recipes: Vec<PredictionKey> = Vec::new();
    for finger in fingers {
        let Some(recipe) = recipe::prediction(state, pair.finger(*finger)) else { continue };
        state.results.shown.unpick(recipe.touch);
        if state.results.predictions.contains(&recipe) {
            continue;
        }
        if state.tasks.generating(&recipe).is_none_or(|(_, task)| task.cancelling) {
            recipes.push(recipe);
        }
    }
    if recipes.is_empty() {
        return;
    }
    let names: Vec<Text> = recipes.iter().map(|recipe| state.finger_name(recipe.touch.finger)).collect();
    let title = format!("Generate {} {}", state.pair_name(), names.join(" and "));
    let task = Generate { recipes: recipes.clone(), bundle, source, sample };
    if let Some(task) = tasks::start(state, title, task, effects) {
        task.recipes = recipes;
    }
}

/// Makes predictions of one pair, all in one go.
pub struct Generate {
    recipes: Vec<PredictionKey>,
    bundle: BundleInfo,
    source: Arc<Source>,
    /// The pair, if it is loaded.
    sample: Option<Arc<Sample>>,
}

impl Task for Generate {
    type End = Keyed;
    const KIND: TaskKind = TaskKind::Generate;

    fn what(&self) -> String {
        format!("Generate with {}", self.bundle.name)
    }

    fn run(self, access: &Access, cx: &JobCx) -> Result<Keyed, TaskError> {
        let Self { recipes, bundle, source, sample } = self;
        let onlooker = Some(access.onlooker.clone());
        prediction::generate(&access.services, recipes, &bundle, &source, sample, cx, onlooker)
    }

    fn ended(made: &Keyed, state: &mut State, _: &mut Vec<Effect>) {
        for (key, prediction) in made {
            results::keep_prediction(state, key.clone(), prediction.clone(), true);
        }
    }
}

/// The seed after `seed`: scattered, so that neighbors share nothing, and of at most six digits, to be read out.
///
/// Source: the finaliser of SplitMix64 (Steele et al. 2014).
fn next_seed(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) % 1_000_000
}
