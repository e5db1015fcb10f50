//! Starting predictions.

use super::super::effect::Effect;
use super::super::error::TaskError;
use super::super::keys::Recipe;
use super::super::library::BundleKind;
use super::super::state::{Absent, State};
use super::save_settings;
use crate::domain::sensor::Finger;

/// Starts a prediction for each finger asked for; one that exists is shown instead.
pub(super) fn generate(state: &mut State, new_seed: bool, effects: &mut Vec<Effect>) {
    if let Err(absent) = state.can_generate() {
        return state.log.error(&refusal(absent));
    }
    if new_seed || !state.settings.generate.seed_locked {
        state.settings.generate.seed = next_seed(state.settings.generate.seed);
        save_settings(state, effects);
    }
    let fingers: &[Finger] =
        if state.settings.generate.both_fingers { &Finger::BOTH } else { &[state.selection.finger] };
    let mut possible = 0;
    for finger in fingers {
        // A finger without a GelSlim image is left out; while the sample loads, the job finds out.
        if state.sample().ready().is_some() && state.gelslim(*finger).ready().is_none() {
            continue;
        }
        possible += 1;
        start(state, *finger, effects);
    }
    if possible == 0 {
        state.log.error(&refusal(Absent::NoGelSlim));
    }
}

fn refusal(absent: Absent) -> TaskError {
    TaskError::new("Generate", absent.text().trim_end_matches('.'))
}

fn start(state: &mut State, finger: Finger, effects: &mut Vec<Effect>) {
    let Ok(bundle) = state.bundle(BundleKind::Generator).cloned() else { return };
    let (Some(touch), Some(open)) = (state.touch_key(finger), &state.library.open) else { return };
    let settings = &state.settings.generate;
    let recipe = Recipe {
        touch,
        bundle: bundle.id.clone(),
        steps: settings.steps,
        seed: settings.seed,
        sampler: settings.sampler,
        eta: settings.eta.into(),
        runtime: state.settings.runtime,
    };
    if state.results.predictions.contains(&recipe) {
        state.results.chosen.insert(touch, recipe);
        return;
    }
    if state.tasks.generating(&recipe).is_some_and(|(_, task)| !task.cancelling) {
        return;
    }
    let (source, sample) = (open.source.clone(), state.results.samples.get(&touch.pair).cloned());
    let title = format!("Generate {} {}", state.pair_name(), finger.name());
    let ticket = state.tasks.start(title, Some(recipe.clone()));
    effects.push(Effect::Generate { ticket, recipe, bundle, source, sample });
}

/// The seed after `seed`: scattered, so that neighbours share nothing, and short enough to be read out.
///
/// Source: the finaliser of SplitMix64 (Steele et al. 2014), cut to 32 bits.
fn next_seed(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) >> 32
}
