//! Runs of training one after the other: kept across a stop, cancelled at any step, shown as curves.

use std::time::{Duration, Instant};

use touch2touch_tuning::{Descent, Error, Result as Tuned};

use super::KeptRun;
use crate::error::TaskError;
use crate::job::{Curve, JobCx, Progress};

/// Steps that are timed where the time is given.
const TIMED: u32 = 2;
/// Time between two moments at which a run is kept.
const KEPT_EVERY: Duration = Duration::from_secs(20);

/// Task that runs are for, and who keeps and watches them.
#[derive(Clone, Copy)]
pub(crate) struct TuningTask<'a> {
    /// The name of the task.
    pub(crate) what: &'static str,
    /// Says what is wrong with a run.
    pub(crate) fail: fn(Error) -> TaskError,
    pub(crate) kept: &'a KeptRun,
    pub(crate) cx: &'a JobCx,
}

/// Names of a run.
#[derive(Clone, Copy)]
pub(crate) struct RunName<'a> {
    /// By its files.
    pub(crate) file: &'a str,
    /// By people.
    pub(crate) name: &'a str,
}

/// A look at what a run has not seen.
pub(crate) struct Look<'a, T> {
    /// Unit of its value, e.g. `dB`.
    pub(crate) unit: &'static str,
    /// Number of looks during a run.
    pub(crate) times: usize,
    /// The look.
    pub(crate) at: &'a dyn Fn(&T) -> Result<f64, TaskError>,
}

/// The loss, and what looks found: `[step, value]`.
type Curves = [Vec<[f64; 2]>; 2];

/// The runs one after the other, with what is kept and shown of them.
pub(crate) struct Runs<'a> {
    pub(crate) task: TuningTask<'a>,
    /// Steps of each.
    steps: usize,
    /// Steps of all runs.
    total: u64,
    done: u64,
    begin: Instant,
    /// Steps made since then: what was kept took no time.
    made: u64,
    pub(crate) curves: Vec<Curve>,
}

impl<'a> Runs<'a> {
    /// So many runs of so many steps.
    pub(crate) fn new(task: TuningTask<'a>, steps: u32, count: usize) -> Self {
        let total = u64::from(steps) * count as u64;
        let begin = Instant::now();
        Self { task, steps: steps as usize, total, done: 0, begin, made: 0, curves: Vec::new() }
    }

    /// Takes a run as made, because what came of it is kept.
    pub(crate) fn skip(&mut self, file: &str, name: &str, unit: &'static str) {
        self.done += self.steps as u64;
        let curves = self.kept_curves(file);
        self.curves.extend(named(name, unit, &curves));
    }

    /// A run from where it stands to its end; `begin` has a state where one was kept.
    pub(crate) fn finish<T: Descent>(
        &mut self,
        RunName { file, name }: RunName<'_>,
        begin: impl Fn(Option<&[u8]>) -> Tuned<T>,
        look: &Look<'_, T>,
    ) -> Result<T, TaskError> {
        let resumed = self.task.kept.read(&state_file(file)).and_then(|state| begin(Some(&state)).ok());
        let (mut tuner, mut curves) = match resumed {
            Some(tuner) => (tuner, self.kept_curves(file)),
            None => (begin(None).map_err(self.task.fail)?, Curves::default()),
        };
        self.done += tuner.steps_done() as u64;
        let every = (tuner.steps() / look.times.max(1)).max(1);
        let mut last_kept = Instant::now();
        while tuner.steps_done() < tuner.steps() {
            if self.task.cx.cancel.is_cancelled() || last_kept.elapsed() > KEPT_EVERY {
                self.keep(file, &tuner, &curves);
                self.task.cx.check(self.task.what)?;
                last_kept = Instant::now();
            }
            let report = tuner.step().map_err(self.task.fail)?;
            (self.done, self.made) = (self.done + 1, self.made + 1);
            curves[0].push([report.step as f64, f64::from(report.loss)]);
            if report.step.is_multiple_of(every) && look.times > 0 {
                curves[1].push([report.step as f64, (look.at)(&tuner)?]);
            }
            self.show(name, look.unit, &curves, report.step);
        }
        self.curves.extend(named(name, look.unit, &curves));
        self.task.kept.write(&curves_file(file), &serde_json::to_vec(&curves).unwrap_or_default());
        Ok(tuner)
    }

    /// Forgets the state of a run, because what came of it is kept.
    pub(crate) fn forget(&self, file: &str) {
        self.task.kept.remove(&state_file(file));
    }

    fn keep(&self, file: &str, tuner: &impl Descent, curves: &Curves) {
        self.task.kept.write(&state_file(file), &tuner.to_bytes());
        self.task.kept.write(&curves_file(file), &serde_json::to_vec(curves).unwrap_or_default());
    }

    fn kept_curves(&self, file: &str) -> Curves {
        let bytes = self.task.kept.read(&curves_file(file)).unwrap_or_default();
        serde_json::from_slice(&bytes).unwrap_or_default()
    }

    fn show(&self, name: &str, unit: &'static str, curves: &Curves, step: usize) {
        let left = self.begin.elapsed().as_secs_f64() / self.made as f64 * (self.total - self.done) as f64;
        let left = match left {
            left if left > 90.0 => format!("{:.0} min left", left / 60.0),
            left => format!("{left:.0} s left"),
        };
        self.task.cx.show(Progress {
            done: self.done,
            total: self.total,
            text: format!("tuning {name}: step {step} of {}, about {left}", self.steps),
            curves: self.curves.iter().cloned().chain(named(name, unit, curves)).collect(),
        });
    }
}

fn state_file(file: &str) -> String {
    format!("{file}.tuner")
}

fn curves_file(file: &str) -> String {
    format!("{file}.json")
}

fn named(name: &str, unit: &'static str, [loss, looks]: &Curves) -> impl Iterator<Item = Curve> {
    let curve = |unit, points: &Vec<[f64; 2]>| Curve { name: name.to_owned(), unit, points: points.clone() };
    [curve("loss", loss), curve(unit, looks)].into_iter().filter(|curve| !curve.points.is_empty())
}

/// Number of steps of each of some runs that fit into a time, of which the share `stepping` goes into steps: a few are
/// made and thrown away. A run that goes on keeps the number it began with.
pub(crate) fn steps_within<T: Descent>(
    time: Duration,
    stepping: f64,
    runs: usize,
    TuningTask { what, fail, kept, cx }: TuningTask<'_>,
    tuner: impl FnOnce() -> Tuned<T>,
) -> Result<u32, TaskError> {
    const FILE: &str = "steps";
    let text = kept.read(FILE).and_then(|bytes| String::from_utf8(bytes).ok());
    if let Some(steps) = text.and_then(|text| text.parse::<u32>().ok()).filter(|&steps| steps > 0) {
        return Ok(steps);
    }
    let begin = Instant::now();
    cx.progress(0, 0, "timing a few steps");
    let mut tuner = tuner().map_err(fail)?;
    // The first step pays for memory too.
    tuner.step().map_err(fail)?;
    let first = Instant::now();
    let timed = TIMED.min(tuner.steps().saturating_sub(1) as u32);
    for _ in 0..timed {
        cx.check(what)?;
        tuner.step().map_err(fail)?;
    }
    let each = first.elapsed().as_secs_f64() / f64::from(timed.max(1));
    let left = time.saturating_sub(begin.elapsed()).as_secs_f64() * stepping;
    let steps = (left / runs as f64 / each.max(1e-6)).clamp(1.0, 100_000.0) as u32;
    kept.write(FILE, steps.to_string().as_bytes());
    Ok(steps)
}
