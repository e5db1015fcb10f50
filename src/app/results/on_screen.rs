//! The needs of the panes on screen, as far as they decide what is computed.

use super::super::keys::ImprintSource;
use super::super::pane::Demand;
use super::super::results;
use super::super::state::State;
use super::super::state::workbench::Layer;
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::masks::propose::ProposalSource;

/// The need of the cloud of an imprint: true where the 3D views and what lies beside them need it (with its pose), and
/// whether it is needed at all.
pub(crate) fn shows_cloud(state: &State, source: ImprintSource) -> (bool, bool) {
    let other = source.other();
    let both = state.workbench.both_clouds && state.shows_scene(other);
    let scene = both || state.shows_scene(source) || state.needs(Demand::Poses);
    let inspected = state.inspect.source == source && state.needs(Demand::Steps);
    // A proposal at the registered pose needs that of the imprint that is worked on.
    let at_pose = proposes(state)
        && state.settings.mask.proposal == ProposalSource::CadRegistered
        && results::worked_on(state, state.selection.finger) == source;
    (scene || at_pose, scene || at_pose || inspected)
}

/// True where a proposal is shown over the masks.
pub fn proposes(state: &State) -> bool {
    state.selection.proposing && state.needs(Demand::Masks)
}

/// The fingers whose prediction is looked at: those on screen, and both where a visible pane makes one cloud or
/// pose of them (unless the settings say otherwise).
pub(crate) fn fingers_to_generate(state: &State) -> Vec<PadId> {
    let (_, cloud) = shows_cloud(state, ImprintSource::Predicted);
    if cloud && state.settings.generate.both_fingers {
        return state.rig().pad_list();
    }
    let mut fingers = state.fingers();
    if !state.settings.generate.both_fingers {
        fingers.truncate(1);
    }
    fingers
}

/// True where something on screen shows a step of an imprint's registration.
pub(crate) fn shows_steps(state: &State, source: ImprintSource) -> bool {
    let lines = state.workbench.layer == Layer::Correspondences && state.shows_scene(source);
    state.inspect.source == source && (lines || state.needs(Demand::Steps))
}

/// True where a 3D view shows the layers of an imprint.
pub(crate) fn shows_layers(state: &State, source: ImprintSource) -> bool {
    let bench = &state.workbench;
    state.shows_scene(source)
        && (matches!(bench.layer, Layer::Residuals | Layer::Reasons)
            || bench.picked.is_some_and(|picked| picked.source == source))
}

/// True where a 3D view shows the distances between an imprint and the model.
pub(crate) fn shows_deviation(state: &State, source: ImprintSource) -> bool {
    state.workbench.layer == Layer::Distance && state.shows_scene(source)
}
