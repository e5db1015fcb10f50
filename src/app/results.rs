//! The computing of each result, when it is asked for, and how views look it up: one file for each kind.
//!
//! The results themselves and their keys lie below, in [`super::state::results`] and [`super::keys`]. All that is read of the
//! state here is found by its functions, whichever file they are in: `results::pose(state, source)`.

use std::sync::Arc;

use super::jobs::Job;
use super::services::Services;
use super::state::State;
use super::state::results::{Cached, Computed, Key, Request, table};
use touch2touch_pipeline::error::TaskError;

pub(crate) mod compare;
pub(crate) mod estimate;
pub(crate) mod imprint;
pub(crate) mod labels;
pub(crate) mod manual;
pub(crate) mod mask;
pub(crate) mod on_screen;
pub(crate) mod outdated;
pub(crate) mod plans;
pub(crate) mod prediction;
pub(crate) mod preview;
pub(crate) mod proposal;
pub(crate) mod registration;
pub(crate) mod sample;
pub(crate) mod scores;
pub(crate) mod shown;
pub(crate) mod tool;

pub use compare::{comparison, subject, subject_key, subject_pose, subjects_compared};
pub(crate) use compare::{want_compared, want_comparison};
pub use estimate::{cloud, pose, pose_key, pose_of};
pub(crate) use estimate::{cloud_key, latest, registered, want_side};
pub(crate) use imprint::want_imprint;
pub use imprint::{flags, imprint, predicted_color};
pub use manual::{accepted, accepted_elsewhere, by_hand, manual_begins, shown_pose};
pub(crate) use manual::{shown_imprint, sides_apart};
pub use mask::{MaskInForce, drawn_mask, mask_in_force, mask_places};
pub(crate) use mask::{
    automatic_mask, automatic_provenance, awaits_tool, drawn_mask_on, mask_place, mask_recipe, mask_version, want_mask,
};
pub use on_screen::proposes;
pub(crate) use on_screen::{fingers_to_generate, shows_cloud, shows_deviation, shows_layers, shows_steps};
pub use outdated::{Outdated, Why, outdated};
pub(crate) use plans::{
    doctor_key, import_setup, train_plan_key, want_doctor, want_import_plan, want_mask_plan, want_train_plan,
};
pub use plans::{import_plan_key, mask_plan_key};
pub use prediction::can_generate;
pub(crate) use prediction::{
    can_start, keep_prediction, prefetch, want_other_finger, want_predictions_ahead, want_stored,
};
pub use preview::{Onlooker, PreviewRequest, preview, preview_request};
pub(crate) use proposal::want_proposal;
pub use proposal::{proposal, proposal_key, shown_proposal};
pub use registration::{deviation, inspected, inspection, layers, ranking};
pub(crate) use registration::{inspected_in, run_key, want_deviation, want_inspection, want_layers};
pub use sample::{bubble, gelslim, sample, thumbnail, touch, truth};
pub(crate) use sample::{gone, want_thumbnails};
pub use scores::evaluated;
pub(crate) use scores::evaluation_setup;
pub use shown::{chosen, imprint_key, shown, worked_on};
pub(crate) use shown::{imprint_of, pick, picked};
pub use tool::{tool, tool_name};
pub(crate) use tool::{tool_key, want_tool};

/// A key that says how its result is computed.
pub(crate) trait Computes: Key {
    /// The job, with its inputs gathered; `None` if one is not there (any more).
    fn job(&self, state: &State, services: &Arc<Services>) -> Option<Job<Self::Value>>;

    /// Asks for it where a pane on screen needs it and nothing else asks.
    fn wanted(_wants: &mut Demands<'_>) {}

    /// The consequences of a result besides its being kept in its cache.
    fn arrived(&self, _state: &mut State, _value: &Arc<Self::Value>) {}

    /// The consequences of a failure; whether the log says it although a pane shows it in place of the result.
    fn failed(&self, _state: &mut State, _err: &TaskError) -> bool {
        false
    }
}

macro_rules! computing {
    ($(
        #[doc = $doc:literal]
        $variant:ident($key:ident => $value:ty $(, $bytes:expr)?) $(in $cache:ident, $budget:expr)?;
    )*) => {
        /// Asks for the results that say themselves when they are wanted, in the order of the table.
        pub(crate) fn want_others(wants: &mut Demands<'_>) {
            $( <$crate::app::keys::$key as Computes>::wanted(wants); )*
        }

        /// The job of a request; `None` if an input is not there (any more).
        pub(super) fn job(request: &Request, state: &State, services: &Arc<Services>) -> Option<Job<Computed>> {
            match request { $( Request::$variant(key) => {
                let (done, Job { worker, what, body }) = (key.clone(), key.job(state, services)?);
                Some(Job::new(worker, what, move |cx| Ok(Computed::$variant(done, Arc::new(body(cx)?)))))
            } )* }
        }

        /// The consequences of the failure of a request; whether the log says it.
        pub(super) fn failed(request: &Request, state: &mut State, err: &TaskError) -> bool {
            match request { $( Request::$variant(key) => key.failed(state, err), )* }
        }

        /// Keeps a result under its key, with what follows from it.
        pub(super) fn keep(computed: Computed, state: &mut State) {
            match computed { $( Computed::$variant(key, value) => {
                $( state.results.$cache.insert(key.clone(), value.clone(), <$crate::app::keys::$key as Key>::bytes(&value)); )?
                key.arrived(state, &value);
            } )* }
        }
    };
}

table!(computing);

/// Collects what is missing of what the visible panes need, most urgent first.
pub(crate) struct Demands<'a> {
    pub(crate) state: &'a State,
    pub(super) list: Vec<Request>,
}

impl Demands<'_> {
    /// Asks for a result, unless it is there or could not be computed.
    pub(crate) fn ask<K: Cached>(&mut self, key: K) {
        self.ask_unless(K::cache(&self.state.results).contains(&key), key);
    }

    /// Asks for a result whose being there is not told by a cache of its own.
    pub(crate) fn ask_unless(&mut self, there: bool, request: impl Into<Request>) {
        if there {
            return;
        }
        let request = request.into();
        if !self.state.tasks.failed.contains_key(&request) && !self.list.contains(&request) {
            self.list.push(request);
        }
    }
}
