//! The room of running jobs and the log.

use std::path::PathBuf;

pub(crate) use super::state::tasks::RunningTask;
pub use super::state::tasks::{Entry, Level, Log, TaskKind, Tasks, Ticket};

use super::effect::{Access, Effect, TaskJob, TaskResult};
use super::jobs::Worker;
use super::state::State;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::job::{JobCx, Progress};

/// A command to jobs and log.
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

/// Name of a job that a person starts, and where it runs.
pub(super) struct Start {
    pub kind: TaskKind,
    /// The name on screen.
    pub title: String,
    /// The work that it does, for errors.
    pub what: String,
    pub worker: Worker,
}

impl Start {
    /// In the words of its kind, on the worker of its kind.
    pub(super) fn new(kind: TaskKind, title: impl Into<String>) -> Self {
        Self { kind, title: title.into(), what: kind.name().to_owned(), worker: kind.worker() }
    }
}

/// Starts a task, which is listed while it runs: what it does, and the consequences of its end. `None` where one of its kind has
/// to end first.
pub(super) fn start<'a, E: Send + Sync + 'static>(
    state: &'a mut State,
    Start { kind, title, what, worker }: Start,
    effects: &mut Vec<Effect>,
    run: impl FnOnce(&Access, &JobCx) -> Result<E, TaskError> + Send + 'static,
    ended: fn(&E, &mut State, &mut Vec<Effect>),
) -> Option<&'a mut RunningTask> {
    if kind.worker() == Worker::Batch && state.tasks.of_kind(kind).is_some() {
        return None;
    }
    state.tasks.last_ticket += 1;
    let ticket = Ticket(state.tasks.last_ticket);
    let body =
        Box::new(move |access: &Access, cx: &JobCx| run(access, cx).map(|end| TaskResult::new(kind, end, ended)));
    effects.push(Effect::Start(ticket, TaskJob { what, worker, body }));
    let (progress, recipes) = (Progress::default(), Vec::new());
    let task = RunningTask { kind, title, progress, recipes, opening: None, cancelling: false, outdated: false };
    Some(state.tasks.running.entry(ticket).or_insert(task))
}

/// Has something written to a place that a person named: what it says then, and where it lies.
pub(super) fn write(
    state: &mut State,
    (worker, what, title): (Worker, &str, &str),
    place: PathBuf,
    effects: &mut Vec<Effect>,
    writer: impl FnOnce(PathBuf, &Access, &JobCx) -> Result<(String, PathBuf), TaskError> + Send + 'static,
) {
    let job = Start { what: what.to_owned(), worker, ..Start::new(TaskKind::Write, title) };
    // As the system knows it, whatever folder the program was started in: what the log says must be found again.
    let run = |access: &Access, cx: &JobCx| writer(std::path::absolute(&place).unwrap_or(place), access, cx);
    start(state, job, effects, run, written);
}

/// Something was written.
pub fn written((line, place): &(String, PathBuf), state: &mut State, _: &mut Vec<Effect>) {
    state.log.saved(line, place.clone());
}

/// Tells every job to stop.
pub(super) fn cancel_all(state: &mut State, effects: &mut Vec<Effect>) {
    for (ticket, task) in &mut state.tasks.running {
        task.cancelling = true;
        effects.push(Effect::Cancel(*ticket));
    }
}

/// Ends a task; what it showed on the way is not shown any more.
pub(super) fn forget(state: &mut State, ticket: Ticket) -> Option<RunningTask> {
    let task = state.tasks.running.remove(&ticket)?;
    for recipe in &task.recipes {
        if state.results.previews.get(&recipe.touch).is_some_and(|preview| preview.recipe == *recipe) {
            state.results.previews.remove(&recipe.touch);
        }
    }
    Some(task)
}
