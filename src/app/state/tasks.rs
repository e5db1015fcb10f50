//! Running jobs as the status bar shows them, and the log.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;

use super::super::jobs::Worker;
use super::super::keys::{DatasetSeq, PredictionKey};
use super::super::state::results::Request;
use touch2touch_pipeline::error::{TaskError, TaskErrorKind};
use touch2touch_pipeline::job::Progress;

/// The name of a running job.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Ticket(pub u64);

macro_rules! kinds {
    ($( #[doc = $doc:literal] $kind:ident, $name:literal, $worker:ident, $kept:literal; )*) => {
        /// A kind of job that a person can start. On [`Worker::Batch`] there is one of a kind at a time, and nobody waits for
        /// its end any more once another data set is open.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumIter)]
        pub enum TaskKind { $( #[doc = $doc] $kind, )* }

        impl TaskKind {
            /// The work that it does, for errors.
            pub fn name(self) -> &'static str {
                match self { $( Self::$kind => $name, )* }
            }

            /// Meaning of stopping it, in a sentence.
            pub(crate) fn kept(self) -> &'static str {
                match self { $( Self::$kind => $kept, )* }
            }

            /// The worker that it runs on.
            pub(crate) fn worker(self) -> Worker {
                match self { $( Self::$kind => Worker::$worker, )* }
            }
        }
    };
}

kinds! {
    /// A data set is opened.
    Open, "Open", Files,
        "Stop; the previous data set stays open";
    /// A tool's CAD file is read in another unit.
    ReadTool, "Read the tool", Files,
        "Stop; the tool stays as it is";
    /// A data set is read otherwise than it is stored.
    ReadOtherwise, "Read the data otherwise", Files,
        "Stop; the data set stays as it is";
    /// Touches of a pair are predicted.
    Generate, "Generate", Models,
        "Stop generating; what is shown stays";
    /// Shift statistics are made.
    Refit, "Match depths", Models,
        "Stop matching depths";
    /// Something is written to a place that a person named.
    Write, "Write", Files,
        "Stop; what is already written stays";
    /// Masks are taken over that lie in a form of other programs.
    Import, "Import masks", Files,
        "Stop; masks imported so far stay";
    /// A data set is scored.
    Evaluate, "Evaluate", Batch,
        "Stop, and show the scores so far";
    /// The models are tried on a sample of a data set.
    TryModels, "Try the models", Batch,
        "Stop trying the models";
    /// Every pair of a data set is examined.
    Examine, "Check the pairs", Batch,
        "Stop; the other pairs are not checked";
    /// A generator is fitted to pairs, or a mask model trained.
    Learn, "Adapt a model", Batch,
        "Stop; the same goes on from here when it is asked for again";
}

/// A job that a person started.
#[derive(Clone, Debug)]
pub struct RunningTask {
    /// The kind.
    pub kind: TaskKind,
    /// The name on screen, e.g. `Generate data_4 right`.
    pub title: String,
    /// The progress.
    pub progress: Progress,
    /// The predictions it makes, if it makes any: one per finger.
    pub recipes: Vec<PredictionKey>,
    /// The data set it opens, if it opens one.
    pub opening: Option<DatasetSeq>,
    /// True where it was told to stop and has not stopped yet.
    pub cancelling: bool,
    /// True where another data set was opened since.
    pub outdated: bool,
}

/// Running jobs, and what the panes wait for.
#[derive(Clone, Debug, Default)]
pub struct Tasks {
    /// Jobs that a person started, by ticket.
    pub running: BTreeMap<Ticket, RunningTask>,
    /// The requests that the visible panes wait for: the list last handed to the runtime.
    pub demanded: Vec<Request>,
    /// Results that could not be computed, and why: they are not tried again until something changes.
    pub failed: BTreeMap<Request, TaskError>,
    pub(in crate::app) last_ticket: u64,
}

impl Tasks {
    /// The task that generates `recipe`.
    pub fn generating(&self, recipe: &PredictionKey) -> Option<(Ticket, &RunningTask)> {
        self.running.iter().find(|(_, task)| task.recipes.contains(recipe)).map(|(t, task)| (*t, task))
    }

    /// A task that makes predictions.
    pub(crate) fn any_generating(&self) -> Option<(Ticket, &RunningTask)> {
        self.running.iter().find(|(_, task)| !task.recipes.is_empty()).map(|(t, task)| (*t, task))
    }

    /// True where nothing runs and nothing waits.
    pub fn is_idle(&self) -> bool {
        self.running.is_empty() && self.demanded.is_empty()
    }

    /// The running task of a kind for the data set that is open.
    pub fn of_kind(&self, kind: TaskKind) -> Option<(Ticket, &RunningTask)> {
        let mut tasks = self.running.iter();
        tasks.find(|(_, task)| task.kind == kind && !task.outdated).map(|(ticket, task)| (*ticket, task))
    }
}

/// The degree to which a person should care.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Something was done.
    Info,
    /// Something needs care.
    Warning,
    /// Something did not work.
    Error,
}

