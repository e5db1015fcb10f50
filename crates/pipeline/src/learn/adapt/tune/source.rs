//! The generator that is tuned, and touches in the tuner's units.

use std::collections::BTreeMap;

use rayon::prelude::*;
use touch2touch_tuning::{NoiseSchedule, Pair, Placement, Sampler, Start};

use super::super::WHAT;
use super::super::gather::on_grid;
use crate::error::TaskError;
use crate::infer::bundle::manifest::ScheduleSpec;
use crate::infer::bundle::{Bundle, BundleFile, GeneratorInput, Role};
use crate::infer::generator::prepare;
use crate::io::dataset::ASSUMED_IMPRINT_RANGE_M;
use crate::io::files;
use crate::steps::predict::Generating;
use touch2touch_core::catalog;
use touch2touch_core::diffusion::{self, GenerateConfig};
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};
use touch2touch_core::postprocess::{Correction, CorrectionParts};
use touch2touch_core::rig::{Rig, SensorId, lab};
use touch2touch_core::sim::{self, SimConfig};

/// Simulated grasps of each tool that keep the model from forgetting what it knows.
const SIMULATED: u64 = 6;

/// The generator that is tuned.
pub(super) struct Source {
    graphs: BTreeMap<Role, Vec<u8>>,
    schedule: NoiseSchedule,
    /// Preparation of pictures, without mean and deviation: they belong to the networks that are tuned.
    input: GeneratorInput,
    mean: [f32; 3],
    std: [f32; 3],
    range_m: [f64; 2],
    /// `[width, height]` of the decoder's picture.
    size: [usize; 2],
    turned: bool,
    config: GenerateConfig,
}

impl Source {
    pub(super) fn open(generating: Generating<'_>) -> Result<Self, TaskError> {
        let bundle: Bundle = generating.bundle.open(WHAT)?;
        let spec = bundle.generator().ok_or_else(|| TaskError::new(WHAT, "the bundle is not a generator"))?;
        let read = |file: &BundleFile| {
            file.read(files::MODEL).map(std::borrow::Cow::into_owned).map_err(|err| TaskError::new(WHAT, err))
        };
        let ScheduleSpec { steps, beta_start, beta_end, .. } = spec.schedule_spec;
        let graphs = bundle.files().map(|(role, file)| Ok((role, read(file)?))).collect::<Result<_, TaskError>>()?;
        let range = spec.output.range_m.ok_or_else(|| TaskError::new(WHAT, "it predicts no depth"))?;
        Ok(Self {
            config: *generating.config,
            graphs,
            schedule: NoiseSchedule { steps, beta_start, beta_end },
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

    pub(super) fn start(&self, placement: Placement) -> Start {
        let graph = |role| self.graphs.get(&role).cloned().unwrap_or_default();
        let config = &self.config;
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

    pub(super) fn pair(&self, picture: &RgbGrid, target: &DepthMap, frame: Option<usize>) -> Result<Pair, TaskError> {
        let prepared = prepare(picture, &self.input).map_err(|err| TaskError::from_error(WHAT, &err))?;
        let [lo, hi] = ASSUMED_IMPRINT_RANGE_M;
        // Where nothing was measured, the mean of what was.
        let finite = || target.as_slice().iter().filter(|v| v.is_finite()).map(|&v| f64::from(v));
        let mean = finite().sum::<f64>() / finite().count().max(1) as f64;
        let unit = |&v: &f32| ((if v.is_finite() { f64::from(v) } else { mean } - lo) / (hi - lo)) as f32;
        let imprint = target.as_slice().iter().map(unit).collect();
        Ok(Pair { picture: prepared.into_data(), imprint, frame })
    }

    /// Touches of the simulator, which lie where the model expects them; none for other rigs than the simulator's.
    pub(super) fn simulated(&self, rig: &Rig) -> Result<Vec<Pair>, TaskError> {
        if *rig != *Rig::lab() {
            return Ok(Vec::new());
        }
        let input: SensorId = lab::GELSLIM_ID;
        let all: Vec<(usize, u64)> =
            (0..catalog::tools().len()).flat_map(|tool| (0..SIMULATED).map(move |grasp| (tool, grasp))).collect();
        let made = all.into_par_iter().map(|(tool, grasp)| {
            let seed = self.config.seed.wrapping_mul(1000).wrapping_add(grasp + SIMULATED * tool as u64);
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
    pub(super) fn placement(&self, corrections: &[Option<Correction>]) -> Placement {
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
    pub(super) fn corrections(&self, placement: &Placement, fitted: &[Option<Correction>]) -> Vec<Option<Correction>> {
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

    pub(super) fn meters(&self, units: Vec<f32>) -> DepthMap {
        let [lo, hi] = ASSUMED_IMPRINT_RANGE_M;
        let width = self.size[0];
        Grid::from_fn(self.size[0], self.size[1], |x, y| (lo + f64::from(units[y * width + x]) * (hi - lo)) as f32)
    }
}
