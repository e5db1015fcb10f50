//! Tuning the networks themselves on the touches, after the closed form.

use std::collections::BTreeMap;

use rayon::prelude::*;
use touch2touch_tuning::{Config, NoiseSchedule, Pair, Placement, Query, Sampler, Start, Tuner};

use super::gather::{Touch, on_grid};
use super::{AdaptSetup, Tuned, WHAT};
use crate::domain::catalog;
use crate::domain::diffusion;
use crate::domain::fit::{Case, closed_form};
use crate::domain::grid::{DepthMap, Grid, RgbGrid};
use crate::domain::postprocess::{Correction, CorrectionParts};
use crate::domain::rig::{Rig, SensorId, lab};
use crate::domain::sim::{self, SimConfig};
use crate::infer::bundle::{Bundle, BundleFile, GeneratorInput, Role, ScheduleKind};
use crate::infer::generator::prepare;
use crate::io::dataset::ASSUMED_IMPRINT_RANGE_M;
use crate::io::files;
use crate::work::error::TaskError;
use crate::work::job::JobCx;

/// Simulated grasps of each tool that keep the model from forgetting what it knows.
const SIMULATED: u64 = 6;
/// Pictures predicted at a time.
const BATCH: usize = 16;

/// Tunes once for each fold without it, and once on everything.
pub(super) fn tune(
    setup: &AdaptSetup,
    touches: &[Touch],
    corrections: &[Option<Correction>],
    folds: &[usize],
    rig: &Rig,
    cx: &JobCx,
) -> Result<Tuned, TaskError> {
    let source = Source::open(setup)?;
    let pads = rig.pads().len();
    let real: Vec<Pair> =
        touches.iter().map(|t| source.pair(&t.picture, &t.target, Some(t.pad.index()))).collect::<Result<_, _>>()?;
    cx.progress(0, 0, "simulating touches that keep the model from forgetting");
    let simulated = source.simulated(setup, rig)?;
    cx.check(WHAT)?;
    let count = folds.iter().max().map_or(0, |most| most + 1);
    let total = u64::from(setup.steps) * (count as u64 + 1);
    let mut done = 0;
    let mut run = |start: &Start, pairs: Vec<Pair>, what: String| -> Result<Tuner, TaskError> {
        let config = Config { steps: setup.steps as usize, seed: setup.config.seed, ..Config::default() };
        let mut tuner = Tuner::new(start, pairs, config).map_err(fail)?;
        while tuner.steps_done() < tuner.steps() {
            cx.check(WHAT)?;
            let step = tuner.step().map_err(fail)?;
            done += 1;
            cx.progress(done, total, format!("tuning {what}: step {}, loss {:.4}", step.step, step.loss));
        }
        Ok(tuner)
    };
    let mut left_out: Vec<Option<DepthMap>> = vec![None; touches.len()];
    for fold in 0..count {
        let others: Vec<usize> = (0..touches.len()).filter(|&i| folds[i] != fold).collect();
        let held: Vec<usize> = (0..touches.len()).filter(|&i| folds[i] == fold).collect();
        if others.is_empty() {
            continue;
        }
        let cases: Vec<Case<'_>> = others.iter().map(|&i| touches[i].case()).collect();
        let without = closed_form(&cases, pads).map_err(|err| TaskError::from_error(WHAT, &err))?;
        let start = source.start(setup, source.placement(&without));
        let pairs = others.iter().map(|&i| real[i].clone()).chain(simulated.iter().cloned()).collect();
        let tuner = run(&start, pairs, format!("without part {} of {count}", fold + 1))?;
        for part in held.chunks(BATCH) {
            // A pad that the others have no pair of has no place.
            let known: Vec<usize> =
                part.iter().copied().filter(|&i| without[touches[i].pad.index()].is_some()).collect();
            let queries: Vec<Query<'_>> = known.iter().map(|&i| (real[i].picture.as_slice(), real[i].frame)).collect();
            for (&i, units) in known.iter().zip(tuner.predict(&queries).map_err(fail)?) {
                left_out[i] = Some(source.meters(units));
            }
        }
    }
    let start = source.start(setup, source.placement(corrections));
    let pairs = real.iter().cloned().chain(simulated).collect();
    let tuned = run(&start, pairs, "on all pairs".into())?.tuned();
    let corrections = source.corrections(&tuned.placement, corrections);
    let graphs =
        [(Role::ConditionEncoder, tuned.encoder), (Role::Denoiser, tuned.denoiser), (Role::Decoder, tuned.decoder)];
    Ok(Tuned { graphs: graphs.into(), corrections, left_out })
}

