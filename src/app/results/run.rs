//! Registrations with everything recorded: every step, and what became of every point.

use super::super::keys::PoseBits;
use super::pose::PoseKey;
use super::{Computes, ImprintSource, Job, Lane, SharedServices, State};
use touch2touch_core::align::Ask;
use touch2touch_work::pose::PoseResult;

/// A registration with everything recorded: every step, and what became of every point.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RunKey {
    /// What is registered, and how.
    pub pose: PoseKey,
    /// Where it starts (`grasp_from_object`); `None` = where the engine starts by itself.
    pub start: Option<PoseBits>,
}

impl Computes for RunKey {
    type Value = PoseResult;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<PoseResult>> {
        let registered = self.pose.find(state)?;
        let (engine, start) = (self.pose.engine, self.start.map(PoseBits::get));
        Some(Job::new(Lane::Compute, "Registration, recorded", move |_| {
            let ask = Ask { starts: start.as_ref().map(std::slice::from_ref), record: true, ..Ask::default() };
            registered.pose(engine, ask)
        }))
    }

    fn bytes(found: &PoseResult) -> usize {
        found.bytes()
    }
}

impl State {
    /// The recorded registration from the engine's own starts; `None` while its inputs are not there.
    pub(crate) fn run_key(&self, source: ImprintSource) -> Option<RunKey> {
        Some(RunKey { pose: self.pose_key(source).ok()??, start: None })
    }
}
