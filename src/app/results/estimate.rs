//! Estimates: imprints, masks, clouds and poses of a pair, each side by one job, as far as panes on screen need it.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::{EstimateKey, ImprintKey, ImprintSource, MaskRecipe, MaskVersion, PairKey, ToolKey};
use super::super::results::{Computes, Demands, gone};
use super::super::services::Services;
use super::super::state::results::{Latest, Request};
use super::super::state::tasks::Level;
use super::super::state::{Absent, Lookup, State};
use super::super::{recipe, results};
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::labels::{MaskPlace, PairLabels};
use touch2touch_pipeline::steps::cloud::Clouds;
use touch2touch_pipeline::steps::estimate::{Estimate, Touch};
use touch2touch_pipeline::steps::mask::MaskChoice;
use touch2touch_pipeline::steps::pose::PoseResult;
use touch2touch_pipeline::steps::recipe::{Recipe, Stage};
use touch2touch_pipeline::steps::tool::LoadedTool;

impl Computes for EstimateKey {
    fn job(&self, state: &State, services: &Arc<Services>) -> Option<Job<Estimate>> {
        let (pair, side) = self.place()?;
        let mut recipe = recipe::in_force(state, side);
        if let Some((ImprintKey::Predicted(_, shift), _)) = self.parts.iter().flatten().next() {
            recipe.shift = *shift;
        }
        if recipe.mask_recipe(&state.rig()).is_err() {
            // The masks that there are were drawn.
            recipe.mask = MaskChoice::default();
        }
        let known = &state.results.estimates;
        // The part of it that is there already.
        let begun = match (&self.pose, known.get(&self.its_cloud())) {
            (Some((_, registration)), Some(cloud)) => {
                cloud.again(&Recipe { registration: *registration, ..cloud.recipe().clone() })
            }
            _ if self.stage == Stage::Imprint => {
                let (ImprintKey::Predicted(made, _), _) = self.parts.iter().flatten().next()? else { return None };
                let mut predictions = PerPad::default();
                predictions[made.touch.finger] = Some((**state.results.predictions.get(made)?).clone());
                Estimate::of_predictions(&recipe, predictions)
            }
            _ => {
                let (mut imprints, mut unmasked) = (PerPad::default(), Vec::new());
                for (pad, (imprint, mask)) in self.parts.entries() {
                    imprints[pad] = Some(results::imprint_of(state, imprint).ready()?.clone());
                    unmasked.extend(mask.is_none().then_some(pad));
                }
                let mut begun = Estimate::with_imprints(&recipe, imprints).without_masks(unmasked);
                for (pad, (imprint, _)) in self.parts.entries() {
                    if let Some(other) = known.get(&EstimateKey::imprint(imprint)) {
                        begun.take_over(pad, other);
                    }
                }
                begun
            }
        };
        let labels = drawn(state, self, &recipe)?;
        let tool = state.library.entry(pair.pair).and_then(|entry| entry.tool.as_deref());
        let tool = tool.map(|tool| ToolKey { dataset: pair.dataset, name: tool.into() });
        let tool = tool.and_then(|key| state.results.tools.get(&key).cloned());
        if self.pose.is_some() && tool.is_none() {
            return None;
        }
        let asked = self.parts.entries().any(|(pad, (_, mask))| {
            matches!(mask, Some(MaskVersion::Auto(MaskRecipe::Unet(..)))) && !begun.has_probability(pad)
        });
        let worker = if asked && !begun.has(Stage::Mask) { Worker::Models } else { Worker::Compute };
        let what = match self.stage {
            Stage::Prediction | Stage::Imprint => "Prediction in meters",
            Stage::Mask => "Contact mask",
            Stage::Cloud => "Point cloud",
            Stage::Pose => "Pose",
        };
        let (source, stage, services) = (state.library.open.as_ref()?.source.clone(), self.stage, services.clone());
        let sample = state.results.samples.get(&pair)?.clone();
        Some(Job::new(worker, what, move |cx| {
            let none = gone();
            let tool = tool.as_deref().map(|tool| &tool.model).ok_or(&none);
            let touch = Touch { dataset: &source.dataset, pair: pair.pair, sample: &sample, tool, labels: &labels };
            begun.with_surface().reach(touch, stage, &services.models, cx)
        }))
    }

