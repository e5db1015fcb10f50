//! The ambiguity of a GelSlim image: what it leaves open.

use super::super::jobs::{Job, Lane};
use super::super::keys::{AmbiguityKey, TouchKey};
use super::super::results;
use super::super::results::{Computes, Demands, gone};
use super::super::services::SharedServices;
use super::super::state::State;
use touch2touch_core::ambiguity::Ambiguity;
use touch2touch_core::rig::PadId;

impl Computes for AmbiguityKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Self::Value>> {
        let (sample, finger) = (state.results.samples.get(&self.0.pair)?.clone(), self.0.finger);
        Some(Job::new(Lane::Compute, "What the GelSlim image leaves open", move |_| {
            let gelslim = sample.pad(finger).and_then(|t| t.color());
            Ok(touch2touch_core::ambiguity::ambiguity(&gelslim.ok_or_else(gone)?.difference))
        }))
    }
}

/// The ambiguity of the GelSlim image of one finger, once it is known.
pub fn ambiguity(state: &State, finger: PadId) -> Option<Ambiguity> {
    **state.results.ambiguities.get(&AmbiguityKey(state.touch_key(finger)?))?
}

pub(crate) fn want_ambiguity(wants: &mut Demands<'_>, finger: PadId, touch: TouchKey) {
    if results::gelslim(wants.state, finger).ready().is_some() {
        wants.ask(AmbiguityKey(touch));
    }
}
