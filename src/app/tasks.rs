//! The room of running jobs and the log.

use std::path::PathBuf;

pub(crate) use super::state::tasks::RunningTask;
pub use super::state::tasks::{Entry, Level, Log, TaskKind, Tasks, Ticket};

use super::effect::{Access, Effect, Task, TaskJob};
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

/// Starts a task, listed under a title while it runs. `None` where one of its kind has to end first.
pub(super) fn start<'a, E: Task>(
    state: &'a mut State,
    title: impl Into<String>,
    task: E,
    effects: &mut Vec<Effect>,
) -> Option<&'a mut RunningTask> {
    if E::KIND.worker() == Worker::Batch && state.tasks.of_kind(E::KIND).is_some() {
        return None;
    }
    state.tasks.last_ticket += 1;
    let ticket = Ticket(state.tasks.last_ticket);
    effects.push(Effect::Start(ticket, TaskJob::new(task)));
    let task = RunningTask {
        kind: E::KIND,
        title: title.into(),
        progress: Progress::default(),
        recipes: Vec::new(),
        opening: None,
        cancelling: false,
        outdated: false,
    };
    Some(state.tasks.running.entry(ticket).or_insert(task))
}

/// Something that is written to a place that a person named: what it says then, and where it lies.
type Writer = Box<dyn FnOnce(PathBuf, &Access, &JobCx) -> Result<(String, PathBuf), TaskError> + Send>;

/// Has something written.
pub struct Write {
    worker: Worker,
    what: &'static str,
    place: PathBuf,
    writer: Writer,
}

impl Write {
    /// On a worker, in these words, to that place.
    pub(super) fn new(
        worker: Worker,
        what: &'static str,
        place: PathBuf,
        writer: impl FnOnce(PathBuf, &Access, &JobCx) -> Result<(String, PathBuf), TaskError> + Send + 'static,
    ) -> Self {
        Self { worker, what, place, writer: Box::new(writer) }
    }
}

impl Task for Write {
    type End = (String, PathBuf);
    const KIND: TaskKind = TaskKind::Write;

    fn what(&self) -> String {
        self.what.to_owned()
    }

    fn worker(&self) -> Worker {
        self.worker
    }

    fn run(self, access: &Access, cx: &JobCx) -> Result<Self::End, TaskError> {
        // As the system knows it, whatever folder the program was started in: what the log says must be found again.
        (self.writer)(std::path::absolute(&self.place).unwrap_or(self.place), access, cx)
    }

    fn ended((line, place): &Self::End, state: &mut State, _: &mut Vec<Effect>) {
        state.log.saved(line, place.clone());
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
pub(super) fn forget(state: &mut State, ticket: Ticket) -> Option<RunningTask> {
    let task = state.tasks.running.remove(&ticket)?;
    for recipe in &task.recipes {
        if state.results.previews.get(&recipe.touch).is_some_and(|preview| preview.recipe == *recipe) {
            state.results.previews.remove(&recipe.touch);
        }
    }
    Some(task)
}
