//! What a GelSlim image leaves open.

use super::imprint::gone;
use super::{Computes, Demands, Job, Lane, SharedServices, State, TouchKey};
use touch2touch_core::ambiguity::{Ambiguity, ambiguity};
use touch2touch_core::rig::PadId;

/// What the GelSlim image of a touch leaves open.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AmbiguityKey(pub TouchKey);

impl Computes for AmbiguityKey {
    /// `None` for an image without a finite pixel.
    type Value = Option<Ambiguity>;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Self::Value>> {
        let (sample, finger) = (state.results.samples.get(&self.0.pair)?.clone(), self.0.finger);
        Some(Job::new(Lane::Compute, "What the GelSlim image leaves open", move |_| {
            let gelslim = sample.pad(finger).and_then(|t| t.color());
            Ok(ambiguity(&gelslim.ok_or_else(gone)?.difference))
        }))
    }

    fn bytes(found: &Self::Value) -> usize {
        size_of_val(found)
    }
}

impl State {
    /// What the GelSlim image of one finger leaves open, once it is known.
    pub fn ambiguity(&self, finger: PadId) -> Option<Ambiguity> {
        **self.results.ambiguities.get(&AmbiguityKey(self.touch_key(finger)?))?
    }
}

impl Demands<'_> {
    pub(crate) fn ambiguity(&mut self, finger: PadId, touch: TouchKey) {
        if self.state.gelslim(finger).ready().is_some() {
            self.ask(AmbiguityKey(touch));
        }
    }
}
