//! The room of the steps of a registration: moving about in what was recorded.

pub(crate) use super::state::inspect::Inspected;
pub use super::state::inspect::{Inspect, Inspection};

use super::effect::Effect;
use super::keys::ImprintSource;
use super::results;
use super::state::State;
use touch2touch_core::frames::PlanarPose;

/// A command to the steps of a registration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InspectCommand {
    /// Looks at the other imprint.
    Source(ImprintSource),
    /// Loads the run from a start (`grasp_from_object`), or all of the registration's own.
    Start(Option<PlanarPose>),
    /// Shows another start's run, at its end.
    Run(usize),
    /// Shows a step of a run.
    Go {
        /// The start.
        run: usize,
        /// The step.
        at: usize,
    },
    /// Moves by so many steps; stops at the ends.
    By(i64),
    /// Lets the steps go by, or stops them. At the end it begins again.
    Play(bool),
}

pub(super) fn step(state: &mut State, command: InspectCommand, _: &mut Vec<Effect>) {
    match command {
        InspectCommand::Source(source) => {
            if state.inspect.source != source {
                state.inspect.source = source;
                rewind(state);
            }
        }
        InspectCommand::Start(start) => {
            let start = start.filter(|s| s.is_finite()).map(Into::into);
            rewind(state);
            // A run that was loaded is watched from where it began.
            state.inspect.at = start.is_some().then_some(0);
            state.inspect.start = start;
        }
        InspectCommand::Run(run) => {
            state.inspect.run = Some(run);
            state.inspect.at = None;
            state.inspect.playing = false;
        }
        InspectCommand::Go { run, at } => {
            state.inspect.run = Some(run);
            state.inspect.playing = false;
            go(state, at);
        }
        InspectCommand::By(by) => {
            let Some(here) = results::inspected(state).map(|s| s.at) else { return };
            let to = (here as i64).saturating_add(by).max(0) as usize;
            go(state, to);
            if state.inspect.at.is_none() || by < 0 {
                state.inspect.playing = false;
            }
        }
        InspectCommand::Play(play) => {
            let Some((last, steps)) = results::inspected(state).map(|s| (s.is_last(), s.inspection.num_steps(s.run)))
            else {
                return;
            };
            state.inspect.playing = play && steps > 1;
            if state.inspect.playing && last {
                state.inspect.at = Some(0);
            }
        }
    }
}

/// Shows a step of the run shown; at its end the end is meant, however many steps another run has.
fn go(state: &mut State, at: usize) {
    let Some(steps) = results::inspected(state).map(|s| s.inspection.num_steps(s.run)) else { return };
    state.inspect.at = (at + 1 < steps).then_some(at);
}

/// Back to the end of the winner of the registration's own starts: another pair or imprint is looked at.
pub(super) fn rewind(state: &mut State) {
    let inspect = &mut state.inspect;
    (inspect.start, inspect.run, inspect.at, inspect.playing) = (None, None, None, false);
}
