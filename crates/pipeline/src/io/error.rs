//! Why a file cannot be read, written or used.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use touch2touch_core::dataset::Problem;

/// The file, what is wrong with it, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}{}", of(file))]
pub struct FileError {
    /// The file or folder; empty where it is none.
    pub file: PathBuf,
    /// The fault.
    pub what: String,
    /// Advice for the user.
    pub hint: &'static str,
    /// The kind, as far as a caller acts on it.
    pub kind: FileErrorKind,
}

/// Kind of an error, as far as the caller of a reader or writer acts on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FileErrorKind {
    /// Nothing; of a file that is still being written, it may be over soon.
    #[default]
    Failed,
    /// A value is not in the file, or is no tensor: the rest may do without it.
    Missing,
    /// The content is whole and of something else: it stays so.
    Content,
    /// A CAD model would be a tool in another unit.
    Unit,
    /// The folder holds no data set.
    NothingFound,
    /// The declaration of the sensors cannot be used.
    Rig,
    /// The data set is no longer where it was opened.
    Lost,
}

fn of(file: &Path) -> String {
    if file.as_os_str().is_empty() { String::new() } else { format!(" ({})", file.display()) }
}

impl FileError {
    /// An error of what the file holds, or lacks.
    pub fn new(file: impl Into<PathBuf>, what: impl Into<String>, hint: &'static str) -> Self {
        Self { file: file.into(), what: what.into(), hint, kind: FileErrorKind::default() }
    }

    /// The system's refusal.
    pub fn io(file: impl Into<PathBuf>, what: &str, err: impl Display) -> Self {
        let hint = "check that the file exists and may be read, and that the disk has room";
        Self::new(file, format!("{what}: {err}"), hint)
    }

    /// The same, of another kind.
    #[must_use]
    pub fn of_kind(self, kind: FileErrorKind) -> Self {
        Self { kind, ..self }
    }

    /// The same as a problem of a data set.
    pub fn to_problem(&self) -> Problem {
        Problem { file: self.file.clone(), what: self.to_string(), hint: self.hint.into() }
    }
}
