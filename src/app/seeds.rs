//! The room of several seeds of one touch.

pub mod state;

pub use state::{COUNT, Seeds};

use super::state::State;

/// What can be done with seeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeedsCommand {
    /// How many; limited to [`COUNT`].
    Count(usize),
    /// Makes those that are missing, or stops.
    Run(bool),
}

pub(super) fn step(state: &mut State, command: SeedsCommand) {
    match command {
        SeedsCommand::Count(count) => state.seeds.count = count.clamp(*COUNT.start(), *COUNT.end()),
        SeedsCommand::Run(running) => state.seeds.running = running,
    }
}
