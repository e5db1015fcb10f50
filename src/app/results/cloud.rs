//! The surface points of an imprint.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::{CloudKey, ImprintKey, ImprintSource, MaskKey, MaskVersion};
use super::super::results;
use super::super::results::{Computes, Demands};
use super::super::services::Services;
use super::super::state::results::Latest;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_pipeline::steps::cloud::Clouds;
use touch2touch_pipeline::steps::estimate::Estimate;

impl Computes for CloudKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Estimate>> {
        let (mut imprints, mut masks) = (PerPad::default(), PerPad::default());
        let mut made_by = None;
        for (finger, (imprint, version)) in self.parts.entries() {
            imprints[finger] = Some(results::imprint_of(state, imprint).ready()?.clone());
            if let Some(version) = version {
                masks[finger] = Some(results::mask_of(state, version, imprint)?);
            }
            if let Some(MaskVersion::Auto(recipe)) = version {
                made_by = Some(recipe.clone());
            }
        }
        let (pair, side) = self.place()?;
        let sample = state.results.samples.get(&pair)?.clone();
        Some(Job::new(Lane::Compute, "Point cloud", move |_| {
            Estimate::of_masks(side, made_by, imprints, masks, &sample)
        }))
    }

    fn arrived(&self, state: &mut State, _: &Arc<Estimate>) {
        // One of a single finger is of the table of poses, not what the panes show.
        if let Some(at) = self.place().filter(|(_, source)| cloud_key(state, *source) == Ok(Some(self.clone()))) {
            state.results.latest.entry(at).or_default().cloud = Some(self.clone());
        }
    }
}

/// The recipe of the cloud of an imprint; `Ok(None)` while something it is made from is not there yet.
///
/// # Errors
/// Why there can be none.
pub(crate) fn cloud_key(state: &State, source: ImprintSource) -> Result<Option<CloudKey>, Absent> {
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
        let version = match results::mask_in_force(state, source, finger) {
            Ok(mask) => Some(mask.version),
            // Without a mask there are points, but none of contact.
            Err(Lookup::Failed(_) | Lookup::Absent(_)) => None,
            Err(_) => return Ok(None),
        };
        parts[finger] = Some((key, version));
    }
    if parts.is_empty() { Err(reason) } else { Ok(Some(CloudKey { parts })) }
}

/// The cloud of imprints with the masks drawn on them, else the automatic ones; `Err` holds the masks that are missing for
/// it, none while an imprint is.
pub(crate) fn automatic_cloud(
    state: &State,
    imprints: impl Iterator<Item = (PadId, ImprintKey)>,
) -> Result<CloudKey, Vec<MaskKey>> {
    let (mut parts, mut missing) = (PerPad::default(), Vec::new());
    for (finger, imprint) in imprints {
        let camera = results::touch(state, finger).ready().is_some_and(|t| t.camera().is_some());
        let (Ok(recipe), true) = (results::mask_recipe(state, finger), camera) else { continue };
        if results::imprint_of(state, &imprint).ready().is_none() {
            return Err(Vec::new());
        }
        if let Some(hand) = results::drawn_mask_on(state, &imprint) {
            parts[finger] = Some((imprint.clone(), Some(MaskVersion::Hand(hand.revision))));
            continue;
        }
        let key = MaskKey { imprint: imprint.clone(), recipe: recipe.clone() };
        if !state.results.masks.contains(&key) {
            missing.push(key);
        }
        parts[finger] = Some((imprint, Some(MaskVersion::Auto(recipe))));
    }
    if missing.is_empty() && !parts.is_empty() { Ok(CloudKey { parts }) } else { Err(missing) }
}

/// The surface points of an imprint, both fingers.
pub fn cloud(state: &State, source: ImprintSource) -> Lookup<'_, Clouds> {
    let before = || state.results.clouds.get(latest(state, source)?.cloud.as_ref()?);
    // A pair that cannot be read says so, in place of the scene before.
    let unread = state.pair_key().and_then(|pair| state.failure(pair));
    state.look_or(cloud_key(state, source), before).or_failed(unread).map(|estimate| estimate.surface())
}

/// The keys of what was shown last of an imprint of the selected pair.
pub(crate) fn latest(state: &State, source: ImprintSource) -> Option<&Latest> {
    state.results.latest.get(&(state.pair_key()?, source))
}

/// Asks for the cloud and the tool; whether both are there.
pub(crate) fn want_cloud(wants: &mut Demands<'_>, source: ImprintSource) -> bool {
    let state = wants.state;
    results::want_tool(wants);
    if !state.document.stored.contains_key(state.pair_name()) {
        return false;
    }
    let Ok(Some(key)) = cloud_key(state, source) else { return false };
    let there = state.results.clouds.contains(&key);
    wants.ask(key);
    there && results::tool(state).ready().is_some()
}
