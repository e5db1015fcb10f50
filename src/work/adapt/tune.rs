//! Tuning the networks themselves on the touches, after the closed form.

mod source;

use std::time::{Duration, Instant};

use touch2touch_tuning::{Config, Pair, Query, Start, Tuner};

use super::gather::Touch;
use super::kept::Kept;
use super::{AdaptSetup, Tuned, Tuning, WHAT};
use crate::domain::fit::{Case, closed_form};
use crate::domain::grid::DepthMap;
use crate::domain::postprocess::Correction;
use crate::domain::rig::Rig;
use crate::infer::bundle::Role;
use crate::work::error::TaskError;
use crate::work::job::{Curve, JobCx, Progress};

use source::Source;

/// Pictures predicted at a time.
const BATCH: usize = 16;
/// Steps that are timed where the time is given.
const TIMED: u32 = 2;
/// The share of the time that goes into steps; the rest goes into predicting and scoring.
const STEPPING: f64 = 0.85;
/// How often the run is kept.
const KEPT_EVERY: Duration = Duration::from_secs(20);
/// Looks at touches that were left out, during a run.
const LOOKS: usize = 5;
/// Touches at a look.
const LOOKED_AT: usize = 8;

/// Tunes once for each part without it, and once on everything.
pub(super) fn tune(
    setup: &AdaptSetup,
    tuning: Tuning,
    touches: &[Touch],
    corrections: &[Option<Correction>],
    parts: &[usize],
    rig: &Rig,
    cx: &JobCx,
) -> Result<Tuned, TaskError> {
    let source = Source::open(setup)?;
    let real: Vec<Pair> =
        touches.iter().map(|t| source.pair(&t.picture, &t.target, Some(t.pad.index()))).collect::<Result<_, _>>()?;
    cx.progress(0, 0, "simulating touches that keep the model from forgetting");
    let simulated = source.simulated(setup, rig)?;
    cx.check(WHAT)?;
    let with_simulated = |real: Vec<Pair>| -> Vec<Pair> { real.into_iter().chain(simulated.iter().cloned()).collect() };
    let count = parts.iter().max().map_or(0, |most| most + 1);
    let kept = Kept::of(setup, touches);
    let start = source.start(setup, source.placement(corrections));
    let config = Config { seed: setup.config.seed, ..Config::default() };
    let steps = match tuning {
        Tuning::Steps(steps) => steps,
        Tuning::Within(time) => steps_within(time, count + 1, &kept, cx, || {
            Tuner::new(&start, with_simulated(real.clone()), config.clone()).map_err(fail)
        })?,
    };
    let config = Config { steps: steps as usize, ..config };
    let total = u64::from(steps) * (count as u64 + 1);
    let mut runs = Runs { kept: &kept, cx, config, total, done: 0, begin: Instant::now(), made: 0, curves: Vec::new() };
    let mut left_out: Vec<Option<DepthMap>> = vec![None; touches.len()];
    for part in 0..count {
        let others: Vec<usize> = (0..touches.len()).filter(|&i| parts[i] != part).collect();
        if others.is_empty() {
            continue;
        }
        let cases: Vec<Case<'_>> = others.iter().map(|&i| touches[i].case()).collect();
        let without = closed_form(&cases, rig.pads().len()).map_err(|err| TaskError::from_error(WHAT, &err))?;
        // A pad that the others have no pair of has no place.
        let known = |&i: &usize| parts[i] == part && without[touches[i].pad.index()].is_some();
        let held: Vec<usize> = (0..touches.len()).filter(known).collect();
        let run = Run {
            file: format!("part-{}", part + 1),
            name: format!("without part {} of {count}", part + 1),
            start: source.start(setup, source.placement(&without)),
            pairs: with_simulated(others.iter().map(|&i| real[i].clone()).collect()),
            held: held.iter().map(|&i| &real[i]).collect(),
        };
        for (i, units) in held.into_iter().zip(runs.predictions(&run)?) {
            left_out[i] = Some(source.meters(units));
        }
    }
    let run =
        Run { file: "all".into(), name: "on all pairs".into(), start, pairs: with_simulated(real), held: Vec::new() };
    let tuned = runs.tuner(&run)?.tuned();
    let curves = runs.curves;
    kept.clear();
    let corrections = source.corrections(&tuned.placement, corrections);
    let graphs =
        [(Role::ConditionEncoder, tuned.encoder), (Role::Denoiser, tuned.denoiser), (Role::Decoder, tuned.decoder)];
    Ok(Tuned { graphs: graphs.into(), corrections, left_out, steps, curves })
}

