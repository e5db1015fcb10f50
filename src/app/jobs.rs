//! Jobs of the studio: where they run, and what one is.

use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::job::JobCx;

/// A lane, on which jobs run. Each has its own threads, so that none waits for another kind of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, strum::EnumIter)]
pub enum Lane {
    /// Reading and writing files: one thread, in order.
    Files,
    /// Computing.
    Compute,
    /// Running models: one thread, which keeps them loaded.
    Models,
    /// Work that takes minutes and must not hold up anything else: one thread.
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

/// The body of a job.
pub(crate) type Body<T> = Box<dyn FnOnce(&JobCx) -> Result<T, TaskError> + Send>;

/// A job that answers with a `T`. It holds its inputs: it needs the state no more.
pub struct Job<T> {
    /// The lane that it runs on.
    pub lane: Lane,
    /// The work that it does, for errors.
    pub what: String,
    /// The way.
    pub body: Body<T>,
}

impl<T: 'static> Job<T> {
    /// A job of these parts.
    pub fn new(
        lane: Lane,
        what: impl Into<String>,
        body: impl FnOnce(&JobCx) -> Result<T, TaskError> + Send + 'static,
    ) -> Self {
        Self { lane, what: what.into(), body: Box::new(body) }
    }

    /// The job whose answer is `f` of this one's.
    pub fn map<U: 'static>(self, f: impl FnOnce(T) -> U + Send + 'static) -> Job<U> {
        Job::new(self.lane, self.what, move |cx| Ok(f((self.body)(cx)?)))
    }
}
