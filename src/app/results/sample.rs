//! The tensors of a pair, and its small picture.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::{PairKey, ThumbnailKey};
use super::super::pane::Demand;
use super::super::results::{Computes, Demands};
use super::super::services::Services;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::{ColorTouch, DepthTouch, PadTouch, Sample};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::steps::imprint;

impl Computes for PairKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Sample>> {
        let (source, pair) = (state.library.open.as_ref()?.source.clone(), self.pair);
        let what = format!("Load {}", state.library.entry(pair)?.name);
        Some(Job::new(Worker::Files, what, move |_| source.load(pair)))
    }

    fn failed(&self, state: &mut State, _: &TaskError) -> bool {
        state.is_selected(*self)
    }
}

/// An input of a job that was there when it was prepared: a defect if it ever shows.
pub(crate) fn gone() -> TaskError {
    TaskError::new("Compute", "the measured imprint is not there")
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

impl Computes for ThumbnailKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<DepthMap>> {
        let (source, pair) = (state.library.open.as_ref()?.source.clone(), self.0.pair);
        let loaded = state.results.samples.get(&self.0).cloned();
        let what = format!("Picture of {}", state.library.entry(pair)?.name);
        Some(Job::new(Worker::Files, what, move |_| match loaded {
            Some(sample) => Ok(imprint::thumbnail(&sample)),
            None => Ok(imprint::thumbnail(&source.load(pair)?)),
        }))
    }
}

/// The small picture of a pair, if it was made.
pub fn thumbnail(state: &State, pair: PairId) -> Option<&DepthMap> {
    let key = ThumbnailKey(state.library.open.as_ref()?.key(pair));
    state.results.thumbnails.get(&key).map(|a| &**a)
}

/// The pictures of the rows on screen.
pub(crate) fn want_thumbnails(wants: &mut Demands<'_>) {
    let state = wants.state;
    let Some(open) = state.library.open.as_ref().filter(|_| state.needs(Demand::Thumbnails)) else {
        return;
    };
    let end = state.library.rows.end.min(state.library.order.len());
    let start = state.library.rows.start.min(end);
    for pair in &state.library.order[start..end] {
        wants.ask(ThumbnailKey(open.key(*pair)));
    }
}
