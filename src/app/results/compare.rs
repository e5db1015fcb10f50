//! Any two imprints of a touch against each other: what each side is, their figures and poses.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::{
    ComparisonKey, EstimateKey, ImprintKey, ImprintSource, MeanKey, PictureKey, PredictionKey, ShiftMode, TouchKey,
};
use super::super::pane::Demand;
use super::super::results::{Computes, Demands, gone};
use super::super::services::Services;
use super::super::state::settings::compare::{CompareChoice, CompareMode};
use super::super::state::{Absent, Lookup, State};
use super::super::{recipe, results};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_pipeline::compare::depict::{SubjectImprints, mean};
use touch2touch_pipeline::compare::subject::{MadeFrom, RecipeChange, Subject};
use touch2touch_pipeline::compare::{Comparison, between, tile_of};
use touch2touch_pipeline::steps::estimate::Estimate;
use touch2touch_pipeline::steps::pose::PoseResult;
use touch2touch_pipeline::steps::recipe::Recipe;

impl Computes for MeanKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<DepthMap>> {
        let meters = |made: &PredictionKey| {
            results::imprint_of(state, &ImprintKey::Predicted(made.clone(), self.shift)).ready().cloned()
        };
        let imprints: Vec<DepthMap> = self.recipes.iter().map(meters).collect::<Option<_>>()?;
        Some(Job::new(Worker::Compute, "Mean of the seeds", move |_| mean(&imprints.iter().collect::<Vec<_>>())))
    }
}

/// One side of a comparison, as the verb has it; `None` if something of it is not there.
fn imprints(state: &State, of: &ImprintKey) -> Option<SubjectImprints> {
    let estimate = match state.results.estimates.get(&EstimateKey::imprint(of)) {
        Some(known) => (**known).clone(),
        None => {
            let mut imprints = PerPad::default();
            imprints[of.touch().finger] = Some(results::imprint_of(state, of).ready()?.clone());
            Estimate::with_imprints(&Recipe::default(), imprints)
        }
    };
    let tile = match of {
        ImprintKey::Picture(touch) => Some(state.results.pictures.get(&PictureKey(*touch))?.tile.clone()),
        _ => None,
    };
    Some(SubjectImprints { estimate, tile })
}

impl Computes for ComparisonKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Comparison>> {
        let (touch, key) = (self.a.touch(), self.clone());
        let (mut a, mut b) = (imprints(state, &self.a)?, imprints(state, &self.b)?);
        let sample = state.results.samples.get(&touch.pair)?.clone();
        let source = state.library.open.as_ref()?.source.clone();
        Some(Job::new(Worker::Compute, "Compare A and B", move |_| {
            let tile = tile_of(&source.dataset, touch.pair.pair, &sample)?;
            for (side, of) in [(&mut a, &key.a), (&mut b, &key.b)] {
                if matches!(of, ImprintKey::Measured(_)) {
                    side.tile.clone_from(&tile);
                }
            }
            let finger = touch.finger;
            let a = a.of_pad(&sample, finger, tile.as_ref())?.ok_or_else(gone)?;
            let b = b.of_pad(&sample, finger, tile.as_ref())?.ok_or_else(gone)?;
            between(&a, &b, sample.scale)
        }))
    }
}

/// The side that shows a subject already.
fn side_of(subject: &Subject) -> Option<ImprintSource> {
    match subject {
        Subject::Measured => Some(ImprintSource::Measured),
        Subject::Predicted(change) if *change == RecipeChange::default() => Some(ImprintSource::Predicted),
        _ => None,
    }
}

/// The keys of the predictions that a subject of a touch is made of, and how they become meters; none of what is not made.
fn made_for(state: &State, subject: &Subject, touch: TouchKey) -> Result<(Vec<PredictionKey>, ShiftMode), Absent> {
    let recipes = match subject.made_from(|named| recipe::of_generator(state, named))? {
        MadeFrom::Measurement | MadeFrom::Picture => Vec::new(),
        MadeFrom::Prediction(recipe) => vec![recipe],
        MadeFrom::Mean(recipes) => recipes,
    };
    let shift = recipes.first().map_or(state.settings.shift, |recipe| recipe.shift);
    let keys: Vec<PredictionKey> = recipes.iter().filter_map(|recipe| PredictionKey::of(touch, recipe)).collect();
    if keys.first().is_some_and(|key| state.library.predicts_color(&key.bundle)) {
        return Err(Absent::PredictsColor);
    }
    Ok((keys, shift))
}