fn fail(err: touch2touch_tuning::Error) -> TaskError {
    TaskError::from_error("Tune the model", &err)
        .with_hint("Networks of another kind than the shipped ones are fitted in closed form: leave --tune out.")
}

/// The generator that is tuned.
struct Source {
    graphs: BTreeMap<Role, Vec<u8>>,
    schedule: NoiseSchedule,
    /// How pictures are prepared, without mean and deviation: they belong to the networks that are tuned.
    input: GeneratorInput,
    mean: [f32; 3],
    std: [f32; 3],
    range_m: [f64; 2],
    /// `[width, height]` of the decoder's picture.
    size: [usize; 2],
    turned: bool,
}

impl Source {
    fn open(setup: &AdaptSetup) -> Result<Self, TaskError> {
        let bundle: Bundle = setup.bundle.open(WHAT)?;
        let spec = bundle.generator().ok_or_else(|| TaskError::new(WHAT, "the bundle is no generator"))?;
        let read = |file: &BundleFile| {
            file.read(files::MODEL).map(std::borrow::Cow::into_owned).map_err(|err| TaskError::new(WHAT, err))
        };
        let schedule = &spec.schedule_spec;
        let (Some(beta_start), Some(beta_end), ScheduleKind::ScaledLinear) =
            (schedule.beta_start, schedule.beta_end, schedule.kind)
        else {
            return Err(TaskError::new(WHAT, "only networks with a scaled linear schedule are tuned"));
        };
        let graphs = bundle.files().map(|(role, file)| Ok((role, read(file)?))).collect::<Result<_, TaskError>>()?;
        let range = spec.output.range_m.ok_or_else(|| TaskError::new(WHAT, "it predicts no depth"))?;
        Ok(Self {
            graphs,
            schedule: NoiseSchedule { steps: schedule.steps, beta_start, beta_end },
            mean: [0, 1, 2].map(|c| spec.input.mean.get(c).map_or(0.0, |&v| v as f32)),
            std: [0, 1, 2].map(|c| spec.input.std.get(c).map_or(1.0, |&v| v as f32)),
            input: GeneratorInput {
                mean: vec![0.0; spec.input.mean.len()],
                std: vec![1.0; spec.input.std.len()],
                ..spec.input.clone()
            },
            range_m: range.into(),
            size: spec.output.size,
            turned: spec.output.rotation_deg == 180,
        })
    }

    fn start(&self, setup: &AdaptSetup, placement: Placement) -> Start {
        let graph = |role| self.graphs.get(&role).cloned().unwrap_or_default();
        let config = &setup.config;
        let eta = if config.sampler == diffusion::Sampler::Ddpm { 1.0 } else { config.eta };
        Start {
            encoder: graph(Role::ConditionEncoder),
            denoiser: graph(Role::Denoiser),
            decoder: graph(Role::Decoder),
            schedule: self.schedule,
            sampler: Sampler { steps: config.steps as usize, eta, seed: config.seed },
            mean: self.mean,
            std: self.std,
            range_m: self.range_m,
            unit_m: ASSUMED_IMPRINT_RANGE_M,
            placement,
        }
    }

    fn pair(&self, picture: &RgbGrid, target: &DepthMap, frame: Option<usize>) -> Result<Pair, TaskError> {
        let prepared = prepare(picture, &self.input).map_err(|err| TaskError::from_error(WHAT, &err))?;
        let [lo, hi] = ASSUMED_IMPRINT_RANGE_M;
        // Where nothing was measured, the mean of what was.
        let finite = || target.as_slice().iter().filter(|v| v.is_finite()).map(|&v| f64::from(v));
        let mean = finite().sum::<f64>() / finite().count().max(1) as f64;
        let unit = |&v: &f32| ((if v.is_finite() { f64::from(v) } else { mean } - lo) / (hi - lo)) as f32;
        let imprint = target.as_slice().iter().map(unit).collect();
        Ok(Pair { picture: prepared.into_data(), imprint, frame, weight: 1.0 })
    }

