//! The training itself, and what it is worth on what was left out.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use serde_json::json;
use sha2::{Digest as _, Sha256};
use touch2touch_tuning::{Cast, Descent as _, Error, MaskConfig, MaskStart, MaskTouch, MaskTuner};

use super::gather::{Drawn, Gathered};
use super::trained::HeldOut;
use super::write::{Provenance, bundle};
use super::{MaskScore, MasksFrom, NO_TOOL, TrainPlan, TrainSetup, Trained, WHAT};
use crate::error::TaskError;
use crate::infer::bundle::{self, MaskSpec, Role};
use crate::infer::mask::contact_of;
use crate::io::dataset::Dataset;
use crate::io::digest::hex;
use crate::io::files;
use crate::io::memory::peak_mib;
use crate::job::JobCx;
use crate::learn::tuning::{KeptRun, Look, RunName, Runs, Tuning, TuningTask, steps_within};
use touch2touch_core::grid::Grid;
use touch2touch_core::label::agreement;

/// The share of the time that goes into steps; the rest goes into reading and scoring.
const STEPPING: f64 = 0.9;
/// Looks at what was left out, during the run.
const LOOKS: usize = 12;
/// Imprints at a look.
const LOOKED_AT: usize = 8;
/// Imprints that are scored at a time.
const BATCH: usize = 16;
/// Fewer steps are worth nothing: the rates rise for ten steps.
const ENOUGH_STEPS: u32 = 30;
/// Start of the names of the run's files.
const FILE: &str = "masks";

/// Trains, scores and writes.
pub(super) fn tune(
    dataset: &Dataset,
    plan: &TrainPlan,
    gathered: Gathered,
    setup: &TrainSetup,
    begin: Instant,
    cx: &JobCx,
) -> Result<Trained, TaskError> {
    let (spec, start) = open(setup)?;
    let touches: Vec<MaskTouch> = gathered.learned.iter().map(|drawn| drawn.touch(&spec.input)).collect();
    let kept = KeptRun::of(setup.unfinished.as_deref(), &digest(setup, &gathered));
    let task = TuningTask { what: WHAT, fail, kept: &kept, cx };
    let config = MaskConfig { seed: setup.choice.seed, ..MaskConfig::default() };
    let steps = match setup.tuning {
        Tuning::Steps(steps) => steps,
        Tuning::Within(time) => {
            let left = time.saturating_sub(begin.elapsed());
            steps_within(left, STEPPING, 1, task, || MaskTuner::new(&start, touches.clone(), config.clone(), None))?
        }
    };
    let config = MaskConfig { steps: steps as usize, ..config };
    let every = gathered.held.len().div_ceil(LOOKED_AT).max(1);
    let looked_at: Vec<&Drawn> = gathered.held.iter().step_by(every).collect();
    let look = |tuner: &MaskTuner| {
        let scores = mask_scores(&spec, &looked_at, |imprints| tuner.probabilities(imprints))?;
        Ok(MaskScore::mean(scores.into_iter()).map_or(0.0, |score| score.dice))
    };
    let begun = |state: Option<&[u8]>| MaskTuner::new(&start, touches.clone(), config.clone(), state);
    let times = if looked_at.is_empty() { 0 } else { LOOKS };
    let mut runs = Runs::new(task, steps, 1);
    let run = RunName { file: FILE, name: "the mask model" };
    let tuner = runs.finish(run, begun, &Look { unit: "Dice", times, at: &look })?;
    let curves = runs.curves;
    let mut held_out = Vec::with_capacity(gathered.held.len());
    for part in gathered.held.chunks(BATCH) {
        // The run is kept: what is told to stop here goes on here.
        if cx.cancel.is_cancelled() {
            kept.write(&format!("{FILE}.tuner"), &tuner.to_bytes());
        }
        cx.check(WHAT)?;
        cx.progress(held_out.len() as u64, gathered.held.len() as u64, "scoring masks that were left out");
        let part: Vec<&Drawn> = part.iter().collect();
        let before = mask_scores(&spec, &part, |imprints| tuner.probabilities_at_start(imprints))?;
        let after = mask_scores(&spec, &part, |imprints| tuner.probabilities(imprints))?;
        held_out.extend(part.iter().zip(before.into_iter().zip(after)).map(|(drawn, (before, after))| HeldOut {
            id: drawn.id,
            pair: drawn.pair.clone(),
            tool: drawn.tool.clone(),
            pad: drawn.pad,
            finger: dataset.rig.pad_key(drawn.pad).into_owned(),
            imprint: drawn.source,
            before,
            after,
        }));
    }
    held_out.sort_by(|a, b| a.after.iou.total_cmp(&b.after.iou));
    let before = MaskScore::mean(held_out.iter().map(|one| one.before));
    let after = MaskScore::mean(held_out.iter().map(|one| one.after));
    cx.check(WHAT)?;
    let said = Provenance { dataset, gathered: &gathered, steps, before, after };
    let name = bundle(setup, tuner.tuned(), &said)?;
    kept.clear();
    let mut pairs: Vec<&str> = gathered.learned.iter().map(|drawn| drawn.pair.as_str()).collect();
    pairs.dedup();
    let mut tools = BTreeMap::new();
    for drawn in &gathered.learned {
        *tools.entry(drawn.tool.clone().unwrap_or_else(|| NO_TOOL.into())).or_default() += 1;
    }
    let mut trained = Trained {
        from: setup.start.name.clone(),
        tools,
        masks: gathered.learned.len(),
        pairs: pairs.len(),
        persons: gathered.persons.iter().cloned().collect(),
        left_out: plan.left_out.clone(),
        unusable: gathered.unusable,
        before,
        after,
        poses: None,
        held_out,
        steps,
        curves,
        seconds: begin.elapsed().as_secs_f64(),
        peak_mib: peak_mib(),
        warnings: plan.warnings(),
        name,
        bundle: setup.out.clone(),
    };
    warn(&mut trained);
    Ok(trained)
}

