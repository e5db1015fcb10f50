//! [`Effect`]: what `apply` wants done outside the state.

use std::path::PathBuf;
use std::sync::Arc;

use super::jobs::Worker;
use super::keys::{DatasetSeq, Revision};
use super::results::prediction::Onlooker;
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

/// The work of a job.
type Run = Box<dyn FnOnce(&Access, &JobCx) -> Result<TaskResult, TaskError> + Send>;

/// The consequences of the end of a task.
type Follows = Arc<dyn Fn(&mut State, &mut Vec<Effect>) + Send + Sync>;

/// A job that a person started, with all that it needs, on its way to its worker.
pub struct TaskJob {
    /// The work that it does, for errors.
    pub what: String,
    /// The worker that it runs on.
    pub worker: Worker,
    /// The way.
    pub body: Run,
}

/// The end of a task.
#[derive(Clone)]
pub struct TaskResult {
    /// The kind.
    pub kind: TaskKind,
    follows: Follows,
}

impl TaskResult {
    /// A value that it ended with, and what follows from it.
    pub fn new<E: Send + Sync + 'static>(
        kind: TaskKind,
        end: E,
        ended: impl Fn(&E, &mut State, &mut Vec<Effect>) + Send + Sync + 'static,
    ) -> Self {
        Self { kind, follows: Arc::new(move |state, effects| ended(&end, state, effects)) }
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
