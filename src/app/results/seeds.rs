//! Several seeds of one touch: which, what is there of them, and what is missing.

use super::super::jobs::{Job, Lane};
use super::super::keys::{
    CloudKey, EnsembleKey, ImprintKey, ImprintSource, MaskKey, MetersKey, PoseKey, PredictionKey, SeedKey,
};
use super::super::pane::Demand;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::{Absent, Lookup, State};
use super::super::{recipe, results};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::PadId;
use touch2touch_work::ensemble::Ensemble;
use touch2touch_work::on_pad::OnPad;
use touch2touch_work::pose::PoseResult;

impl Computes for EnsembleKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Ensemble>> {
        let (results, shift) = (&state.results, self.shift);
        let meters = |recipe: &PredictionKey| results.imprints.get(&MetersKey(recipe.clone(), shift)).cloned();
        let predictions: Option<Vec<_>> = self.recipes.iter().map(|r| results.predictions.get(r).cloned()).collect();
        let imprints: Option<Vec<_>> = self.recipes.iter().map(meters).collect();
        let (predictions, imprints) = (predictions?, imprints?);
        let touch = self.touch;
        let sample = results.samples.get(&touch.pair)?.clone();
        Some(Job::new(Lane::Compute, "Spread of the seeds", move |_| {
            touch2touch_work::ensemble::ensemble(
                &predictions,
                &imprints,
                shift,
                OnPad { sample: &sample, pad: touch.finger },
            )
        }))
    }
}

/// The recipes of the ensemble of one finger: those of the settings, with the seeds from theirs on.
///
/// # Errors
/// Why nothing can be generated.
pub fn seed_recipes(state: &State, finger: PadId) -> Result<Vec<PredictionKey>, Absent> {
    results::can_generate(state)?;
    let touch = state.touch_key(finger).ok_or(Absent::NothingSelected)?;
    if results::sample(state).ready().is_some() && !results::can_start(state, finger) {
        return Err(Absent::NoInput);
    }
    let first = recipe::prediction(state, touch).ok_or(Absent::NoGenerator)?;
    if state.library.predicts_color(&first.bundle) {
        return Err(Absent::PredictsColor);
    }
    Ok(first.with_seeds(state.seeds.count))
}

/// True where seeds are being made for what is on screen: they were asked for, and some are missing.
pub fn seeds_running(state: &State) -> bool {
    let missing = |finger: &PadId| {
        let made = |recipe: &PredictionKey| state.results.predictions.contains(recipe);
        seed_recipes(state, *finger).is_ok_and(|recipes| !recipes.iter().all(made))
    };
    results::seeds_asked(state) && seed_fingers(state).iter().any(missing)
}

/// The imprint of one seed in meters, if it is there.
pub fn seed_imprint<'a>(state: &'a State, recipe: &PredictionKey) -> Option<&'a DepthMap> {
    state.results.imprints.get(&MetersKey(recipe.clone(), state.settings.shift)).map(|imprint| &**imprint)
}

/// The fingers whose seeds make a pose: both, or only the active one, as in generating.
pub(crate) fn seed_fingers(state: &State) -> Vec<PadId> {
    match state.settings.generate.both_fingers {
        true => state.rig().pads().filter(|f| seed_recipes(state, *f).is_ok()).collect(),
        false => vec![state.selection.finger],
    }
}

/// The cloud of one seed with the automatic masks; `Err` holds what is missing for it.
fn seed_cloud(state: &State, at: usize) -> Result<CloudKey, Vec<MaskKey>> {
    let imprint = |finger| {
        let recipe = seed_recipes(state, finger).ok()?.get(at)?.clone();
        Some(ImprintKey::Predicted(recipe, state.settings.shift))
    };
    results::automatic_cloud(
        state,
        seed_fingers(state).into_iter().filter_map(|finger| Some((finger, imprint(finger)?))),
    )
}

fn seed_pose_key(state: &State, at: usize) -> Option<PoseKey> {
    let tool = results::tool_name(state).ok()?.into();
    Some(PoseKey::of(seed_cloud(state, at).ok()?, tool, &recipe::in_force(state, ImprintSource::Predicted)))
}

/// The pose of each seed, where it is there.
pub fn seed_poses(state: &State) -> Vec<Option<&PoseResult>> {
    let pose = |at| state.results.poses.get(&seed_pose_key(state, at)?).map(|pose| &**pose);
    (0..state.seeds.count).map(pose).collect()
}

/// Why the seeds have no poses, if they cannot have any.
pub(crate) fn seed_pose_absent(state: &State) -> Option<Absent> {
    if let Err(absent) = results::tool_name(state) {
        return Some(absent);
    }
    let sample = results::sample(state).ready()?;
    let camera = |f: &PadId| sample.pad(*f).is_some_and(|t| t.camera().is_some());
    (!seed_fingers(state).iter().any(camera)).then_some(Absent::NoCamera)
}

/// The ensemble of what is there of one finger; `None` before the first seed.
pub(crate) fn ensemble_key(state: &State, finger: PadId) -> Option<EnsembleKey> {
    let there = |r: &PredictionKey| state.results.predictions.contains(r) && seed_imprint(state, r).is_some();
    let recipes: Vec<PredictionKey> = seed_recipes(state, finger).ok()?.into_iter().filter(there).collect();
    let touch = state.touch_key(finger)?;
    (!recipes.is_empty()).then_some(EnsembleKey { touch, recipes, shift: state.settings.shift })
}

/// Mean and spreads of the seeds that are there; the ensemble before while the next is computed.
pub fn ensemble(state: &State, finger: PadId) -> Lookup<'_, Ensemble> {
    let Some(key) = ensemble_key(state, finger) else { return Lookup::Absent(Absent::NoPrediction) };
    let mut before = key.clone();
    let before = || {
        while before.recipes.len() > 1 {
            before.recipes.pop();
            if let Some(found) = state.results.ensembles.get(&before) {
                return Some(found);
            }
        }
        None
    };
    state.look_or(Ok(Some(key)), before).value()
}

/// Asks for what the pane of the seeds shows and is not there, most urgent first.
pub(crate) fn want_seeds(wants: &mut Demands<'_>) {
    let state = wants.state;
    if !state.needs(Demand::Seeds) || results::sample(state).ready().is_none() {
        return;
    }
    let posed = seed_pose_absent(state).is_none();
    if posed {
        results::want_tool(wants);
    }
    let mut fingers = seed_fingers(state);
    if !fingers.contains(&state.selection.finger) {
        fingers.push(state.selection.finger);
    }
    let mut fresh = Vec::new();
    for at in 0..state.seeds.count {
        for finger in &fingers {
            let Ok(recipes) = seed_recipes(state, *finger) else { continue };
            let Some(recipe) = recipes.get(at) else { continue };
            if state.results.predictions.contains(recipe) {
                wants.ask(MetersKey(recipe.clone(), state.settings.shift));
            } else if results::seeds_asked(state) {
                fresh.push(SeedKey(recipe.clone()));
            }
        }
        match seed_cloud(state, at) {
            _ if !posed => {}
            Err(missing) => missing.into_iter().for_each(|mask| wants.ask(mask)),
            Ok(cloud) if !state.results.clouds.contains(&cloud) => wants.ask(cloud),
            Ok(_) => seed_pose_key(state, at).into_iter().for_each(|pose| wants.ask(pose)),
        }
    }
    if let Some(key) = ensemble_key(state, state.selection.finger) {
        wants.ask(key);
    }
    // What is there is evaluated before the next is made.
    for key in fresh {
        wants.ask_unless(false, key);
    }
}