    /// All that is in it is there now. The log says once what a mask is made of where that is not what its recipe names.
    fn arrived(&self, state: &mut State, made: &Arc<Estimate>) {
        let share = made.bytes() / 4;
        for key in self.within() {
            state.results.estimates.insert(key, made.clone(), share);
        }
        if let Some(at) = self.place() {
            let ahead = !state.is_selected(at.0);
            if self.stage >= Stage::Cloud && (ahead || cloud_key(state, at.1) == Ok(Some(self.its_cloud()))) {
                state.results.latest.entry(at).or_default().cloud = Some(self.its_cloud());
            }
            if self.stage >= Stage::Pose && (ahead || pose_key(state, at.1) == Ok(Some(self.clone()))) {
                state.results.latest.entry(at).or_default().pose = Some(self.clone());
            }
        }
        say_masks(state);
    }
}

/// Says what masks of the selected pair are made of where that is not what their recipes name; each once.
pub(crate) fn say_masks(state: &mut State) {
    let is_here = |key: &EstimateKey| key.parts.iter().flatten().any(|(of, _)| state.is_selected(of.touch().pair));
    let here = state.results.estimates.iter().filter(|(key, made)| made.has(Stage::Mask) && is_here(key));
    let here: Vec<_> = here.map(|(key, made)| (key.parts.clone(), made.clone())).collect();
    for (parts, made) in &here {
        parts.iter().flatten().for_each(|(imprint, mask)| note(state, imprint, mask.as_ref(), made));
    }
}

fn note(state: &mut State, imprint: &ImprintKey, mask: Option<&MaskVersion>, made: &Estimate) {
    let touch = imprint.touch();
    let found = made.contact().masks[touch.finger].as_ref();
    let (Some(why), Some(mask)) = (found.and_then(|found| found.basis.note()), mask) else { return };
    let first = state.results.noted.insert(Request::Estimate(EstimateKey::mask(imprint, mask.clone())));
    if let Some(entry) = state.library.entry(touch.pair.pair).filter(|_| first) {
        let text = format!("{}, {} finger: {why}", entry.name, state.finger_name(touch.finger));
        state.log.push(Level::Warning, text, None, None);
    }
}

/// The drawn masks that an estimate is made with; `None` if one is not the newest any more.
fn drawn(state: &State, key: &EstimateKey, recipe: &Recipe) -> Option<PairLabels> {
    let mut labels = PairLabels::default();
    for (pad, (imprint, mask)) in key.parts.entries() {
        if let Some(MaskVersion::Hand(revision)) = mask {
            let hand = results::drawn_mask_on(state, imprint).filter(|hand| hand.revision == *revision)?;
            labels.masks.insert(MaskPlace { pad, of: recipe.imprint_of() }, hand.clone());
        }
    }
    Some(labels)
}

/// The recipe of the cloud of an imprint; `Ok(None)` while something it is made from is not there yet.
///
/// # Errors
/// Why there can be none.
pub(crate) fn cloud_key(state: &State, source: ImprintSource) -> Result<Option<EstimateKey>, Absent> {
    let sample = match results::sample(state) {
        Lookup::Ready(sample) => sample,
        Lookup::Absent(absent) => return Err(absent),
        _ => return Ok(None),
    };
    let mut parts = PerPad::default();
    let mut reason = Absent::NoBubble;
    for (finger, touch) in sample.pads.entries() {
        if touch.camera().is_none() {
            if touch.depth().is_some() || source == ImprintSource::Predicted {
                reason = Absent::NoCamera;
            }
            continue;
        }
        let key = match results::imprint_key(state, source, finger) {
            Ok(key) => key,
            Err(absent) => {
                reason = absent;
                continue;
            }
        };
        match results::imprint(state, source, finger) {
            Lookup::Ready(_) => {}
            Lookup::Failed(_) | Lookup::Absent(_) => continue,
            Lookup::Stale(_) | Lookup::Waiting => return Ok(None),
        }
        // Without a mask there are points, but none of contact.
        let version = results::mask_version(state, &key, finger);
        parts[finger] = Some((key, version));
    }
    if parts.is_empty() { Err(reason) } else { Ok(Some(EstimateKey::cloud(parts))) }
}

/// The surface points of an imprint, both fingers.
pub fn cloud(state: &State, source: ImprintSource) -> Lookup<'_, Clouds> {
    let before = || state.results.estimates.get(latest(state, source)?.cloud.as_ref()?);
    // A pair that cannot be read says so, in place of the scene before.
    let unread = state.pair_key().and_then(|pair| state.failure(pair));
    let posed = pose_key(state, source).ok().flatten().and_then(|key| state.failure(key));
    let found = state.look_or(cloud_key(state, source), before).or_failed(unread).or_failed(posed);
    found.map(|estimate| estimate.surface())
}

