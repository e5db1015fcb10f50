//! The parts that are read of a pair: its tensors, its small picture, its labels, the CAD model of its tool.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::Read;
use super::super::keys::{LabelsKey, PairKey, ThumbnailKey, ToolKey};
use super::super::pane::Demand;
use super::super::results::{Computes, Demands};
use super::super::services::Services;
use super::super::state::labels::Stored;
use super::super::state::tasks::Level;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::manual::PoseDifference;
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::{ColorTouch, PadTouch, Sample};
use touch2touch_core::symmetry::Symmetry;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::steps::imprint;
use touch2touch_pipeline::steps::tool::{LoadedTool, load_tool};

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

/// Difference of a pose, `grasp_from_object`, from the true one of the selected pair, up to the tool's symmetry, where it is known.
pub fn off_truth(state: &State, pose: PlanarPose) -> Option<PoseDifference> {
    let (truth, tool) = (sample(state).ready()?.grasp_from_object?, tool(state).ready());
    let plain = || PoseDifference::between(pose, truth);
    Some(tool.map_or_else(plain, |tool| Symmetry::of(&tool.model).difference(pose, truth)))
}

impl Computes for ThumbnailKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<DepthMap>> {
        let (source, pair) = (state.library.open.as_ref()?.source.clone(), self.0.pair);
        let loaded = state.results.samples.get(&self.0).cloned();
        let what = format!("Picture of {}", state.library.entry(pair)?.name);
        Some(Job::new(Worker::Files, what.clone(), move |_| {
            let read = loaded.map_or_else(|| source.dataset.load_first_bubble(pair).map(Arc::new), Ok);
            let thumbnail = read.map(|sample| imprint::thumbnail(&sample));
            thumbnail.map_err(|err| TaskError::from_error(what, &err).with_hint(err.hint))
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

/// The name of the pair.
fn name(state: &State, key: &LabelsKey) -> Option<String> {
    Some(state.library.entry(key.0.pair)?.name.clone())
}

impl Computes for LabelsKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Read>> {
        let (source, name) = (state.library.open.as_ref()?.source.clone(), name(state, self)?);
        Some(Job::new(Worker::Files, format!("Labels of {name}"), move |_| {
            let labels = source.labels.load(&name)?;
            let past = source.labels.past(&name, &labels);
            Ok(Read { labels, past })
        }))
    }

    /// They go to the document.
    fn is_there(&self, state: &State) -> bool {
        name(state, self).is_some_and(|name| state.document.stored.contains_key(&name))
    }

    fn arrived(&self, state: &mut State, read: &Arc<Read>) {
        let Some(name) = name(state, self) else { return };
        let doc = &mut state.document;
        if doc.stored.insert(name.clone(), Stored::Loaded) == Some(Stored::Loaded) {
            // Read twice: what is here may be newer.
            return;
        }
        let mut labels = read.labels.clone();
        for hand in labels.masks.values_mut() {
            hand.revision = doc.next_revision();
        }
        let (review, note) = (labels.review, labels.note.clone());
        doc.labels.insert(name.clone(), labels);
        doc.set_review(&name, review);
        doc.set_note(&name, note);
        state.history.restore(&name, &read.past.done, &read.past.undone);
        if let Some(problem) = &read.past.problem {
            let (why, hint) = (problem.why.clone(), problem.hint.clone());
            state.log.push(Level::Warning, problem.what.clone(), Some(why), hint);
        }
    }

    fn failed(&self, state: &mut State, err: &TaskError) -> bool {
        if let Some(name) = name(state, self) {
            state.document.stored.insert(name, Stored::Blocked(err.clone()));
        }
        true
    }
}

impl Computes for ToolKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<LoadedTool>> {
        let (source, name) = (state.library.open.as_ref()?.source.clone(), self.name.clone());
        let what = format!("CAD model of {name}");
        Some(Job::new(Worker::Compute, what, move |_| load_tool(&source.dataset, &name)))
    }

    fn failed(&self, _: &mut State, _: &TaskError) -> bool {
        true
    }
}

/// The tool of the selected pair.
///
/// # Errors
/// [`Absent::NothingSelected`], [`Absent::NoTool`].
pub fn tool_name(state: &State) -> Result<&str, Absent> {
    state.entry().ok_or(Absent::NothingSelected)?.tool.as_deref().ok_or(Absent::NoTool)
}

/// The key of the tool of the selected pair.
///
/// # Errors
/// Why there can be none.
pub(crate) fn tool_key(state: &State) -> Result<ToolKey, Absent> {
    let dataset = state.library.open.as_ref().ok_or(Absent::NothingOpen)?.seq;
    Ok(ToolKey { dataset, name: tool_name(state)?.into() })
}

/// The tool of the selected pair, with its CAD model.
pub fn tool(state: &State) -> Lookup<'_, LoadedTool> {
    state.look_or(tool_key(state).map(Some), || None).value()
}

pub(crate) fn want_tool(wants: &mut Demands<'_>) {
    if let Ok(key) = tool_key(wants.state) {
        wants.ask(key);
    }
}
