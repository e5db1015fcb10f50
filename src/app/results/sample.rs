//! The tensors of a pair.

use super::super::jobs::{Job, Lane};
use super::super::keys::PairKey;
use super::super::results::Computes;
use super::super::services::SharedServices;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::{ColorTouch, DepthTouch, PadTouch, Sample};
use touch2touch_pipeline::error::TaskError;

impl Computes for PairKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Sample>> {
        let (source, pair) = (state.library.open.as_ref()?.source.clone(), self.pair);
        let what = format!("Load {}", state.library.entry(pair)?.name);
        Some(Job::new(Lane::Files, what, move |_| source.load(pair)))
    }

    fn failed(&self, state: &mut State, _: &TaskError) -> bool {
        state.is_selected(*self)
    }
}

/// The tensors of the selected pair.
pub fn sample(state: &State) -> Lookup<'_, Sample> {
    if state.library.open.is_none() {
        return Lookup::Absent(Absent::NothingOpen);
    }
    match state.pair_key() {
        Some(key) => state.look(key).value(),
        None => Lookup::Absent(Absent::NothingSelected),
    }
}

/// The touch of one finger.
pub fn touch(state: &State, finger: PadId) -> Lookup<'_, PadTouch> {
    sample(state).and_then(Absent::NoFinger, |sample| sample.pad(finger))
}

/// The touch of one GelSlim.
pub fn gelslim(state: &State, finger: PadId) -> Lookup<'_, ColorTouch> {
    touch(state, finger).and_then(Absent::NoGelSlim, |touch| touch.color())
}

/// The touch of one Soft Bubble.
pub fn bubble(state: &State, finger: PadId) -> Lookup<'_, DepthTouch> {
    touch(state, finger).and_then(Absent::NoBubble, |touch| touch.depth())
}

/// The true pose of the selected pair, `grasp_from_object`, where it is known.
pub fn truth(state: &State) -> Option<PlanarPose> {
    sample(state).ready()?.grasp_from_object
}
