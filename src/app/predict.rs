//! The room of predictions: starting them, choosing among them, and the refit of their range.

use std::path::PathBuf;
use std::sync::Arc;

use super::effect::{Access, Effect};
use super::keys::{ImprintSource, Keyed, PredictionKey, ShiftMode};
use super::results::{self, prediction};
use super::state::tasks::TaskKind;
use super::state::{Absent, State};
use super::tasks::{self, Start};
use super::{recipe, settings};
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::{PadId, Text};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::statistics::ShiftStatistics;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::pairs;
use touch2touch_pipeline::scores::statistics::{PAIRS, StatisticsSetup, statistics};
use touch2touch_pipeline::steps::bundles::BundleKind;

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
        PredictCommand::Generate => same_seed(state, effects),
        PredictCommand::GenerateNewSeed => {
            if results::can_generate(state).is_ok() {
                state.settings.generate.seed = next_seed(state.settings.generate.seed);
                settings::save(state, effects);
            }
            same_seed(state, effects);
        }
        PredictCommand::Refit => refit(state, effects),
        PredictCommand::Choose(recipe) => {
            if state.results.predictions.contains(&recipe) {
                results::pick(state, recipe);
            }
        }
    }
}

/// Starts the predictions of the fingers that are looked at, in one go; one that exists is shown instead.
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
    let start = Start { what: format!("Generate with {}", bundle.name), ..Start::new(TaskKind::Generate, title) };
    let keys = recipes.clone();
    let run = move |access: &Access, cx: &JobCx| {
        prediction::generate(&access.services, keys, &bundle, &source, sample, cx, Some(access.onlooker.clone()))
    };
    if let Some(task) = tasks::start(state, start, effects, run, generated) {
        task.recipes = recipes;
    }
}

/// Predictions of one pair were made.
pub fn generated(made: &Keyed, state: &mut State, _: &mut Vec<Effect>) {
    for (key, prediction) in made {
        results::keep_prediction(state, key.clone(), prediction.clone(), true);
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

/// The job on screen.
const STATISTICS: &str = "Shift statistics";

/// Starts a pass over the data set, unless one is under way.
fn refit(state: &mut State, effects: &mut Vec<Effect>) {
    if state.tasks.running.values().any(|task| task.kind == TaskKind::Refit && !task.cancelling) {
        return;
    }
    let ready = results::can_generate(state).and_then(|()| recipe::bundle(state, BundleKind::Generator));
    if let Err(absent) = ready {
        return state.log.error(&TaskError::new(STATISTICS, absent.text().trim_end_matches('.')));
    }
    let Some(source) = state.library.open.as_ref().map(|open| open.source.clone()) else { return };
    let recipe = recipe::in_force(state, ImprintSource::Predicted);
    let start = Start::new(TaskKind::Refit, format!("{STATISTICS} of {}", source.dataset.title));
    let run = move |access: &Access, cx: &JobCx| {
        let pairs = pairs::spread(source.dataset.index.pairs.len(), Some(PAIRS));
        let setup = StatisticsSetup {
            pairs: pairs.map(|at| PairId(at as u32)).collect(),
            fingers: source.dataset.rig.pad_list(),
            recipe,
            dataset: source.dataset.title.clone(),
        };
        let (found, _) = statistics(&setup, |pair| source.load(pair).map(Arc::new), &access.services.models, cx)?;
        let saved = access.services.save_statistics(&found)?;
        Ok((found, saved))
    };
    tasks::start(state, start, effects, run, refitted);
}

/// Statistics were made, and where they are kept: uses them.
pub fn refitted(
    (statistics, saved): &(ShiftStatistics, Option<PathBuf>),
    state: &mut State,
    effects: &mut Vec<Effect>,
) {
    let p = &statistics.provenance;
    match statistics.shift_for(&p.bundle, &p.bundle_hash) {
        Ok(shift) => {
            let place = saved.as_ref().map_or(String::new(), |file| format!(", kept in {}", file.display()));
            state.log.info(format!(
                "Shift statistics of {} touches of {} with {}{place}",
                statistics.touches, p.dataset, p.bundle
            ));
            state.settings.refit = Some(shift);
            state.settings.shift = ShiftMode::Refit(shift);
            settings::save(state, effects);
        }
        Err(err) => state.log.error(&TaskError::from_error(STATISTICS, &err)),
    }
}
