//! [`Ghost`]: what the last change of a mask started from, shown beside what it led to.

use std::sync::Arc;

use super::super::keys::{CloudKey, ImprintSource, PoseKey, Revision};
use super::super::results;
use super::super::state::State;
use touch2touch_core::grid::Mask;
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::steps::cloud::Clouds;
use touch2touch_pipeline::steps::pose::PoseResult;

/// Mask, pose and cloud before the last change of a mask. Nothing of it is computed: pose and cloud are those that were
/// there, and are missing where none was.
#[derive(Clone, Copy, Debug)]
pub struct Ghost<'a> {
    /// The finger whose mask was changed.
    pub finger: PadId,
    /// The change of the document that it is of.
    pub revision: Revision,
    /// The mask before.
    pub mask: &'a Arc<Mask>,
    /// The pose before.
    pub pose: Option<&'a Arc<PoseResult>>,
    /// The cloud before, with its recipe.
    pub clouds: Option<(&'a CloudKey, &'a Arc<Clouds>)>,
}

/// The start of the last change of a mask of an imprint of the selected pair, until the next stroke; `None` where
/// there was none, or ghosts are switched off.
pub fn ghost(state: &State, source: ImprintSource) -> Option<Ghost<'_>> {
    let changed = state.document.changed.as_ref()?;
    let here = changed.pair == state.pair_name() && changed.source == source && state.document.stroke.is_none();
    let mask = changed.mask.as_ref().filter(|_| here && state.settings.ghosts)?;
    let key = changed.before.as_ref();
    let clouds = key.and_then(|key| Some((&key.cloud, state.results.clouds.get(&key.cloud)?)));
    let (finger, revision) = (changed.finger, changed.revision);
    Some(Ghost { finger, revision, mask, pose: key.and_then(|key| state.results.poses.get(key)), clouds })
}

/// The recipe of the pose that is shown of an imprint.
pub(crate) fn shown_pose_key(state: &State, source: ImprintSource) -> Option<PoseKey> {
    results::pose(state, source).shown()?;
    let now = results::pose_key(state, source).ok().flatten().filter(|key| state.results.poses.contains(key));
    now.or_else(|| results::latest(state, source)?.pose.clone())
}
