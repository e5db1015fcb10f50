//! Common parts of all training runs, whichever network they tune: their length ([`Tuning`]), what is kept across a
//! stop, and the progress of a run.

#[cfg(feature = "tune")]
mod kept;
#[cfg(feature = "tune")]
mod runs;

use std::path::PathBuf;
use std::time::Duration;

use serde::Serialize;

use crate::io::folders;

#[cfg(feature = "tune")]
pub(crate) use kept::KeptRun;
#[cfg(feature = "tune")]
pub(crate) use runs::{Look, RunName, Runs, TuningTask, steps_within};

/// Length of the tuning of networks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tuning {
    /// So many steps in each run.
    Steps(u32),
    /// As many steps as fit into this time, all runs together; a few of them are timed first.
    Within(Duration),
}

/// The user's folder for runs that were stopped; `None` without a folder for such files.
pub fn unfinished_folder() -> Option<PathBuf> {
    folders::program_cache().map(|folder| folder.join("unfinished"))
}