/// The imprint that a subject is of a finger.
///
/// # Errors
/// Why there is none.
pub fn subject_key(state: &State, subject: &Subject, finger: PadId) -> Result<ImprintKey, Absent> {
    let touch = state.touch_key(finger).ok_or(Absent::NothingSelected)?;
    // The ones that the other panes show, made by whatever settings.
    if let Some(side) = side_of(subject) {
        return results::imprint_key(state, side, finger);
    }
    match subject {
        Subject::Measured | Subject::Predicted(_) => {
            let (mut recipes, shift) = made_for(state, subject, touch)?;
            let recipe = recipes.pop().ok_or(Absent::NoSuchGenerator)?;
            Ok(ImprintKey::Predicted(recipe, shift))
        }
        Subject::Mean(..) => {
            let (recipes, shift) = made_for(state, subject, touch)?;
            Ok(ImprintKey::Mean(MeanKey { touch, recipes, shift }))
        }
        Subject::Stored => Ok(ImprintKey::Picture(touch)),
    }
}

/// The imprint that a subject is of a finger, meters, raw bubble orientation.
pub fn subject<'a>(state: &'a State, subject: &Subject, finger: PadId) -> Lookup<'a, DepthMap> {
    let key = match subject_key(state, subject, finger) {
        Ok(key) => key,
        Err(absent) => return Lookup::Absent(absent),
    };
    let unmade = match (&key, state.touch_key(finger)) {
        (ImprintKey::Predicted(..) | ImprintKey::Mean(_), Some(touch)) => {
            if results::sample(state).ready().is_some() && !results::can_start(state, finger) {
                return Lookup::Absent(Absent::NoInput);
            }
            let made = made_for(state, subject, touch).map(|(recipes, _)| recipes).unwrap_or_default();
            made.into_iter().find_map(|recipe| state.failure(recipe))
        }
        _ => None,
    };
    results::imprint_of(state, &key).or_failed(unmade)
}

/// One subject against another of a finger.
pub fn subjects_compared<'a>(state: &'a State, a: &Subject, b: &Subject, finger: PadId) -> Lookup<'a, Comparison> {
    match (subject_key(state, a, finger), subject_key(state, b, finger)) {
        (Ok(a), Ok(b)) => state.look(ComparisonKey { a, b }).value(),
        (Err(absent), _) | (_, Err(absent)) => Lookup::Absent(absent),
    }
}

/// The cloud of a subject; `None` while an imprint of it is not there.
fn subject_cloud(state: &State, subject: &Subject) -> Option<EstimateKey> {
    if let Some(side) = side_of(subject) {
        return results::cloud_key(state, side).ok()?;
    }
    let mut parts = PerPad::default();
    for finger in state.rig().pads() {
        let camera = results::touch(state, finger).ready().is_some_and(|t| t.camera().is_some());
        let Some(imprint) = subject_key(state, subject, finger).ok().filter(|_| camera) else { continue };
        results::imprint_of(state, &imprint).ready()?;
        if let Some(mask) = results::mask_version(state, &imprint, finger) {
            parts[finger] = Some((imprint, Some(mask)));
        }
    }
    (!parts.is_empty()).then(|| EstimateKey::cloud(parts))
}

fn subject_pose_key(state: &State, subject: &Subject) -> Option<EstimateKey> {
    if let Some(side) = side_of(subject) {
        return results::pose_key(state, side).ok()?;
    }
    Some(subject_cloud(state, subject)?.posed(results::tool_name(state).ok()?, state.settings.registration))
}

/// Why the subjects have no poses, if they cannot have any.
pub(crate) fn pose_absent(state: &State) -> Option<Absent> {
    if let Err(absent) = results::tool_name(state) {
        return Some(absent);
    }
    let sample = results::sample(state).ready()?;
    let camera = sample.pads.iter().flatten().any(|touch| touch.camera().is_some());
    (!camera).then_some(Absent::NoCamera)
}

/// The pose of a subject, where it is there.
pub fn subject_pose<'a>(state: &'a State, subject: &Subject) -> Option<&'a PoseResult> {
    results::pose_of(state, &subject_pose_key(state, subject)?)
}

