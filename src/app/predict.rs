//! The room of predictions: starting them, choosing among them, and the refit of their range.

mod recipe;
pub(super) mod refit;

use super::effect::Effect;
use super::keys::PredictionKey;
use super::settings;
use super::state::{Absent, State};
use touch2touch_core::rig::{PadId, Text};
use touch2touch_work::bundles::BundleKind;
use touch2touch_work::error::TaskError;

/// What can happen to predictions.
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
                state.pick(recipe);
            }
        }
    }
}

/// Starts the predictions of the fingers that are looked at, in one go; one that exists is shown instead.
fn generate(state: &mut State, new_seed: bool, effects: &mut Vec<Effect>) {
    if let Err(absent) = state.can_generate() {
        return state.log.error(&refusal(absent));
    }
    if new_seed || !state.settings.generate.seed_locked {
        state.settings.generate.seed = next_seed(state.settings.generate.seed);
        settings::save(state, effects);
    }
    same_seed(state, effects);
}

/// The same with the seed as it is.
pub(super) fn same_seed(state: &mut State, effects: &mut Vec<Effect>) {
    if let Err(absent) = state.can_generate() {
        return state.log.error(&refusal(absent));
    }
    // A finger without a GelSlim image is left out; while the sample loads, the job finds out.
    let loaded = state.sample().ready().is_some();
    let mut fingers = state.fingers_to_generate();
    fingers.retain(|finger| !loaded || state.can_start(*finger));
    if fingers.is_empty() {
        return state.log.error(&refusal(Absent::NoInput));
    }
    start(state, &fingers, effects);
}

fn refusal(absent: Absent) -> TaskError {
    TaskError::new("Generate", absent.text().trim_end_matches('.'))
}

fn start(state: &mut State, fingers: &[PadId], effects: &mut Vec<Effect>) {
    let Ok(bundle) = state.bundle(BundleKind::Generator).cloned() else { return };
    let (Some(pair), Some(open)) = (state.pair_key(), &state.library.open) else { return };
    let (source, sample) = (open.source.clone(), state.results.samples.get(&pair).cloned());
    let mut recipes: Vec<PredictionKey> = Vec::new();
    for finger in fingers {
        let Some(recipe) = state.recipe(pair.finger(*finger)) else { continue };
        state.unpick(recipe.touch);
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
    let ticket = state.tasks.start(title, recipes.clone());
    effects.push(Effect::Generate { ticket, recipes, bundle, source, sample });
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
