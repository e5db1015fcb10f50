//! [`Effect`]: what `apply` wants done outside the state.

use std::path::PathBuf;
use std::sync::Arc;

use super::jobs::Lane;
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

/// The access of an errand to what it does not hold itself.
pub struct Access {
    /// Files and models.
    pub services: Arc<Services>,
    /// Who looks at pictures of predictions on the way.
    pub onlooker: Onlooker,
}

/// A job that a person starts, with all that it needs. `tasks::start` lists it; the rest follows.
pub trait Errand: Send + 'static {
    /// The value that it ends with.
    type End: Send + Sync + 'static;

    /// The row among what can be started.
    const KIND: TaskKind;

    /// The work that it does, for errors.
    fn what(&self) -> String {
        Self::KIND.name().to_owned()
    }

    /// The lane that it runs on.
    fn lane(&self) -> Lane {
        Self::KIND.lane()
    }

    /// Does it.
    ///
    /// # Errors
    /// If it cannot be done, or was told to stop.
    fn run(self, access: &Access, cx: &JobCx) -> Result<Self::End, TaskError>;

    /// The consequences of its end.
    fn ended(end: &Self::End, state: &mut State, effects: &mut Vec<Effect>);
}

/// The body of an errand.
type Doing = Box<dyn FnOnce(&Access, &JobCx) -> Result<Ended, TaskError> + Send>;
/// The consequences of its end.
type Follows = Arc<dyn Fn(&mut State, &mut Vec<Effect>) + Send + Sync>;

/// An errand on its way to its lane.
pub struct Started {
    /// The work that it does, for errors.
    pub what: String,
    /// The lane that it runs on.
    pub lane: Lane,
    /// The way.
    pub body: Doing,
}

impl Started {
    /// An errand of any kind.
    pub(super) fn new<E: Errand>(errand: E) -> Self {
        let (what, lane) = (errand.what(), errand.lane());
        Self { what, lane, body: Box::new(|access, cx| Ok(Ended::of::<E>(errand.run(access, cx)?))) }
    }
}

/// The end of an errand.
#[derive(Clone)]
pub struct Ended {
    /// The kind.
    pub kind: TaskKind,
    follows: Follows,
}

impl Ended {
    /// With what follows from it.
    pub fn of<E: Errand>(end: E::End) -> Self {
        Self { kind: E::KIND, follows: Arc::new(move |state, effects| E::ended(&end, state, effects)) }
    }

    /// Lets that follow.
    pub(super) fn land(&self, state: &mut State, effects: &mut Vec<Effect>) {
        (self.follows)(state, effects);
    }
}

impl std::fmt::Debug for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Ended({:?})", self.kind)
    }
}

/// Work that leaves the state.
pub enum Effect {
    /// Do what a person started.
    Start(Ticket, Started),
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