/// Warns of a training that was too short, or made the model worse.
fn warn(trained: &mut Trained) {
    let steps = trained.steps;
    if steps < ENOUGH_STEPS {
        let text = format!("{steps} steps are few: fewer than {ENOUGH_STEPS} change next to nothing");
        trained.warnings.push(text);
    }
    if trained.is_worse() {
        let text = "on pairs that were left out the trained model is worse than the one it began from: train for longer, \
                    or on more masks";
        trained.warnings.push(text.into());
    }
}

fn fail(err: Error) -> TaskError {
    TaskError::from_error(WHAT, &err)
        .with_hint("Only mask UNets of the shipped architecture can be trained here: name such a one as the start.")
}

/// The mask model that it begins from.
fn open(setup: &TrainSetup) -> Result<(MaskSpec, MaskStart), TaskError> {
    let bundle = setup.start.open(WHAT)?;
    let no = || TaskError::new(WHAT, format!("{} is not a mask model ({})", setup.start.name, setup.start.origin));
    let (spec, file) = (bundle.mask_unet().ok_or_else(no)?.clone(), bundle.file(Role::MaskUnet).ok_or_else(no)?);
    let file = file.read(files::MODEL).map_err(|err| TaskError::new(WHAT, err))?.into_owned();
    let cast = match spec.input.cast {
        bundle::Cast::None => Cast::None,
        bundle::Cast::Saturate => Cast::Saturate,
        bundle::Cast::Wrap => Cast::Wrap,
    };
    let range_m = [spec.input.range_m.min_m as f32, spec.input.range_m.max_m as f32];
    let start = MaskStart { file, size: spec.input.size, range_m, cast };
    Ok((spec, start))
}

/// Everything that the run depends on.
fn digest(setup: &TrainSetup, gathered: &Gathered) -> String {
    let mut all = Sha256::new();
    let asked = json!({
        "program": env!("CARGO_PKG_VERSION"), "start": *setup.start.id, "tuning": setup.tuning,
        "seed": setup.choice.seed, "held_out": setup.choice.held_out_percent, "test_in_train": setup.choice.test_in_train,
    });
    all.update(asked.to_string());
    if setup.choice.from != MasksFrom::Drawn {
        all.update(setup.choice.from.key());
    }
    for drawn in gathered.learned.iter().chain(&gathered.held) {
        all.update(drawn.pair.as_bytes());
        all.update([drawn.pad.index() as u8]);
        drawn.imprint.as_slice().iter().for_each(|v| all.update(v.to_le_bytes()));
        for mask in std::iter::once(&drawn.mask).chain(&drawn.counted) {
            all.update(mask.as_slice().iter().map(|&v| u8::from(v)).collect::<Vec<u8>>());
        }
    }
    hex(&all.finalize())
}

/// Compares what the network says with what was drawn, as the program would use it.
fn mask_scores(
    spec: &MaskSpec,
    drawn: &[&Drawn],
    say: impl FnOnce(&[&[f32]]) -> touch2touch_tuning::Result<Vec<Vec<f32>>>,
) -> Result<Vec<MaskScore>, TaskError> {
    let (input, least) = (&spec.input, spec.output.threshold as f32);
    let imprints: Vec<Vec<f32>> = drawn.iter().map(|drawn| drawn.touch(input).imprint_m).collect();
    let views: Vec<&[f32]> = imprints.iter().map(Vec::as_slice).collect();
    let said = say(&views).map_err(fail)?;
    let score = |(drawn, said): (&&Drawn, Vec<f32>)| {
        let said =
            Grid::from_vec(input.size[0], input.size[1], said).map_err(|err| TaskError::from_error(WHAT, &err))?;
        let said = if input.rotation_deg == 180 { said.rotated_180() } else { said };
        let mut found = Arc::unwrap_or_clone(contact_of(&said, &drawn.imprint, least).mask);
        let mut truth = drawn.mask.clone();
        if let Some(counted) = &drawn.counted {
            for ((found, truth), counted) in
                found.as_mut_slice().iter_mut().zip(truth.as_mut_slice()).zip(counted.as_slice())
            {
                (*found, *truth) = (*found && *counted, *truth && *counted);
            }
        }
        let agreed = agreement(&found, &truth)
            .ok_or_else(|| TaskError::new(WHAT, "the mask has another size than its imprint"))?;
        Ok(MaskScore { iou: agreed.iou, dice: agreed.dice })
    };
    drawn.iter().zip(said).map(score).collect()
}