/// The keys of what was shown last of an imprint of the selected pair.
pub(crate) fn latest(state: &State, source: ImprintSource) -> Option<&Latest> {
    state.results.latest.get(&(state.pair_key()?, source))
}

/// The recipe of the pose of an imprint; `Ok(None)` while something it is made from is not there yet.
///
/// # Errors
/// Why there can be none.
pub fn pose_key(state: &State, source: ImprintSource) -> Result<Option<EstimateKey>, Absent> {
    if unmasked(state, source).is_some() {
        return Err(Absent::NoContact);
    }
    let tool = results::tool_name(state);
    let Some(cloud) = cloud_key(state, source)? else {
        return Ok(None);
    };
    if cloud.parts.iter().flatten().all(|(_, mask)| mask.is_none()) {
        return Err(state.rig().pads().find_map(|f| results::mask_recipe(state, f).err()).unwrap_or(Absent::NoContact));
    }
    Ok(Some(cloud.posed(tool?, state.settings.registration)))
}

/// Why a finger of an imprint has no mask, where none can be made: a pose of the others alone is not that of all.
fn unmasked(state: &State, source: ImprintSource) -> Option<&TaskError> {
    state.rig().pads().find_map(|finger| match results::mask_in_force(state, source, finger) {
        Err(Lookup::Failed(err)) => Some(err),
        _ => None,
    })
}

/// The pose of an imprint.
pub fn pose(state: &State, source: ImprintSource) -> Lookup<'_, PoseResult> {
    if let failed @ Lookup::Failed(_) = results::tool(state) {
        return failed.without();
    }
    if let Some(err) = unmasked(state, source) {
        return Lookup::Failed(err);
    }
    let before = || state.results.estimates.get(latest(state, source)?.pose.as_ref()?);
    match state.look_or(pose_key(state, source), before) {
        Lookup::Ready(made) => made.pose().map_or_else(Lookup::Failed, Lookup::Ready),
        Lookup::Stale(made) => made.pose().map_or(Lookup::Waiting, Lookup::Stale),
        other => other.without(),
    }
}

/// The pose of a key, where it is there.
pub fn pose_of<'a>(state: &'a State, key: &EstimateKey) -> Option<&'a PoseResult> {
    state.results.estimates.get(key)?.pose().ok()
}

/// The inputs of a job about a pose: cloud, tool and pair.
pub(crate) fn registered(state: &State, key: &EstimateKey) -> Option<(Arc<Estimate>, Arc<LoadedTool>, Arc<Sample>)> {
    let (PairKey { dataset, .. }, (name, _)) = (key.place()?.0, key.pose.as_ref()?);
    let estimates = &state.results.estimates;
    Some((
        estimates.get(key).or_else(|| estimates.get(&key.its_cloud()))?.clone(),
        state.results.tools.get(&ToolKey { dataset, name: name.clone() })?.clone(),
        state.results.samples.get(&key.place()?.0)?.clone(),
    ))
}

/// Asks for what is needed of a side: the tool and its cloud (with `pose` that too) by one job, and the masks of these fingers.
pub(crate) fn want_side(
    wants: &mut Demands<'_>,
    source: ImprintSource,
    [cloud, pose]: [bool; 2],
    masked: impl Fn(PadId) -> bool,
) {
    let state = wants.state;
    let mut key = None;
    // While the pen is down the cloud would be out of date before it is there.
    if cloud && state.document.stroke.is_none() {
        results::want_tool(wants);
        if state.document.stored.contains_key(state.pair_name()) && !results::awaits_tool(state) {
            let posed = pose_key(state, source).ok().flatten();
            let posed = posed.filter(|_| pose && results::tool(state).ready().is_some());
            key = posed.or_else(|| cloud_key(state, source).ok()?);
            // Where a mask of it cannot be made each finger says why.
            key = key.filter(|key| state.failure(key.clone()).is_none());
        }
    }
    if let Some(key) = &key {
        wants.ask(key.clone());
    }
    for finger in state.rig().pads().filter(|finger| cloud || masked(*finger)) {
        if key.as_ref().is_none_or(|key| key.parts[finger].is_none()) {
            results::want_mask(wants, source, finger);
        }
    }
}
