//! The demands of the visible panes: results that are not there and can be computed from what is there.
//!
//! Each result says in its own file when it is asked for; here stands what is more urgent than what.

use super::keys::{ImprintSource, LabelsKey};
use super::pane::Demand;
use super::results;
use super::results::Demands;
use super::state::State;
use super::state::results::Request;

/// Neighbors loaded ahead on each side of the selection.
pub(crate) const PREFETCH: usize = 4;

/// The demands of the visible panes: results that are not there and can be computed from what is there; most urgent first.
///
/// Pure: the same state wants the same. A result that is computed makes the next one possible.
pub fn demands(state: &State) -> Vec<Request> {
    let mut wants = Demands { state, list: Vec::new() };
    selection(&mut wants);
    results::want_compared(&mut wants);
    results::want_thumbnails(&mut wants);
    results::want_doctor(&mut wants);
    neighbors(&mut wants);
    results::want_mask_plan(&mut wants);
    results::want_import_plan(&mut wants);
    results::want_train_plan(&mut wants);
    wants.list
}

fn selection(wants: &mut Demands<'_>) {
    let state = wants.state;
    let Some(pair) = state.pair_key() else { return };
    if !state.shows_pair() {
        return;
    }
    wants.ask(pair);
    let name = state.pair_name();
    wants.ask_unless(state.document.stored.contains_key(name), LabelsKey(pair));
    let (measured, predicted) = (ImprintSource::Measured, ImprintSource::Predicted);
    let (scene_measured, cloud_measured) = results::shows_cloud(state, measured);
    let (scene_predicted, cloud_predicted) = results::shows_cloud(state, predicted);

    let shown = state.fingers();
    for finger in state.rig().pads() {
        let on_screen = shown.contains(&finger);
        let image = state.needs(Demand::Imprint(predicted)) && on_screen;
        let compared = state.needs(Demand::Comparison) && on_screen;
        if image || compared || cloud_predicted {
            results::want_stored(wants, finger, pair.finger(finger));
            results::want_imprint(wants, finger, pair.finger(finger));
        }
        if cloud_predicted {
            results::want_other_finger(wants, finger);
        }
        if compared {
            results::want_comparison(wants, finger, pair.finger(finger));
        }
    }
    let drawn = state.settings.mask_visible || state.needs(Demand::Masks);
    for (cloud, pose, source) in
        [(cloud_measured, scene_measured, measured), (cloud_predicted, scene_predicted, predicted)]
    {
        let seen = drawn && state.needs(Demand::Imprint(source));
        results::want_side(wants, source, [cloud, pose], |finger| seen && shown.contains(&finger));
        if pose && state.document.stroke.is_none() {
            workbench(wants, source);
        }
    }
    let posable =
        || results::tool(state).ready().is_some() && results::cloud(state, state.inspect.source).ready().is_some();
    if state.document.stroke.is_none() && posable() {
        results::want_inspection(wants);
    }
    results::want_proposal(wants);
    results::want_predictions_ahead(wants);
    results::want_others(wants);
}

/// Asks for what the workbench shows of an imprint whose cloud is needed anyway.
fn workbench(wants: &mut Demands<'_>, source: ImprintSource) {
    let state = wants.state;
    if results::tool(state).ready().is_none() || results::cloud(state, source).ready().is_none() {
        return;
    }
    if let Some(run) = state.workbench.hand(source).and_then(|hand| hand.icp.clone()) {
        wants.ask(run);
    }
    results::want_layers(wants, source);
    results::want_deviation(wants, source);
}

fn neighbors(wants: &mut Demands<'_>) {
    let state = wants.state;
    let (Some(open), Some(selected)) = (state.library.open.as_ref(), state.selection.pair) else {
        return;
    };
    if !state.shows_pair() {
        return;
    }
    let Some(row) = state.library.row_of(selected) else {
        return;
    };
    let order = &state.library.order;
    for distance in 1..=PREFETCH {
        for at in [row.checked_add(distance), row.checked_sub(distance)].into_iter().flatten() {
            if let Some(pair) = order.get(at) {
                wants.ask(open.key(*pair));
            }
        }
    }
}