/// Asks for what the pane of the comparison shows and is not there.
pub(crate) fn want_compared(wants: &mut Demands<'_>) {
    let state = wants.state;
    if !state.needs(Demand::Compare) || results::sample(state).ready().is_none() {
        return;
    }
    let CompareChoice { a, b, mode } = state.settings.compared();
    let both = [a, b];
    let posed = pose_absent(state).is_none();
    let shown = state.fingers();
    let needed: Vec<PadId> = state.rig().pads().filter(|finger| posed || shown.contains(finger)).collect();
    for subject in &both {
        for finger in &needed {
            want_subject(wants, subject, *finger);
        }
    }
    for finger in shown {
        let with = |subject: &Subject| {
            subject_key(state, subject, finger).ok().filter(|key| results::imprint_of(state, key).ready().is_some())
        };
        let [a, b] = [&both[0], &both[1]].map(with);
        let measured = with(&Subject::Measured);
        for (a, b) in [(&a, &b), (&a, &measured), (&b, &measured)] {
            if let (Some(a), Some(b)) = (a, b)
                && (a != b || mode == CompareMode::Difference)
            {
                wants.ask(ComparisonKey { a: a.clone(), b: b.clone() });
            }
        }
    }
    // While the pen is down the cloud would be out of date before it is there.
    if !posed || state.document.stroke.is_some() {
        return;
    }
    for subject in &both {
        want_subject_place(wants, subject);
    }
}

/// The imprint of a subject, and the predictions that it is made of.
pub(crate) fn want_subject(wants: &mut Demands<'_>, subject: &Subject, finger: PadId) {
    let state = wants.state;
    let Some(touch) = state.touch_key(finger) else { return };
    match (side_of(subject), subject_key(state, subject, finger)) {
        (Some(ImprintSource::Measured), _) => {}
        (Some(ImprintSource::Predicted), _) => {
            results::want_stored(wants, finger, touch);
            results::want_imprint(wants, finger, touch);
            results::want_other_finger(wants, finger);
        }
        (None, Ok(ImprintKey::Picture(touch))) => wants.ask(PictureKey(touch)),
        (None, Ok(key)) if results::can_start(state, finger) => {
            let Ok((recipes, shift)) = made_for(state, subject, touch) else { return };
            let mut whole = true;
            for recipe in recipes {
                if state.results.predictions.contains(&recipe) {
                    let meters = EstimateKey::imprint(&ImprintKey::Predicted(recipe, shift));
                    whole &= state.results.estimates.contains(&meters);
                    wants.ask(meters);
                } else {
                    whole = false;
                    wants.ask(recipe);
                }
            }
            if let ImprintKey::Mean(key) = key
                && whole
            {
                wants.ask(key);
            }
        }
        (None, _) => {}
    }
}

/// Cloud and pose of a subject.
pub(crate) fn want_subject_place(wants: &mut Demands<'_>, subject: &Subject) {
    let state = wants.state;
    if let Some(side) = side_of(subject) {
        return results::want_side(wants, side, [true, true], |_| true);
    }
    results::want_tool(wants);
    if !results::awaits_tool(state) {
        let tool = results::tool(state).ready().is_some();
        let key = if tool { subject_pose_key(state, subject) } else { subject_cloud(state, subject) };
        key.into_iter().for_each(|key| wants.ask(key));
    }
}

/// Prediction against measurement of one finger.
pub fn comparison(state: &State, finger: PadId) -> Lookup<'_, Comparison> {
    let Some(recipe) = results::chosen(state, finger) else {
        return results::sample(state).and_then(Absent::NoPrediction, |_| None);
    };
    if state.library.predicts_color(&recipe.bundle) {
        return Lookup::Absent(Absent::PredictsColor);
    }
    let bubble = results::touch(state, finger).and_then(Absent::NoBubble, |touch| touch.depth());
    if bubble.ready().is_none() {
        return bubble.without();
    }
    state.look(ComparisonKey::measured(recipe.clone(), state.settings.shift)).value()
}

pub(crate) fn want_comparison(wants: &mut Demands<'_>, finger: PadId, touch: TouchKey) {
    let state = wants.state;
    let Some(recipe) = results::shown(state, touch) else { return };
    let there = |source| results::imprint(state, source, finger).ready().is_some();
    if there(ImprintSource::Measured) && there(ImprintSource::Predicted) {
        wants.ask(ComparisonKey::measured(recipe.clone(), state.settings.shift));
    }
}
