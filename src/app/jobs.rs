//! What a job may do besides computing: see whether it should stop, and say how far it is.

pub mod compute;
pub mod evaluate;
pub mod inspect;
pub mod prepare;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::TaskError;
use super::tasks::Progress;

/// Where a job runs. Each lane has its own threads, so that none waits for another kind of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, strum::EnumIter)]
pub enum Lane {
    /// Reading and writing files: one thread, in order.
    Files,
    /// Computing.
    Compute,
    /// Running models: one thread, which keeps them loaded.
    Models,
    /// What takes minutes and must not hold up anything else: one thread.
    Batch,
}

impl Lane {
    /// The name of its threads.
    pub fn name(self) -> &'static str {
        match self {
            Self::Files => "files",
            Self::Compute => "compute",
            Self::Models => "models",
            Self::Batch => "batch",
        }
    }
}

/// A flag that tells a job to stop. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Tells the job to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was told to stop.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Receives progress.
pub type ProgressSink = Arc<dyn Fn(Progress) + Send + Sync>;

/// Cancel flag and progress of one job. Cheap to clone.
#[derive(Clone)]
pub struct JobCx {
    /// The flag.
    pub cancel: Cancel,
    sink: ProgressSink,
}

impl JobCx {
    /// From a flag and a receiver.
    pub fn new(cancel: Cancel, sink: ProgressSink) -> Self {
        Self { cancel, sink }
    }

    /// A job that nobody watches.
    pub fn unwatched() -> Self {
        Self::new(Cancel::default(), Arc::new(|_| {}))
    }

    /// Says how far the job is.
    pub fn progress(&self, done: u64, total: u64, text: impl Into<String>) {
        (self.sink)(Progress { done, total, text: text.into() });
    }

    /// # Errors
    /// If the job was told to stop.
    pub fn check(&self, what: &str) -> Result<(), TaskError> {
        if self.cancel.is_cancelled() { Err(TaskError::cancelled(what)) } else { Ok(()) }
    }
}
