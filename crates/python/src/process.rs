//! The work of a process: its threads and loaded models, jobs that Ctrl-C stops, and errors as Python knows them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use touch2touch_pipeline::error::{TaskError, TaskErrorKind};
use touch2touch_pipeline::infer::engine::{EngineChoice, EngineKind, resolve};
use touch2touch_pipeline::job::{Cancel, JobCx, Progress};
use touch2touch_pipeline::steps::models::Models;

create_exception!(touch2touch, Refused, PyValueError, "Something cannot be done: what, why, and what to do about it.");
create_exception!(touch2touch, Cancelled, PyRuntimeError, "A job was told to stop before there was a result.");

/// Wait between looks at Ctrl-C and progress.
const LOOK: Duration = Duration::from_millis(50);

/// Threads and models of one process. A fork has none of its parent's threads, so it gets its own.
pub(crate) struct Process {
    id: u32,
    pool: ThreadPool,
    /// True in a fork of a process whose built-in engine had run: its threads are not here, and whoever asks them waits for ever.
    pub(crate) without_engine: bool,
    /// The models that are loaded; nothing is kept on the disk.
    pub(crate) models: Models,
}

/// True once models were run in this process, or in the one that it is a fork of.
static RAN_MODELS: AtomicBool = AtomicBool::new(false);

static PROCESS: Mutex<Option<Arc<Process>>> = Mutex::new(None);

/// Threads and models of this process, made when first asked for.
///
/// # Errors
/// If the system gives no threads.
pub(crate) fn process() -> PyResult<Arc<Process>> {
    let mut known = PROCESS.lock().unwrap_or_else(PoisonError::into_inner);
    let id = std::process::id();
    if let Some(process) = known.as_ref().filter(|process| process.id == id) {
        return Ok(process.clone());
    }
    let pool = ThreadPoolBuilder::new().build();
    let pool = pool.map_err(|err| PyRuntimeError::new_err(format!("the system gives no threads: {err}")))?;
    let process =
        Arc::new(Process { id, pool, without_engine: RAN_MODELS.load(Ordering::Relaxed), models: Models::new(None) });
    // The parent's threads are not here to be joined.
    std::mem::forget(known.replace(process.clone()));
    Ok(process)
}

impl Process {
    /// Says that models are about to be run by an engine.
    ///
    /// # Errors
    /// If that is the built-in one and cannot run here.
    pub(crate) fn run_models(&self, engine: EngineChoice) -> Result<(), TaskError> {
        if self.without_engine && resolve(engine).is_ok_and(|kind| kind == EngineKind::Rten) {
            let why =
                "this process is a fork of one that has run models, and the built-in engine's threads are not in it";
            let hint = "Start processes by \"spawn\" or \"forkserver\", or run models after the fork only.";
            return Err(TaskError::new("Run a model", why).with_hint(hint));
        }
        RAN_MODELS.store(true, Ordering::Relaxed);
        Ok(())
    }
}

/// An error of the program as Python's.
pub(crate) fn refused(err: impl std::fmt::Display) -> PyErr {
    Refused::new_err(err.to_string())
}

/// An error of a task as Python's.
pub(crate) fn failed(err: &TaskError) -> PyErr {
    match err.kind {
        TaskErrorKind::Cancelled => Cancelled::new_err(err.to_string()),
        TaskErrorKind::Panicked => PyRuntimeError::new_err(err.to_string()),
        TaskErrorKind::Failed | TaskErrorKind::Lost => refused(err),
    }
}

/// Runs a short job on the process's threads while Python goes on.
///
/// # Errors
/// As the job.
pub(crate) fn away<T: Send>(py: Python<'_>, job: impl FnOnce(&Process) -> PyResult<T> + Send) -> PyResult<T> {
    py.detach(|| {
        let process = process()?;
        process.pool.install(|| job(&process))
    })
}

/// Receiver of progress in Python: a function of (done, total, text), or a bar of tqdm's kind, which is made at the first news.
struct Told<'a, 'py> {
    to: Option<&'a Bound<'py, PyAny>>,
    bar: Option<Bound<'py, PyAny>>,
}

impl Told<'_, '_> {
    fn tell(&mut self, Progress { done, total, text, .. }: Progress) -> PyResult<()> {
        let Some(to) = self.to else { return Ok(()) };
        if !to.hasattr("update")? {
            return to.call1((done, total, text)).map(drop);
        }
        let bar = match self.bar.take() {
            Some(bar) => bar,
            None => to.call0()?,
        };
        bar.setattr("total", total)?;
        bar.setattr("n", done)?;
        bar.call_method1("set_description_str", (text,))?;
        self.bar = Some(bar);
        Ok(())
    }

    fn close(self) -> PyResult<()> {
        self.bar.map_or(Ok(()), |bar| bar.call_method0("close").map(drop))
    }
}

/// Runs a job on the process's threads while Python goes on: Ctrl-C stops it, and `progress(done, total, text)` is called on
/// the way; an exception of that stops it too.
///
/// # Errors
/// As the job, or the exception that stopped it.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    job: impl FnOnce(&Process, &JobCx) -> Result<T, TaskError> + Send,
) -> PyResult<T> {
    let process = process()?;
    let (cancel, latest) = (Cancel::default(), Arc::new(Mutex::new(None::<Progress>)));
    let told = latest.clone();
    let cx = JobCx::new(
        cancel.clone(),
        Arc::new(move |progress| *told.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress)),
    );
    let (done, finished) = channel();
    std::thread::scope(|scope| {
        let process = &process;
        let running = scope.spawn(move || {
            let found = process.pool.install(|| job(process, &cx));
            // Nobody waits any more where this fails.
            done.send(()).ok();
            found
        });
        let (mut finished, mut teller) = (finished, Told { to: progress, bar: None });
        let stopped = loop {
            let (back, waited) = py.detach(move || {
                let waited = finished.recv_timeout(LOOK);
                (finished, waited)
            });
            finished = back;
            let news = latest.lock().unwrap_or_else(PoisonError::into_inner).take();
            let said = news.map_or(Ok(()), |news| teller.tell(news));
            if let Err(err) = said.and_then(|()| py.check_signals()) {
                cancel.cancel();
                break Some(err);
            }
            match waited {
                Err(RecvTimeoutError::Timeout) => {}
                Ok(()) | Err(RecvTimeoutError::Disconnected) => break None,
            }
        };
        let outcome = py.detach(move || running.join());
        teller.close()?;
        if let Some(err) = stopped {
            return Err(err);
        }
        match outcome {
            Ok(found) => found.map_err(|err| failed(&err)),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}