fn fail(err: touch2touch_tuning::Error) -> TaskError {
    TaskError::from_error("Tune the model", &err)
        .with_hint("Networks of another kind than the shipped ones are fitted in closed form: leave --tune out.")
}

/// How many steps fit into a time: a few are made and thrown away. A run that goes on keeps the number it began with.
fn steps_within(
    time: Duration,
    runs: usize,
    kept: &Kept,
    cx: &JobCx,
    tuner: impl FnOnce() -> Result<Tuner, TaskError>,
) -> Result<u32, TaskError> {
    const FILE: &str = "steps";
    let text = kept.read(FILE).and_then(|bytes| String::from_utf8(bytes).ok());
    if let Some(steps) = text.and_then(|text| text.parse::<u32>().ok()).filter(|&steps| steps > 0) {
        return Ok(steps);
    }
    let begin = Instant::now();
    cx.progress(0, 0, "timing a few steps");
    let mut tuner = tuner()?;
    // The first step pays for memory too.
    tuner.step().map_err(fail)?;
    let first = Instant::now();
    for _ in 0..TIMED {
        cx.check(WHAT)?;
        tuner.step().map_err(fail)?;
    }
    let each = first.elapsed().as_secs_f64() / f64::from(TIMED);
    let left = time.saturating_sub(begin.elapsed()).as_secs_f64() * STEPPING;
    let steps = (left / runs as f64 / each.max(1e-6)).clamp(1.0, 100_000.0) as u32;
    kept.write(FILE, steps.to_string().as_bytes());
    Ok(steps)
}

/// One run of tuning.
struct Run<'a> {
    /// What its files are called.
    file: String,
    /// What people call it.
    name: String,
    start: Start,
    pairs: Vec<Pair>,
    /// What is left out.
    held: Vec<&'a Pair>,
}

impl Run<'_> {
    fn queries(&self) -> Vec<Query<'_>> {
        self.held.iter().map(|pair| (pair.picture.as_slice(), pair.frame)).collect()
    }
}

/// The loss, and PSNR on touches that were left out, dB: `[step, value]`.
type Curves = [Vec<[f64; 2]>; 2];

/// The runs one after the other, with what is kept and shown of them.
struct Runs<'a> {
    kept: &'a Kept,
    cx: &'a JobCx,
    config: Config,
    /// Steps of all runs.
    total: u64,
    done: u64,
    begin: Instant,
    /// Steps made since then: what was kept took no time.
    made: u64,
    curves: Vec<Curve>,
}

