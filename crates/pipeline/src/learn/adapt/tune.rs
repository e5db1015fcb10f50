//! Tuning the networks themselves on the touches, after the closed form.

mod source;

use serde_json::json;
use sha2::{Digest as _, Sha256};
use touch2touch_tuning::{Config, Pair, Query, Start, Tuner};

use super::gather::FitTouch;
use super::{AdaptSetup, Tuned, Tuning, WHAT};
use crate::error::TaskError;
use crate::infer::bundle::Role;
use crate::infer::kept_key::input_digest;
use crate::io::digest::hex;
use crate::job::JobCx;
use crate::learn::tuning::{KeptRun, Look, RunName, Runs, TuningTask, steps_within};
use crate::steps::predict::Generating;
use touch2touch_core::fit::{FitPair, closed_form};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::postprocess::Correction;
use touch2touch_core::rig::Rig;

use source::Source;

/// Pictures predicted at a time.
const BATCH: usize = 16;
/// The share of the time that goes into steps; the rest goes into predicting and scoring.
const STEPPING: f64 = 0.85;
/// Looks at touches that were left out, during a run.
const LOOKS: usize = 5;
/// Unit of the value that a look gives.
const UNIT: &str = "dB";
/// Touches at a look.
const LOOKED_AT: usize = 8;

/// Tunes once for each part without it, and once on everything.
pub(super) fn tune(
    setup: &AdaptSetup,
    tuning: Tuning,
    touches: &[FitTouch],
    corrections: &[Option<Correction>],
    parts: &[usize],
    rig: &Rig,
    cx: &JobCx,
) -> Result<Tuned, TaskError> {
    let generating = setup.recipe.generating()?;
    let source = Source::open(generating)?;
    let real: Vec<Pair> =
        touches.iter().map(|t| source.pair(&t.picture, &t.target, Some(t.pad.index()))).collect::<Result<_, _>>()?;
    cx.progress(0, 0, "simulating touches that keep the model from forgetting");
    let simulated = source.simulated(rig)?;
    cx.check(WHAT)?;
    let with_simulated = |real: Vec<Pair>| -> Vec<Pair> { real.into_iter().chain(simulated.iter().cloned()).collect() };
    let count = parts.iter().max().map_or(0, |most| most + 1);
    let kept = KeptRun::of(setup.unfinished.as_deref(), &digest(setup, generating, touches));
    let start = source.start(source.placement(corrections));
    let task = TuningTask { what: WHAT, fail, kept: &kept, cx };
    let config = Config { seed: generating.config.seed, ..Config::default() };
    let steps = match tuning {
        Tuning::Steps(steps) => steps,
        Tuning::Within(time) => steps_within(time, STEPPING, count + 1, task, || {
            Tuner::new(&start, with_simulated(real.clone()), config.clone(), None)
        })?,
    };
    let config = Config { steps: steps as usize, ..config };
    let mut runs = Runs::new(task, steps, count + 1);
    let mut left_out: Vec<Option<DepthMap>> = vec![None; touches.len()];
    for part in 0..count {
        let others: Vec<usize> = (0..touches.len()).filter(|&i| parts[i] != part).collect();
        if others.is_empty() {
            continue;
        }
        let cases: Vec<FitPair<'_>> = others.iter().map(|&i| touches[i].case()).collect();
        let without = closed_form(&cases, rig.pads().len()).map_err(|err| TaskError::from_error(WHAT, &err))?;
        // A pad that the others have no pair of has no place.
        let known = |&i: &usize| parts[i] == part && without[touches[i].pad.index()].is_some();
        let held: Vec<usize> = (0..touches.len()).filter(known).collect();
        let run = Run {
            file: format!("part-{}", part + 1),
            name: format!("without part {} of {count}", part + 1),
            start: source.start(source.placement(&without)),
            pairs: with_simulated(others.iter().map(|&i| real[i].clone()).collect()),
            held: held.iter().map(|&i| &real[i]).collect(),
        };
        for (i, units) in held.into_iter().zip(predictions(&mut runs, &run, &config)?) {
            left_out[i] = Some(source.meters(units));
        }
    }
    let run =
        Run { file: "all".into(), name: "on all pairs".into(), start, pairs: with_simulated(real), held: Vec::new() };
    let tuned = tuner(&mut runs, &run, &config)?.tuned();
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

/// Everything that a run depends on.
fn digest(setup: &AdaptSetup, generating: Generating<'_>, touches: &[FitTouch]) -> String {
    let mut all = Sha256::new();
    let asked = json!({
        "program": env!("CARGO_PKG_VERSION"), "bundle": *generating.bundle.id, "config": generating.config,
        "tuning": setup.tuning, "folds": setup.folds,
    });
    all.update(asked.to_string());
    for touch in touches {
        all.update(touch.name.as_bytes());
        all.update([touch.pad.index() as u8]);
        all.update(input_digest(&touch.picture));
        touch.target.as_slice().iter().for_each(|v| all.update(v.to_le_bytes()));
    }
    hex(&all.finalize())
}

/// One run of tuning.
struct Run<'a> {
    /// Start of the names of its files.
    file: String,
    /// Name for people.
    name: String,
    start: Start,
    pairs: Vec<Pair>,
    /// Pairs that are left out.
    held: Vec<&'a Pair>,
}

impl Run<'_> {
    fn queries(&self) -> Vec<Query<'_>> {
        self.held.iter().map(|pair| (pair.picture.as_slice(), pair.frame)).collect()
    }
}

/// Predictions of the left-out touches by the tuned networks, in the tuner's units.
fn predictions(runs: &mut Runs<'_>, run: &Run<'_>, config: &Config) -> Result<Vec<Vec<f32>>, TaskError> {
    let file = format!("{}.left-out", run.file);
    let pixels = run.pairs.first().map_or(0, |pair| pair.imprint.len());
    if let Some(bytes) = runs.task.kept.read(&file).filter(|bytes| bytes.len() == 4 * pixels * run.held.len()) {
        runs.skip(&run.file, &run.name, UNIT);
        let values: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        return Ok(values.chunks(pixels.max(1)).map(<[f32]>::to_vec).collect());
    }
    let tuner = tuner(runs, run, config)?;
    let mut made = Vec::with_capacity(run.held.len());
    for part in run.queries().chunks(BATCH) {
        runs.task.cx.check(WHAT)?;
        made.extend(tuner.predict(part).map_err(fail)?);
    }
    let bytes: Vec<u8> = made.iter().flatten().flat_map(|v: &f32| v.to_le_bytes()).collect();
    runs.task.kept.write(&file, &bytes);
    runs.forget(&run.file);
    Ok(made)
}

/// Tunes from where the run stands, to its end.
fn tuner(runs: &mut Runs<'_>, run: &Run<'_>, config: &Config) -> Result<Tuner, TaskError> {
    let begin = |state: Option<&[u8]>| Tuner::new(&run.start, run.pairs.clone(), config.clone(), state);
    let times = if run.held.is_empty() { 0 } else { LOOKS };
    runs.finish(
        RunName { file: &run.file, name: &run.name },
        begin,
        &Look { unit: UNIT, times, at: &|tuner| look(tuner, run) },
    )
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
