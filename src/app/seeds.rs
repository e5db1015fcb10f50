//! The room of several seeds of one touch.

pub use super::state::seeds::{COUNT, Seeds};

use super::effect::Effect;
use super::results;
use super::state::State;

/// A command to the seeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeedsCommand {
    /// The number, limited to [`COUNT`].
    Count(usize),
    /// Makes those that are missing for the pair on screen, or stops.
    Run(bool),
    /// True where they are made for every pair that is shown.
    EveryPair(bool),
}

pub(super) fn step(state: &mut State, command: SeedsCommand, _: &mut Vec<Effect>) {
    match command {
        SeedsCommand::Count(count) => state.seeds.count = count.clamp(*COUNT.start(), *COUNT.end()),
        SeedsCommand::Run(true) => state.seeds.asked = results::seeds_of(state),
        SeedsCommand::Run(false) => (state.seeds.asked, state.seeds.every) = (None, false),
        SeedsCommand::EveryPair(every) => state.seeds.every = every,
    }
}