impl Runs<'_> {
    /// What the tuned networks make of the touches that were left out, in the tuner's units.
    fn predictions(&mut self, run: &Run<'_>) -> Result<Vec<Vec<f32>>, TaskError> {
        let file = format!("{}.left-out", run.file);
        let pixels = run.pairs.first().map_or(0, |pair| pair.imprint.len());
        if let Some(bytes) = self.kept.read(&file).filter(|bytes| bytes.len() == 4 * pixels * run.held.len()) {
            self.done += self.config.steps as u64;
            let curves = self.kept_curves(run);
            self.curves.extend(named(run, &curves));
            let values: Vec<f32> =
                bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
            return Ok(values.chunks(pixels.max(1)).map(<[f32]>::to_vec).collect());
        }
        let tuner = self.tuner(run)?;
        let mut made = Vec::with_capacity(run.held.len());
        for part in run.queries().chunks(BATCH) {
            self.cx.check(WHAT)?;
            made.extend(tuner.predict(part).map_err(fail)?);
        }
        let bytes: Vec<u8> = made.iter().flatten().flat_map(|v: &f32| v.to_le_bytes()).collect();
        self.kept.write(&file, &bytes);
        self.kept.remove(&state_file(run));
        Ok(made)
    }

    /// Tunes from where the run stands, to its end.
    fn tuner(&mut self, run: &Run<'_>) -> Result<Tuner, TaskError> {
        let state = self.kept.read(&state_file(run));
        let resumed =
            state.and_then(|state| Tuner::resume(&run.start, run.pairs.clone(), self.config.clone(), &state).ok());
        let (mut tuner, mut curves) = match resumed {
            Some(tuner) => (tuner, self.kept_curves(run)),
            None => {
                let tuner = Tuner::new(&run.start, run.pairs.clone(), self.config.clone()).map_err(fail)?;
                (tuner, Curves::default())
            }
        };
        self.done += tuner.steps_done() as u64;
        let every = (tuner.steps() / LOOKS).max(1);
        let mut last_kept = Instant::now();
        while tuner.steps_done() < tuner.steps() {
            if self.cx.cancel.is_cancelled() || last_kept.elapsed() > KEPT_EVERY {
                self.keep(run, &tuner, &curves);
                self.cx.check(WHAT)?;
                last_kept = Instant::now();
            }
            let report = tuner.step().map_err(fail)?;
            (self.done, self.made) = (self.done + 1, self.made + 1);
            curves[0].push([report.step as f64, f64::from(report.loss)]);
            if report.step.is_multiple_of(every) && !run.held.is_empty() {
                curves[1].push([report.step as f64, look(&tuner, run)?]);
            }
            self.show(run, &curves, report.step);
        }
        self.curves.extend(named(run, &curves));
        self.kept.write(&curves_file(run), &serde_json::to_vec(&curves).unwrap_or_default());
        Ok(tuner)
    }

    fn keep(&self, run: &Run<'_>, tuner: &Tuner, curves: &Curves) {
        self.kept.write(&state_file(run), &tuner.to_bytes());
        self.kept.write(&curves_file(run), &serde_json::to_vec(curves).unwrap_or_default());
    }

    fn kept_curves(&self, run: &Run<'_>) -> Curves {
        let bytes = self.kept.read(&curves_file(run)).unwrap_or_default();
        serde_json::from_slice(&bytes).unwrap_or_default()
    }

    fn show(&self, run: &Run<'_>, curves: &Curves, step: usize) {
        let left = self.begin.elapsed().as_secs_f64() / self.made as f64 * (self.total - self.done) as f64;
        let left = match left {
            left if left > 90.0 => format!("{:.0} min left", left / 60.0),
            left => format!("{left:.0} s left"),
        };
        self.cx.show(Progress {
            done: self.done,
            total: self.total,
            text: format!("tuning {}: step {step} of {}, about {left}", run.name, self.config.steps),
            curves: self.curves.iter().cloned().chain(named(run, curves)).collect(),
        });
    }
}

fn state_file(run: &Run<'_>) -> String {
    format!("{}.tuner", run.file)
}

fn curves_file(run: &Run<'_>) -> String {
    format!("{}.json", run.file)
}

fn named(run: &Run<'_>, [loss, left_out]: &Curves) -> impl Iterator<Item = Curve> {
    let curve = |unit, points: &Vec<[f64; 2]>| Curve { name: run.name.clone(), unit, points: points.clone() };
    [curve("loss", loss), curve("dB", left_out)].into_iter().filter(|curve| !curve.points.is_empty())
}

/// PSNR on some of the touches that were left out, as they are, dB.
fn look(tuner: &Tuner, run: &Run<'_>) -> Result<f64, TaskError> {
    let every = run.held.len().div_ceil(LOOKED_AT);
    let queries: Vec<Query<'_>> = run.queries().into_iter().step_by(every).collect();
    let made = tuner.predict(&queries).map_err(fail)?;
    let psnr = |(made, pair): (&Vec<f32>, &&Pair)| {
        let squares = made.iter().zip(&pair.imprint).map(|(a, b)| f64::from(a - b).powi(2));
        -10.0 * (squares.sum::<f64>() / made.len() as f64).max(f64::MIN_POSITIVE).log10()
    };
    let all: Vec<f64> = made.iter().zip(run.held.iter().step_by(every)).map(psnr).collect();
    Ok(all.iter().sum::<f64>() / all.len() as f64)
}
