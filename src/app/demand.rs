//! What the visible panes need, is not there, and can be computed from what is there.
//!
//! Each result says in its own file when it is asked for; here stands what is more urgent than what.

use super::keys::ImprintSource;
use super::pane::Demand;
use super::results::labels::LabelsKey;
use super::results::{Cached, Request};
use super::state::State;

/// Neighbors loaded ahead on each side of the selection.
pub(crate) const PREFETCH: usize = 4;

impl State {
    /// What the visible panes need, is not there, and can be computed from what is there; most urgent first.
    ///
    /// Pure: the same state wants the same. A result that is computed makes the next one possible.
    pub fn demands(&self) -> Vec<Request> {
        let mut list = Demands { state: self, list: Vec::new() };
        list.selection();
        list.versus();
        list.seeds();
        list.thumbnails();
        list.scores();
        list.label_stats();
        list.neighbors();
        list.mask_plan();
        list.import_plan();
        list.train_plan();
        list.list
    }

    /// Whether the cloud of an imprint is needed for the 3D views and what lies beside them (with its pose), and
    /// whether it is needed at all.
    pub(super) fn shows_cloud(&self, source: ImprintSource) -> (bool, bool) {
        let other = source.other();
        let layers = self.needs(Demand::Layers) && self.workbench.side == source;
        let both = self.workbench.both_clouds && self.needs(Demand::Scene(other));
        let scene = layers || both || self.needs(Demand::Scene(source)) || self.needs(Demand::Poses);
        let inspected = self.inspect.source == source && (self.needs(Demand::Steps) || self.needs(Demand::Basin));
        let scene = scene || self.proposes_at_pose(source) || self.shows_influence(source);
        (scene, scene || inspected)
    }
}

/// Collects what is missing.
pub(super) struct Demands<'a> {
    pub(super) state: &'a State,
    list: Vec<Request>,
}

impl Demands<'_> {
    /// Asks for a result, unless it is there or could not be computed.
    pub(super) fn ask<K: Cached>(&mut self, key: K) {
        self.ask_unless(K::cache(&self.state.results).contains(&key), key);
    }

    /// Asks for a result whose being there is not told by a cache of its own.
    pub(super) fn ask_unless(&mut self, there: bool, request: impl Into<Request>) {
        if there {
            return;
        }
        let request = request.into();
        if !self.state.tasks.failed.contains_key(&request) && !self.list.contains(&request) {
            self.list.push(request);
        }
    }

    fn selection(&mut self) {
        let state = self.state;
        let Some(pair) = state.pair_key() else { return };
        if !state.shows_pair() {
            return;
        }
        self.ask(pair);
        let name = state.pair_name();
        let labels = LabelsKey { pair, repeat: state.document.repeats.contains_key(name) };
        self.ask_unless(state.document.stored.contains_key(name), labels);
        let (measured, predicted) = (ImprintSource::Measured, ImprintSource::Predicted);
        let (scene_measured, cloud_measured) = state.shows_cloud(measured);
        let (scene_predicted, cloud_predicted) = state.shows_cloud(predicted);

        let shown = state.fingers();
        for finger in state.rig().pads() {
            let on_screen = shown.contains(&finger);
            let image = state.needs(Demand::Imprint(predicted)) && on_screen;
            let compared = state.needs(Demand::Comparison) && on_screen;
            if image || compared || cloud_predicted {
                self.stored(finger, pair.finger(finger));
                self.imprint(finger, pair.finger(finger));
            }
            if cloud_predicted {
                self.other_finger(finger);
            }
            if compared {
                self.comparison(finger, pair.finger(finger));
            }
            if on_screen && state.needs(Demand::Ambiguity) {
                self.ambiguity(finger, pair.finger(finger));
            }
            let drawn = on_screen && (state.settings.mask_visible || state.needs(Demand::Masks));
            if cloud_measured || (drawn && state.needs(Demand::Imprint(measured))) {
                self.mask(measured, finger);
            }
            if cloud_predicted || (drawn && state.needs(Demand::Imprint(predicted))) {
                self.mask(predicted, finger);
            }
        }
        // While the pen is down the cloud would be out of date before it is there.
        if state.document.stroke.is_none() {
            for (cloud, pose, source) in
                [(cloud_measured, scene_measured, measured), (cloud_predicted, scene_predicted, predicted)]
            {
                if cloud && self.cloud(source) && pose {
                    self.pose(source);
                    self.workbench(source);
                }
            }
            // The recorded run, and the map of starts last: it takes the longest.
            if state.tool().ready().is_some() && state.cloud(state.inspect.source).ready().is_some() {
                self.inspection();
                self.basin();
            }
        }
        self.proposal();
        self.predictions_ahead();
        if state.needs(Demand::Ledger) {
            self.ledger(pair.finger(state.selection.finger));
        }
    }

    /// What the workbench shows of an imprint whose cloud is needed anyway.
    fn workbench(&mut self, source: ImprintSource) {
        let state = self.state;
        if state.tool().ready().is_none() || state.cloud(source).ready().is_none() {
            return;
        }
        if state.needs(Demand::FingerPoses) {
            self.pose_table(source);
        }
        if let Some(run) = state.workbench.hand(source).and_then(|hand| hand.icp.clone()) {
            self.ask(run);
        }
        self.layers(source);
        self.deviation(source);
        self.influence(source);
    }

    fn neighbors(&mut self) {
        let state = self.state;
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
                    self.ask(open.key(*pair));
                }
            }
        }
    }
}