    /// Touches of the simulator, which lie where the model expects them; none for other rigs than the simulator's.
    fn simulated(&self, setup: &AdaptSetup, rig: &Rig) -> Result<Vec<Pair>, TaskError> {
        if *rig != *Rig::lab() {
            return Ok(Vec::new());
        }
        let input: SensorId = lab::GELSLIM_ID;
        let all: Vec<(usize, u64)> =
            (0..catalog::tools().len()).flat_map(|tool| (0..SIMULATED).map(move |grasp| (tool, grasp))).collect();
        let made = all.into_par_iter().map(|(tool, grasp)| {
            let seed = setup.config.seed.wrapping_mul(1000).wrapping_add(grasp + SIMULATED * tool as u64);
            let sample = sim::simulate(&catalog::tools()[tool], sim::random_grasp(seed), seed, &SimConfig::default());
            let touches = sample.pads.entries().filter_map(|(_, touch)| Some((touch.picture(input)?, touch.depth()?)));
            touches
                .map(|(picture, bubble)| {
                    let target = on_grid(&bubble.imprint, None, self.turned, self.size);
                    self.pair(&picture, &target, None)
                })
                .collect::<Result<Vec<Pair>, TaskError>>()
        });
        Ok(made.collect::<Result<Vec<_>, _>>()?.concat())
    }

    /// The closed form as the tuning begins with it: in units of 0..1.
    fn placement(&self, corrections: &[Option<Correction>]) -> Placement {
        let [lo, hi] = ASSUMED_IMPRINT_RANGE_M;
        let pixels = self.size[0] * self.size[1];
        let [gain, offset_m] = corrections.iter().flatten().next().map_or([1.0, 0.0], |c| c.line);
        let of = |correction: &Option<Correction>| match correction {
            Some(c) => (
                [c.offset_px[1] as f32, c.offset_px[0] as f32],
                c.field.as_slice().iter().map(|&v| (f64::from(v) / (hi - lo)) as f32).collect(),
            ),
            None => ([0.0; 2], vec![0.0; pixels]),
        };
        let (shift, field) = corrections.iter().map(of).unzip();
        Placement { line: [gain as f32, ((gain * lo + offset_m - lo) / (hi - lo)) as f32], shift, field }
    }

    /// The other way: the corrections of the pads that were fitted.
    fn corrections(&self, placement: &Placement, fitted: &[Option<Correction>]) -> Vec<Option<Correction>> {
        let [lo, hi] = ASSUMED_IMPRINT_RANGE_M;
        let [gain, offset] = placement.line.map(f64::from);
        let line = [gain, offset * (hi - lo) + lo - gain * lo];
        let flat = |value: f32| Grid::filled(self.size[0], self.size[1], value);
        let of = |(pad, before): (usize, &Option<Correction>)| {
            before.as_ref()?;
            let [down, right] = placement.shift[pad].map(f64::from);
            let width = self.size[0];
            let field = Grid::from_fn(self.size[0], self.size[1], |x, y| {
                (f64::from(placement.field[pad][y * width + x]) * (hi - lo)) as f32
            });
            Some(Correction {
                offset_px: [right, down],
                line,
                mean: flat(0.0),
                field,
                gain: flat(1.0),
                response: None,
                parts: CorrectionParts::ALL,
            })
        };
        fitted.iter().enumerate().map(of).collect()
    }

    fn meters(&self, units: Vec<f32>) -> DepthMap {
        let [lo, hi] = ASSUMED_IMPRINT_RANGE_M;
        let width = self.size[0];
        Grid::from_fn(self.size[0], self.size[1], |x, y| (lo + f64::from(units[y * width + x]) * (hi - lo)) as f32)
    }
}
