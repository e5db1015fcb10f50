//! Times of a generation, and the part of them that is not the graphs' own work.

use std::ops::ControlFlow;
use std::time::Instant;

use serde::Serialize;

use super::cases::Case;
use crate::figures::quantile;
use touch2touch_core::diffusion::{GaussianNoise, GenerateConfig, Tensor};
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::{PadId, Rig, lab};
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::infer::bundle::{Bundle, TimestepType};
use touch2touch_pipeline::infer::engine::{EngineKind, Input};
use touch2touch_pipeline::infer::generator::{Generator, Item, prepare};

/// Pairs of runs for the overhead.
const PAIRS: usize = 30;
/// Runs for the warm time.
const WARM: usize = 7;

/// The sampler against the same number of bare graph runs.
#[derive(Debug, Serialize)]
pub(super) struct Overhead {
    pub(super) engine: EngineKind,
    /// Of the shortest run of each: what is left when other programs are taken out.
    pub(super) percent_of_shortest: f64,
}

/// Wait for the first result, milliseconds of the clock; both fingers.
#[derive(Debug, Serialize)]
pub(super) struct First {
    pub(super) engine: EngineKind,
    /// The first result of a freshly loaded generator, without loading.
    pub(super) cold_ms: f64,
    /// Median of later ones.
    pub(super) warm_ms: f64,
}

fn differences(sample: &Sample) -> anyhow::Result<[&RgbGrid; 2]> {
    let of = |finger| {
        let touch = sample.pad(finger).and_then(|touch| touch.color());
        touch.map(|g| &g.difference).ok_or_else(|| anyhow::anyhow!("a simulated grasp has both GelSlim images"))
    };
    Ok([of(lab::RIGHT)?, of(lab::LEFT)?])
}

fn ms_since(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1e3
}

/// Both fingers from image to meters, with nothing remembered from runs before.
pub(crate) fn timed_run(
    generator: &mut Generator,
    sample: &Sample,
    config: &GenerateConfig,
) -> anyhow::Result<(f64, [DepthMap; 2])> {
    let images = differences(sample)?;
    generator.forget_conditions();
    let begin = Instant::now();
    let items = [0, 1].map(|image| Item { image, seed: config.seed });
    let raw = generator.run(&images, &items, config, &mut |_| ControlFlow::Continue(()))?;
    let chain = generator.spec().depth_chain(ShiftMode::ExactInverse)?;
    let rig = Rig::lab();
    let depth = |finger: PadId| chain.clone().placed(rig.window_share(finger)).run(&raw[finger.index()]);
    let imprints = [depth(lab::RIGHT)?, depth(lab::LEFT)?];
    Ok((ms_since(begin), imprints))
}

/// The graphs alone: as often, with the same shapes, on prepared input.
fn bare(generator: &mut Generator, images: &[Tensor], steps: usize) -> anyhow::Result<f64> {
    let spec = generator.spec().clone();
    let with = |n: usize, shape: &[usize]| std::iter::once(n).chain(shape.iter().copied()).collect::<Vec<usize>>();
    let [width, height] = spec.output.size;
    // Noise, as the sampler has it: some kernels are faster on constants.
    let mut noise = GaussianNoise::new(1);
    let mut filled = |shape: Vec<usize>| {
        let mut tensor = Tensor::filled(shape, 0.0);
        tensor.data_mut().iter_mut().for_each(|v| *v = noise.draw() as f32);
        tensor
    };
    let latent = filled(with(1, &spec.latent.shape));
    let condition = filled(with(1, &spec.condition.shape));
    let (whole, float) = ([500], Tensor::filled(vec![1], 500.0));
    let timestep = match spec.timestep {
        TimestepType::Int64 => Input::I64(&whole),
        TimestepType::Float32 => Input::F32(&float),
    };
    let [encoder, denoiser, decoder] = generator.graphs();
    let begin = Instant::now();
    for image in images {
        encoder.run(&[("gelslim", Input::F32(image))], "condition", &with(1, &spec.condition.shape))?;
        for _ in 0..steps {
            let inputs =
                [("latent", Input::F32(&latent)), ("timestep", timestep), ("condition", Input::F32(&condition))];
            denoiser.run(&inputs, "prediction", latent.shape())?;
        }
        decoder.run(&[("latent", Input::F32(&latent))], "image", &[1, spec.output.channels, height, width])?;
    }
    Ok(ms_since(begin))
}

pub(super) fn overhead(
    generator: &mut Generator,
    engine: EngineKind,
    cases: &[Case],
    config: &GenerateConfig,
) -> anyhow::Result<Overhead> {
    let spec = generator.spec().clone();
    let steps = spec.schedule.steps(config.steps, config.spacing, spec.prediction)?.len();
    let (mut generated, mut alone) = (f64::INFINITY, f64::INFINITY);
    for index in 0..PAIRS {
        let case = &cases[index % cases.len()];
        let images = differences(&case.sample)?
            .iter()
            .map(|image| Ok(Tensor::stack(&[prepare(image, &spec.input)?]).expect("one tensor can be stacked")))
            .collect::<anyhow::Result<Vec<_>>>()?;
        // In turn first and second: a machine that gets slower meanwhile favors neither.
        let (with, without);
        if index % 2 == 0 {
            with = timed_run(generator, &case.sample, config)?.0;
            without = bare(generator, &images, steps)?;
        } else {
            without = bare(generator, &images, steps)?;
            with = timed_run(generator, &case.sample, config)?.0;
        }
        (generated, alone) = (generated.min(with), alone.min(without));
    }
    Ok(Overhead { engine, percent_of_shortest: 100.0 * (generated / alone - 1.0) })
}

/// Loads the bundle afresh and waits for its first results; hands the loaded generator on.
pub(super) fn first(
    bundle: &Bundle,
    engine: EngineKind,
    case: &Case,
    config: &GenerateConfig,
) -> anyhow::Result<(First, Generator)> {
    let mut generator = Generator::open(bundle, engine.into())?;
    let (cold_ms, _) = timed_run(&mut generator, &case.sample, config)?;
    let mut warm = Vec::new();
    for _ in 0..WARM {
        warm.push(timed_run(&mut generator, &case.sample, config)?.0);
    }
    let warm_ms = quantile(warm.into_iter(), 0.5).unwrap_or(f64::NAN);
    Ok((First { engine, cold_ms, warm_ms }, generator))
}
