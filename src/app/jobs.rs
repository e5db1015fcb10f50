//! What a job may do besides computing: see whether it should stop, and say how far it is.

pub mod compute;
pub mod evaluate;
pub mod generate;
pub mod inspect;
pub mod ledger;
pub mod prepare;
pub mod statistics;

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::error::TaskError;
use super::keys::{ShiftMode, TouchKey};
use super::results::Preview;
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

/// Receives pictures on the way.
pub type PreviewSink = Arc<dyn Fn(Preview) + Send + Sync>;

/// What of a prediction under way would be looked at now. The runtime keeps it up to date while jobs run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PreviewWish {
    /// After so many steps, and after the first; 0 = never.
    pub every: u32,
    /// How they become metres.
    pub shift: ShiftMode,
    /// The touches whose predicted imprint is on screen.
    pub touches: BTreeSet<TouchKey>,
}

impl PreviewWish {
    /// Whether a picture of `touch` is wanted after `step` steps.
    pub fn wants(&self, touch: TouchKey, step: u32) -> bool {
        self.every > 0 && (step == 1 || step.is_multiple_of(self.every)) && self.touches.contains(&touch)
    }
}

/// Cancel flag, progress and previews of one job. Cheap to clone.
#[derive(Clone)]
pub struct JobCx {
    /// The flag.
    pub cancel: Cancel,
    sink: ProgressSink,
    previews: Option<(Arc<Mutex<PreviewWish>>, PreviewSink)>,
}

impl JobCx {
    /// From a flag and a receiver.
    pub fn new(cancel: Cancel, sink: ProgressSink) -> Self {
        Self { cancel, sink, previews: None }
    }

    /// The same with pictures on the way, where somebody looks.
    #[must_use]
    pub fn with_previews(self, wish: Arc<Mutex<PreviewWish>>, sink: PreviewSink) -> Self {
        Self { previews: Some((wish, sink)), ..self }
    }

    /// How a picture of `touch` after `step` steps would become metres; `None` if nobody would look at it.
    pub fn wants_preview(&self, touch: TouchKey, step: u32) -> Option<ShiftMode> {
        let (wish, _) = self.previews.as_ref()?;
        let wish = wish.lock().unwrap_or_else(PoisonError::into_inner);
        wish.wants(touch, step).then_some(wish.shift)
    }

    /// Shows a picture on the way.
    pub fn preview(&self, preview: Preview) {
        if let Some((_, sink)) = &self.previews {
            sink(preview);
        }
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
