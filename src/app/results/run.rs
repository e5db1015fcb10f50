//! Registrations with everything recorded: every step, and what became of every point.

use super::super::jobs::{Job, Lane};
use super::super::keys::{ImprintSource, PoseBits, RunKey};
use super::super::results;
use super::super::results::Computes;
use super::super::services::SharedServices;
use super::super::state::State;
use touch2touch_core::align::Ask;
use touch2touch_pipeline::steps::pose::PoseResult;

impl Computes for RunKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<PoseResult>> {
        let registered = results::registered(state, &self.pose)?;
        let (registration, start) = (self.pose.registration, self.start.map(PoseBits::get));
        Some(Job::new(Lane::Compute, "Registration, recorded", move |_| {
            let ask = Ask { starts: start.as_ref().map(std::slice::from_ref), record: true, ..Ask::default() };
            registered.pose(registration, ask)
        }))
    }
}

/// The recorded registration from the registration's own starts; `None` while its inputs are not there.
pub(crate) fn run_key(state: &State, source: ImprintSource) -> Option<RunKey> {
    Some(RunKey { pose: results::pose_key(state, source).ok()??, start: None })
}
