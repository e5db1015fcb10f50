//! The tensors of a pair.

use super::{Absent, Computes, Job, Lane, Lookup, PairKey, SharedServices, State};
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::{ColorTouch, DepthTouch, PadTouch, Sample};
use touch2touch_work::error::TaskError;

impl Computes for PairKey {
    type Value = Sample;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Sample>> {
        let (source, pair) = (state.library.open.as_ref()?.source.clone(), self.pair);
        let what = format!("Load {}", state.library.entry(pair)?.name);
        Some(Job::new(Lane::Files, what, move |_| source.load(pair)))
    }

    fn bytes(sample: &Sample) -> usize {
        sample.bytes()
    }

    fn failed(&self, state: &mut State, _: &TaskError) -> bool {
        state.is_selected(*self)
    }
}

impl State {
    /// The tensors of the selected pair.
    pub fn sample(&self) -> Lookup<'_, Sample> {
        if self.library.open.is_none() {
            return Lookup::Absent(Absent::NothingOpen);
        }
        match self.pair_key() {
            Some(key) => self.look(key).value(),
            None => Lookup::Absent(Absent::NothingSelected),
        }
    }

    /// What one finger felt.
    pub fn touch(&self, finger: PadId) -> Lookup<'_, PadTouch> {
        self.sample().and_then(Absent::NoFinger, |sample| sample.pad(finger))
    }

    /// What one GelSlim felt.
    pub fn gelslim(&self, finger: PadId) -> Lookup<'_, ColorTouch> {
        self.touch(finger).and_then(Absent::NoGelSlim, |touch| touch.color())
    }

    /// What one Soft Bubble felt.
    pub fn bubble(&self, finger: PadId) -> Lookup<'_, DepthTouch> {
        self.touch(finger).and_then(Absent::NoBubble, |touch| touch.depth())
    }
}
