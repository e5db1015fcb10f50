//! Poses that a person set, accepted, or starts from, beside the registered ones.

use super::super::keys::ImprintSource;
use super::super::results;
use super::super::state::State;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::{AcceptedPose, PoseDifference};
use touch2touch_pipeline::labels::ImprintOf;
use touch2touch_pipeline::masks::propose::hand_pose;

/// The imprint that a pose is made from, where all fingers show the same.
pub(crate) fn shown_imprint(state: &State, source: ImprintSource) -> Option<ImprintOf> {
    let rig = state.rig();
    let mut of = rig.pads().filter_map(|pad| results::mask_place(state, source, pad)).map(|place| place.of);
    let first = of.next()?;
    of.all(|other| other == first).then_some(first)
}

/// The pose that was accepted of the imprint of the selected pair that is shown.
pub fn accepted(state: &State, source: ImprintSource) -> Option<AcceptedPose> {
    state.document.pair(state.pair_name())?.accepted(&shown_imprint(state, source)?)
}

/// The other predictions of the selected pair that a pose was accepted of.
pub fn accepted_elsewhere(state: &State) -> Vec<&ImprintOf> {
    let shown = shown_imprint(state, ImprintSource::Predicted);
    let poses = state.document.pair(state.pair_name()).map(|labels| labels.accepted.keys());
    let other = |of: &&ImprintOf| of.source() == ImprintSource::Predicted && **of != ImprintOf::unknown();
    poses.into_iter().flatten().filter(other).filter(|of| Some(*of) != shown.as_ref()).collect()
}

/// The pose that a person set and accepted.
pub fn by_hand(state: &State, source: ImprintSource) -> Option<PlanarPose> {
    hand_pose(None, accepted(state, source))
}

/// The pose at which the tool is shown: where a hand holds it, else where a person put it, else where it was registered.
pub fn shown_pose(state: &State, source: ImprintSource) -> Option<PlanarPose> {
    let held = state.workbench.hand(source).map(|hand| hand.pose);
    held.or_else(|| by_hand(state, source)).or_else(|| Some(results::pose(state, source).shown()?.grasp_from_object))
}

/// The pose at which setting one by hand begins.
pub fn manual_begins(state: &State, source: ImprintSource) -> PlanarPose {
    let accepted = accepted(state, source).map(|a| a.pose);
    accepted.or_else(|| Some(results::pose(state, source).shown()?.grasp_from_object)).unwrap_or_default()
}

/// The difference between the registered poses of measurement and prediction, where both are there.
pub(crate) fn sides_apart(state: &State) -> Option<PoseDifference> {
    let pose = |source| Some(results::pose(state, source).ready()?.grasp_from_object);
    Some(PoseDifference::between(pose(ImprintSource::Measured)?, pose(ImprintSource::Predicted)?))
}