/// One line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Counts up from 1: a toast is shown once per number.
    pub number: u64,
    /// The degree to which a person should care.
    pub level: Level,
    /// The event, in words.
    pub text: String,
    /// Why, and other detail.
    pub detail: Option<String>,
    /// The advice.
    pub hint: Option<String>,
    /// The place that was written to, if it says so.
    pub place: Option<PathBuf>,
    /// The pair whose labels it says were changed: that can be taken back.
    pub changed: Option<String>,
    /// The number of times that the line came in a row.
    pub count: u32,
}

/// The log of what happened, newest last.
#[derive(Clone, Debug, Default)]
pub struct Log {
    /// The entries; old ones are dropped.
    pub entries: VecDeque<Entry>,
    /// Entries up to this number were seen: their toast was closed.
    pub seen: u64,
    last: u64,
}

/// Entries kept.
const MAX_ENTRIES: usize = 500;

impl Log {
    /// Adds a line; the same line again only counts up.
    pub fn push(&mut self, level: Level, text: impl Into<String>, detail: Option<String>, hint: Option<String>) {
        let text = text.into();
        if let Some(last) = self.entries.back_mut()
            && last.level == level
            && last.text == text
            && last.detail == detail
        {
            last.count += 1;
            return;
        }
        self.last += 1;
        self.entries.push_back(Entry {
            number: self.last,
            level,
            text,
            detail,
            hint,
            place: None,
            changed: None,
            count: 1,
        });
        if self.entries.len() > MAX_ENTRIES {
            self.entries.pop_front();
        }
    }

    /// Adds a notice.
    pub fn info(&mut self, text: impl Into<String>) {
        self.push(Level::Info, text, None, None);
    }

    /// Adds a notice of something that was written to a place.
    pub fn saved(&mut self, text: impl Into<String>, place: PathBuf) {
        self.info(text);
        self.place_last(place);
    }

    /// Adds a notice of a change to the labels of a pair.
    pub(in crate::app) fn changed(&mut self, text: impl Into<String>, pair: &str) {
        self.info(text);
        if let Some(entry) = self.entries.back_mut() {
            entry.changed = Some(pair.to_owned());
        }
    }

    /// Says of the last line which place it is about.
    pub(crate) fn place_last(&mut self, place: PathBuf) {
        if let Some(entry) = self.entries.back_mut() {
            entry.place = Some(place);
        }
    }

    /// Adds a failure. Being told to stop is only a notice.
    pub fn error(&mut self, err: &TaskError) {
        let (level, text, detail) = match err.kind {
            TaskErrorKind::Cancelled => (Level::Info, format!("{}: cancelled", err.what), None),
            TaskErrorKind::Failed | TaskErrorKind::Lost | TaskErrorKind::Panicked => {
                (Level::Error, err.what.clone(), Some(err.why.clone()))
            }
        };
        self.push(level, text, detail, err.hint.clone());
    }

    /// Entries whose toast was not closed yet.
    pub fn unseen(&self) -> impl Iterator<Item = &Entry> {
        self.entries.iter().filter(|entry| entry.number > self.seen)
    }
}
