//! The room of running jobs and the log.

pub mod state;

use std::path::PathBuf;

pub use state::{Entry, Level, Log, Task, Tasks, Ticket};

use super::effect::Effect;
use super::state::State;
use touch2touch_work::error::TaskError;

/// What can happen to jobs and log.
#[derive(Clone, Debug)]
pub enum TasksCommand {
    /// Tells a job to stop.
    Cancel(Ticket),
    /// Tells every job to stop.
    CancelAll,
    /// Tries again what could not be computed.
    Retry,
    /// Log entries up to a number were seen.
    LogSeen(u64),
    /// Adds an error of the window's own.
    Report(TaskError),
    /// Adds a notice of the window's own.
    Notice(String),
    /// Adds a notice of something that the window wrote there.
    Saved(String, PathBuf),
    /// Shows a file or folder in the system's own window.
    Reveal(PathBuf),
}

pub(super) fn step(state: &mut State, command: TasksCommand, effects: &mut Vec<Effect>) {
    match command {
        TasksCommand::Cancel(ticket) => {
            if let Some(task) = state.tasks.running.get_mut(&ticket) {
                task.cancelling = true;
                effects.push(Effect::Cancel(ticket));
            }
        }
        TasksCommand::CancelAll => cancel_all(state, effects),
        TasksCommand::Retry => state.tasks.failed.clear(),
        TasksCommand::LogSeen(number) => state.log.seen = state.log.seen.max(number),
        TasksCommand::Report(err) => state.log.error(&err),
        TasksCommand::Notice(text) => state.log.info(text),
        TasksCommand::Saved(text, place) => state.log.saved(text, place),
        TasksCommand::Reveal(place) => effects.push(Effect::Reveal(place)),
    }
}

/// Tells every job to stop.
pub(super) fn cancel_all(state: &mut State, effects: &mut Vec<Effect>) {
    for (ticket, task) in &mut state.tasks.running {
        task.cancelling = true;
        effects.push(Effect::Cancel(*ticket));
    }
}

/// Ends a task; what it showed on the way is not shown any more.
pub(super) fn forget(state: &mut State, ticket: Ticket) -> Option<Task> {
    let task = state.tasks.running.remove(&ticket)?;
    for recipe in &task.recipes {
        if state.results.previews.get(&recipe.touch).is_some_and(|preview| preview.recipe == *recipe) {
            state.results.previews.remove(&recipe.touch);
        }
    }
    Some(task)
}
