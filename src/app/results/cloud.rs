//! The surface points of an imprint.

use std::sync::Arc;

use super::Latest;
use super::imprint::{Imprint, ImprintKey};
use super::mask::{MaskKey, MaskVersion};
use super::{Absent, Computes, Demands, ImprintSource, Job, Lane, Lookup, PairKey, SharedServices, State};
use touch2touch_core::grid::Mask;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_work::cloud::{Clouds, clouds};

/// A cloud of both fingers: imprint and (where one can be had) mask of each finger.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CloudKey {
    /// Per finger.
    pub parts: PerPad<(ImprintKey, Option<MaskVersion>)>,
}

impl CloudKey {
    /// The pair and imprint it belongs to.
    pub fn place(&self) -> Option<(PairKey, ImprintSource)> {
        let (imprint, _) = self.parts.iter().flatten().next()?;
        Some((imprint.touch().pair, imprint.side()))
    }
}

impl Computes for CloudKey {
    type Value = Clouds;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Clouds>> {
        let mut parts: PerPad<(Imprint, Option<Arc<Mask>>)> = PerPad::default();
        for (finger, (imprint, version)) in self.parts.entries() {
            let mask = match version {
                None => None,
                Some(version) => Some(version.find(state, imprint)?),
            };
            parts[finger] = Some((imprint.find(state)?, mask));
        }
        let sample = state.results.samples.get(&self.place()?.0)?.clone();
        Some(Job::new(Lane::Compute, "Point cloud", move |_| {
            let parts = parts.as_ref().map(|part| {
                let (imprint, mask) = part?;
                Some((imprint.get().ok()?, mask.as_deref()))
            });
            clouds(&sample, &parts)
        }))
    }

    fn bytes(found: &Clouds) -> usize {
        found.bytes()
    }

    fn arrived(&self, state: &mut State, _: &Arc<Clouds>) {
        // One of a single finger is of the table of poses, not what the panes show.
        if let Some(at) = self.place().filter(|(_, source)| state.cloud_key(*source) == Ok(Some(self.clone()))) {
            state.results.latest.entry(at).or_default().cloud = Some(self.clone());
        }
    }
}

impl State {
    /// The recipe of the cloud of an imprint; `Ok(None)` while something it is made from is not there yet.
    ///
    /// # Errors
    /// Why there can be none.
    pub(crate) fn cloud_key(&self, source: ImprintSource) -> Result<Option<CloudKey>, Absent> {
        let sample = match self.sample() {
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
            let key = match self.imprint_key(source, finger) {
                Ok(key) => key,
                Err(absent) => {
                    reason = absent;
                    continue;
                }
            };
            match self.imprint(source, finger) {
                Lookup::Ready(_) => {}
                Lookup::Failed(_) | Lookup::Absent(_) => continue,
                Lookup::Stale(_) | Lookup::Waiting => return Ok(None),
            }
            let version = match self.mask_in_force(source, finger) {
                Ok(mask) => Some(mask.version),
                // Without a mask there are points, but none of contact.
                Err(Lookup::Failed(_) | Lookup::Absent(_)) => None,
                Err(_) => return Ok(None),
            };
            parts[finger] = Some((key, version));
        }
        if parts.is_empty() { Err(reason) } else { Ok(Some(CloudKey { parts })) }
    }

    /// The cloud of imprints with the masks drawn on them, else the automatic ones; `Err` holds the masks that are missing for it, none while an
    /// imprint is.
    pub(crate) fn automatic_cloud(
        &self,
        imprints: impl Iterator<Item = (PadId, ImprintKey)>,
    ) -> Result<CloudKey, Vec<MaskKey>> {
        let (mut parts, mut missing) = (PerPad::default(), Vec::new());
        for (finger, imprint) in imprints {
            let camera = self.touch(finger).ready().is_some_and(|t| t.camera().is_some());
            let (Ok(recipe), true) = (self.mask_recipe(finger), camera) else { continue };
            if self.imprint_of(imprint.clone()).ready().is_none() {
                return Err(Vec::new());
            }
            if let Some(hand) = self.drawn_mask_on(&imprint) {
                parts[finger] = Some((imprint.clone(), Some(MaskVersion::Hand(hand.revision))));
                continue;
            }
            let key = MaskKey { imprint: imprint.clone(), recipe: recipe.clone() };
            if !self.results.masks.contains(&key) {
                missing.push(key);
            }
            parts[finger] = Some((imprint, Some(MaskVersion::Auto(recipe))));
        }
        if missing.is_empty() && !parts.is_empty() { Ok(CloudKey { parts }) } else { Err(missing) }
    }

    /// The surface points of an imprint, both fingers.
    pub fn cloud(&self, source: ImprintSource) -> Lookup<'_, Clouds> {
        let before = || self.results.clouds.get(self.latest(source)?.cloud.as_ref()?);
        // A pair that cannot be read says so, in place of the scene before.
        let unread = self.pair_key().and_then(|pair| self.failure(pair));
        self.look_or(self.cloud_key(source), before).or_failed(unread).value()
    }

    /// What was shown last of an imprint of the selected pair.
    pub(crate) fn latest(&self, source: ImprintSource) -> Option<&Latest> {
        self.results.latest.get(&(self.pair_key()?, source))
    }
}

impl Demands<'_> {
    /// Asks for the cloud and the tool; whether both are there.
    pub(crate) fn cloud(&mut self, source: ImprintSource) -> bool {
        let state = self.state;
        self.tool();
        if !state.document.stored.contains_key(state.pair_name()) {
            return false;
        }
        let Ok(Some(key)) = state.cloud_key(source) else { return false };
        let there = state.results.clouds.contains(&key);
        self.ask(key);
        there && state.tool().ready().is_some()
    }
}
