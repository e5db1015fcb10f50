//! [`TaskError`]: a failure in words a person can act on.

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::io::dataset::ToolUnit;

/// Failure of a task: its name, the reason, and what to do about it. Shown once, in the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskError {
    /// Task that failed, e.g. `Load pattern_31_rod/data_4`.
    pub what: String,
    /// Why it did not work, with the file at the end where there is one.
    pub why: String,
    /// Advice for the user, where there is one.
    pub hint: Option<String>,
    /// Kind of end.
    pub kind: TaskErrorKind,
    /// Units in which the CAD model that it is about would fit.
    pub units: Option<Arc<UnitOffer>>,
}

/// The units in which a tool's CAD file would be as large as a tool, where it is not in the one that it is read in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnitOffer {
    /// The tool.
    pub tool: String,
    /// The units, each with how long the tool then is: `64.35 mm`.
    pub units: Vec<(ToolUnit, String)>,
    /// Content of `unit.txt` beside the file, if it is there.
    pub says: Option<String>,
}

/// A pair that was left out of a pass over a data set, or that is worth a look.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Remark {
    /// The pair.
    pub name: String,
    /// Reason, in words.
    pub why: String,
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.why)
    }
}

/// Kind of a task's end without a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskErrorKind {
    /// It met something wrong in its input or surroundings.
    Failed,
    /// The data set is not where it was opened: nothing can be written there.
    Lost,
    /// It was told to stop.
    Cancelled,
    /// A defect in this program; caught at the edge of the worker.
    Panicked,
}

impl TaskError {
    /// A failure of `what` because of `why`.
    pub fn new(what: impl Into<String>, why: impl fmt::Display) -> Self {
        Self { what: what.into(), why: why.to_string(), hint: None, kind: TaskErrorKind::Failed, units: None }
    }

    /// A failure with the whole chain of causes, each after a colon.
    pub fn from_error(what: impl Into<String>, err: &dyn std::error::Error) -> Self {
        Self::new(what, says(err))
    }

    /// The end of a task that was told to stop.
    pub fn cancelled(what: impl Into<String>) -> Self {
        Self { kind: TaskErrorKind::Cancelled, ..Self::new(what, "cancelled") }
    }

    /// A panic caught at the edge of a worker.
    pub fn panicked(what: impl Into<String>, message: &str) -> Self {
        let hint = "Nothing is lost. Please report this with the steps that led here.";
        Self {
            kind: TaskErrorKind::Panicked,
            ..Self::new(what, format!("an internal error: {message}")).with_hint(hint)
        }
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn with_hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// True where the task was told to stop.
    pub fn is_cancelled(&self) -> bool {
        self.kind == TaskErrorKind::Cancelled
    }
}

/// An error with its causes, each after a colon and said once: many errors print their cause themselves.
pub fn says(err: &dyn std::error::Error) -> String {
    let mut text = err.to_string();
    let mut source = err.source();
    while let Some(err) = source {
        let cause = err.to_string();
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
        source = err.source();
    }
    text
}

impl fmt::Display for TaskError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.what, self.why)?;
        if let Some(hint) = &self.hint {
            write!(f, ". {hint}")?;
        }
        Ok(())
    }
}

impl std::error::Error for TaskError {}
