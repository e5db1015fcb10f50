//! [`Effect`]: what `apply` wants done outside the state.

use std::path::PathBuf;
use std::sync::Arc;

use super::jobs::Worker;
use super::keys::{DatasetSeq, Revision};
use super::results::preview::Onlooker;
use super::services::Services;
use super::source::Source;
use super::state::State;
use super::state::labels::PairLabels;
use super::state::settings::Settings;
use super::state::tasks::{TaskKind, Ticket};
use super::state::view::UiRequest;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{Operation, Unsaved};

/// A pair whose labels are to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelsToSave {
    /// The opening of the data set it is of.
    pub seq: DatasetSeq,
    /// The name.
    pub name: String,
    /// The number of this request.
    pub revision: Revision,
    /// The labels to write.
    pub labels: PairLabels,
    /// The deed.
    pub deed: Operation,
}

/// Labels that could not be written.
#[derive(Clone, Debug)]
pub struct NotSaved {
    /// The data set they are of.
    pub source: Arc<Source>,
    /// The labels that were to be written.
    pub save: LabelsToSave,
    /// Why not.
    pub err: TaskError,
}

/// The access of a task to what it does not hold itself.
pub struct Access {
    /// Files and models.
    pub services: Arc<Services>,
    /// Who looks at pictures of predictions on the way.
    pub onlooker: Onlooker,
}

/// A job that a person starts, with all that it needs. `tasks::start` lists it; the rest follows.
pub trait Task: Send + 'static {
    /// The value that it ends with.
    type End: Send + Sync + 'static;

    /// The row among what can be started.
    const KIND: TaskKind;

    /// The work that it does, for errors.
    fn what(&self) -> String {
        Self::KIND.name().to_owned()
    }

    /// The worker that it runs on.
    fn worker(&self) -> Worker {
        Self::KIND.worker()
    }

    /// Does it.
    ///
    /// # Errors
    /// If it cannot be done, or was told to stop.
    fn run(self, access: &Access, cx: &JobCx) -> Result<Self::End, TaskError>;

    /// The consequences of its end.
    fn ended(end: &Self::End, state: &mut State, effects: &mut Vec<Effect>);
}

/// The body of a task.
type Doing = Box<dyn FnOnce(&Access, &JobCx) -> Result<TaskResult, TaskError> + Send>;
/// The consequences of its end.
type Follows = Arc<dyn Fn(&mut State, &mut Vec<Effect>) + Send + Sync>;

/// A task on its way to its worker.
pub struct TaskJob {
    /// The work that it does, for errors.
    pub what: String,
    /// The worker that it runs on.
    pub worker: Worker,
    /// The way.
    pub body: Doing,
}

impl TaskJob {
    /// A task of any kind.
    pub(super) fn new<E: Task>(task: E) -> Self {
        let (what, worker) = (task.what(), task.worker());
        Self { what, worker, body: Box::new(|access, cx| Ok(TaskResult::of::<E>(task.run(access, cx)?))) }
    }
}

/// The end of a task.
#[derive(Clone)]
pub struct TaskResult {
    /// The kind.
    pub kind: TaskKind,
    follows: Follows,
}

impl TaskResult {
    /// With what follows from it.
    pub fn of<E: Task>(end: E::End) -> Self {
        Self { kind: E::KIND, follows: Arc::new(move |state, effects| E::ended(&end, state, effects)) }
    }

    /// Lets that follow.
    pub(super) fn apply_to(&self, state: &mut State, effects: &mut Vec<Effect>) {
        (self.follows)(state, effects);
    }
}

impl std::fmt::Debug for TaskResult {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "TaskResult({:?})", self.kind)
    }
}

/// Work that leaves the state.
pub enum Effect {
    /// Do what a person started.
    Start(Ticket, TaskJob),
    /// Tell it to stop.
    Cancel(Ticket),
    /// Follow the folder of a data set, or none any more.
    Follow(Option<(DatasetSeq, Arc<Source>)>),
    /// Look for bundles.
    FindBundles(Vec<PathBuf>),
    /// Write the labels of a pair; a newer request for the same pair replaces a waiting one.
    SaveLabels(Arc<Source>, Box<LabelsToSave>),
    /// Write labels that could not be written where they belong to another folder.
    KeepLabels {
        /// The data.
        source: Arc<Source>,
        /// The labels to be written.
        unsaved: Vec<Unsaved>,
        /// The folder; `None` = where they wait for the next opening.
        folder: Option<PathBuf>,
        /// The requests that it is the answer to.
        revisions: Vec<(String, Revision)>,
    },
    /// Write the settings; a newer request replaces a waiting one.
    SaveSettings(Box<Settings>),
    /// Show a file or folder in the system's own window.
    Reveal(PathBuf),
    /// Something only the window can do.
    Ui(UiRequest),
}

impl Effect {
    /// Has labels wait for the next opening of their data set.
    pub(super) fn keep_waiting(source: Arc<Source>, unsaved: Vec<Unsaved>) -> Self {
        Self::KeepLabels { source, unsaved, folder: None, revisions: Vec::new() }
    }
}
