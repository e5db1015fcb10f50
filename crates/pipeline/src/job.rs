//! Means of a task that takes time: to see that it should stop, to report its progress, and to show pictures on the
//! way.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use super::error::TaskError;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::postprocess::ShiftMode;

/// Most threads of this program that a setting of the system may ask for.
const MOST_THREADS: usize = 256;

/// Keeps the threads of parallel loops to a number that a system can start, whatever `RAYON_NUM_THREADS` asks for. To be called
/// before the first of them.
pub fn bound_threads() {
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.trim().parse::<usize>().ok());
    if let Some(asked) = asked.filter(|asked| *asked > MOST_THREADS) {
        log::warn!("RAYON_NUM_THREADS asks for {asked} threads; {MOST_THREADS} are used");
        // Only an earlier loop can be in the way, and then its threads are there already.
        rayon::ThreadPoolBuilder::new().num_threads(MOST_THREADS).build_global().ok();
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

    /// True where it was told to stop.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// A curve that grows while a job runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Name of the run that it is of, e.g. `without part 1 of 3`.
    pub name: String,
    /// Unit of its values, e.g. `loss` or `dB`: curves of one unit belong into one picture.
    pub unit: &'static str,
    /// `[step, value]`.
    pub points: Vec<[f64; 2]>,
}

/// Progress of a job.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// Steps done.
    pub done: u64,
    /// Steps in all; 0 = unknown.
    pub total: u64,
    /// Step that is being done now, e.g. `step 12 of 20`.
    pub text: String,
    /// Curves so far, where they are worth watching.
    pub curves: Arc<[Curve]>,
}

impl Progress {
    /// Share done, 0..1; `None` if unknown.
    pub fn fraction(&self) -> Option<f32> {
        (self.total > 0).then(|| self.done.min(self.total) as f32 / self.total as f32)
    }
}

/// Receives progress.
pub(crate) type ProgressSink = Arc<dyn Fn(Progress) + Send + Sync>;

/// A prediction as it looks on the way.
#[derive(Clone, Debug)]
pub struct PreviewPicture {
    /// Steps done.
    pub step: u32,
    /// Steps in all.
    pub of: u32,
    /// As the model sees it now, meters, as large as the bubble image.
    pub depth: DepthMap,
}

/// Receives pictures on the way of the items of one call, by their position in it.
pub trait Previews: Send + Sync {
    /// Mapping to meters of a picture of an item after `step` steps; `None` if nobody would look at it. Nothing is
    /// computed then.
    fn wants(&self, item: usize, step: u32) -> Option<ShiftMode>;

    /// Shows one.
    fn show(&self, item: usize, picture: PreviewPicture);
}

/// Cancel flag, progress and previews of one job. Cheap to clone.
#[derive(Clone)]
pub struct JobCx {
    /// The flag.
    pub cancel: Cancel,
    sink: ProgressSink,
    previews: Option<Arc<dyn Previews>>,
}

impl JobCx {
    /// From a flag and a receiver.
    pub fn new(cancel: Cancel, sink: ProgressSink) -> Self {
        Self { cancel, sink, previews: None }
    }

    /// A job that nobody watches.
    pub fn unwatched() -> Self {
        Self::new(Cancel::default(), Arc::new(|_| {}))
    }

    /// Context that shows pictures on the way, where somebody looks.
    #[must_use]
    pub fn with_previews(self, previews: Arc<dyn Previews>) -> Self {
        Self { previews: Some(previews), ..self }
    }

    /// A part of the job whose own steps are not worth showing; telling the job to stop stops it.
    #[must_use]
    pub fn quiet(&self) -> Self {
        Self::new(self.cancel.clone(), Arc::new(|_| {}))
    }

    /// Who looks at pictures on the way.
    pub fn previews(&self) -> Option<&dyn Previews> {
        self.previews.as_deref()
    }

    /// Says how far the job is.
    pub fn progress(&self, done: u64, total: u64, text: impl Into<String>) {
        self.show(Progress { done, total, text: text.into(), ..Progress::default() });
    }

    /// Says how far the job is, with what there is to see besides.
    pub fn show(&self, progress: Progress) {
        (self.sink)(progress);
    }

    /// # Errors
    /// If the job was told to stop.
    pub fn check(&self, what: &str) -> Result<(), TaskError> {
        if self.cancel.is_cancelled() { Err(TaskError::cancelled(what)) } else { Ok(()) }
    }
}
