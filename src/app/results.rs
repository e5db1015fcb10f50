//! The computing of each result, when it is asked for, and how views look it up: one file for each kind.
//!
//! The results themselves and their keys lie below, in [`super::state::results`] and [`super::keys`]. All that is read of the
//! state here is found by its functions, whichever file they are in: `results::pose(state, source)`.

use std::sync::Arc;

use super::jobs::Job;
use super::services::Services;
use super::state::State;
use super::state::results::{Computed, Key, Request, table};
use touch2touch_pipeline::error::TaskError;

pub(crate) mod compare;
pub(crate) mod estimate;
pub(crate) mod imprint;
pub(crate) mod mask;
pub(crate) mod on_screen;
pub(crate) mod plans;
pub(crate) mod prediction;
pub(crate) mod proposal;
pub(crate) mod registration;
pub(crate) mod sample;

pub use compare::*;
pub use estimate::*;
pub use imprint::*;
pub use mask::*;
pub use on_screen::*;
pub use plans::*;
pub use prediction::*;
pub use proposal::*;
pub use registration::*;
pub use sample::*;

/// A key that says how its result is computed.
pub(crate) trait Computes: Key {
    /// The job, with its inputs gathered; `None` if one is not there (any more).
    fn job(&self, state: &State, services: &Arc<Services>) -> Option<Job<Self::Value>>;

    /// True where it is there, or on its way, though no cache of its own says so.
    fn is_there(&self, _state: &State) -> bool {
        false
    }

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

        /// True where a result is there, so that nobody needs to ask for it.
        fn is_there(request: &Request, state: &State) -> bool {
            match request { $( Request::$variant(key) => {
                $( state.results.$cache.contains(key) || )? key.is_there(state)
            } )* }
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
    pub(crate) fn ask(&mut self, request: impl Into<Request>) {
        let request = request.into();
        let known = is_there(&request, self.state) || self.state.tasks.failed.contains_key(&request);
        if !known && !self.list.contains(&request) {
            self.list.push(request);
        }
    }
}
