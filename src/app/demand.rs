//! The demands of the visible panes: results that are not there and can be computed from what is there.
//!
//! Each result says in its own file when it is asked for; here stands what is more urgent than what.

use super::keys::{ImprintSource, LabelsKey, PairKey};
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
    let pair = state.pair_key().filter(|_| state.shows_pair());
    if let Some(pair) = pair {
        wants.ask(pair);
        wants.ask(LabelsKey(pair));
        let sides = [ImprintSource::Measured, ImprintSource::Predicted];
        let [measured, predicted] = sides.map(|source| results::shows_cloud(state, source));
        let shown = state.fingers();
        for finger in state.rig().pads() {
            let on_screen = shown.contains(&finger);
            let image = state.needs(Demand::Imprint(ImprintSource::Predicted)) && on_screen;
            let compared = state.needs(Demand::Comparison) && on_screen;
            if image || compared || predicted.1 {
                results::want_stored(&mut wants, finger, pair.finger(finger));
                results::want_imprint(&mut wants, finger, pair.finger(finger));
            }
            if predicted.1 {
                results::want_other_finger(&mut wants, finger);
            }
            if compared {
                results::want_comparison(&mut wants, finger, pair.finger(finger));
            }
        }
        let drawn = state.settings.mask_visible || state.needs(Demand::Masks);
        // While the pen is down poses would be out of date before they are there.
        let (at_rest, tool) = (state.document.stroke.is_none(), results::tool(state).ready().is_some());
        let posable = |source| at_rest && tool && results::cloud(state, source).ready().is_some();
        for (source, (pose, cloud)) in sides.into_iter().zip([measured, predicted]) {
            let seen = drawn && state.needs(Demand::Imprint(source));
            results::want_side(&mut wants, source, [cloud, pose], |finger| seen && shown.contains(&finger));
            if pose && posable(source) {
                if let Some(run) = state.workbench.hand(source).and_then(|hand| hand.icp.clone()) {
                    wants.ask(run);
                }
                results::want_layers(&mut wants, source);
                results::want_deviation(&mut wants, source);
            }
        }
        if posable(state.inspect.source) {
            results::want_inspection(&mut wants);
        }
        results::want_proposal(&mut wants);
        results::want_predictions_ahead(&mut wants);
        results::want_others(&mut wants);
    }
    results::want_compared(&mut wants);
    results::want_thumbnails(&mut wants);
    results::want_doctor(&mut wants);
    if let Some(pair) = pair {
        neighbors(&mut wants, pair);
    }
    results::want_mask_plan(&mut wants);
    results::want_import_plan(&mut wants);
    results::want_train_plan(&mut wants);
    wants.list
}

/// Results of the next pair that the visible panes would lack, for when nothing else is to be done: who pages on finds them.
pub(super) fn ahead(state: &mut State) -> Vec<Request> {
    let library = &state.library;
    let row = state.selection.pair.and_then(|pair| library.row_of(pair));
    let next = row.and_then(|row| library.order.get(row + 1)).copied();
    if next.is_none() || state.document.stroke.is_some() || !state.tasks.is_idle() {
        return Vec::new();
    }
    let here = std::mem::replace(&mut state.selection.pair, next);
    let mut wanted = demands(state);
    state.selection.pair = here;
    // Its neighbors wait until it is on screen.
    wanted.retain(|request| !matches!(request, Request::Sample(key) if Some(key.pair) != next));
    wanted
}

/// Asks for the pairs before and after the selected one.
fn neighbors(wants: &mut Demands<'_>, selected: PairKey) {
    let library = &wants.state.library;
    let Some(row) = library.row_of(selected.pair) else { return };
    for distance in 1..=PREFETCH {
        for at in [row.checked_add(distance), row.checked_sub(distance)].into_iter().flatten() {
            if let Some(pair) = library.order.get(at) {
                wants.ask(PairKey { pair: *pair, ..selected });
            }
        }
    }
}
