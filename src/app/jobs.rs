//! Jobs of the studio: where they run, and what one is.

use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::job::JobCx;

with_texts! {
    /// A worker, on which jobs run. Each has its own threads, so that none waits for another kind of work.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, strum::EnumIter)]
    pub enum Worker(name) {
        /// Reading and writing files: one thread, in order.
        Files = "files",
        /// Computing.
        Compute = "compute",
        /// Running models: one thread, which keeps them loaded.
        Models = "models",
        /// Work that takes minutes and must not hold up anything else: one thread.
        Batch = "batch",
    }
}

/// The body of a job.
pub(crate) type Body<T> = Box<dyn FnOnce(&JobCx) -> Result<T, TaskError> + Send>;

/// A job that answers with a `T`. It holds its inputs: it needs the state no more.
pub struct Job<T> {
    /// The worker that it runs on.
    pub worker: Worker,
    /// The work that it does, for errors.
    pub what: String,
    /// The way.
    pub body: Body<T>,
}

impl<T: 'static> Job<T> {
    /// A job of these parts.
    pub fn new(
        worker: Worker,
        what: impl Into<String>,
        body: impl FnOnce(&JobCx) -> Result<T, TaskError> + Send + 'static,
    ) -> Self {
        Self { worker, what: what.into(), body: Box::new(body) }
    }
}
