//! [`Tuner`]: tunes a generator on pairs, step by step.

use crate::config::Config;
use crate::error::{Error, Result};
use crate::nets::generator::{self, DECODER, DENOISER, ENCODER, Files, Schedule};
use crate::onnx::Onnx;
use crate::pair::{self, Pair};
use crate::params::{Leaves, Params};
use crate::random::Random;
use crate::recipe::{FIELD, LINE, Model, Recipe, SHIFT};
use crate::state::{Origin, OriginBuilder};
use crate::trainer::{Trainer, descend};

/// A generator as its bundle describes it, and where tuning begins.
#[derive(Clone, Debug)]
pub struct Start {
    /// The condition encoder's ONNX file.
    pub encoder: Vec<u8>,
    /// The denoiser's ONNX file.
    pub denoiser: Vec<u8>,
    /// The decoder's ONNX file.
    pub decoder: Vec<u8>,
    /// The noise that the denoiser was trained on.
    pub schedule: NoiseSchedule,
    /// Sampler of the studio with this bundle; used for predictions, not for tuning.
    pub sampler: Sampler,
    /// Mean of the input by color.
    pub mean: [f32; 3],
    /// Standard deviation of the input by color.
    pub std: [f32; 3],
    /// Meters at the decoder's −1 and 1.
    pub range_m: [f64; 2],
    /// Meters at 0 and 1 of imprints.
    pub unit_m: [f64; 2],
    /// Line, shifts and fields to begin from; says how many pads there are.
    pub placement: Placement,
}

/// A "scaled linear" noise schedule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseSchedule {
    /// Training steps.
    pub steps: usize,
    /// First β.
    pub beta_start: f64,
    /// Last β.
    pub beta_end: f64,
}

/// Sampler of latents: DDIM with trailing spacing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampler {
    /// Denoising steps.
    pub steps: usize,
    /// Share of fresh noise: 0 for DDIM, 1 for DDPM.
    pub eta: f64,
    /// Seed of the noise.
    pub seed: u64,
}

/// Placement behind the decoder: where each pad's sensor looks, and what it has of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Factor and offset of the decoder's picture, in units.
    pub line: [f32; 2],
    /// By pad: how far its imprint lies from the decoder's picture, rows and columns, pixels.
    pub shift: Vec<[f32; 2]>,
    /// By pad: what its imprints have beside the touch, `side` × `side`, in units.
    pub field: Vec<Vec<f32>>,
}

/// The tuned generator.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuned {
    /// The condition encoder's ONNX file, as long as before.
    pub encoder: Vec<u8>,
    /// The denoiser's ONNX file, as long as before.
    pub denoiser: Vec<u8>,
    /// The decoder's ONNX file, as long as before.
    pub decoder: Vec<u8>,
    /// Line, shifts and fields: what comes behind the decoder.
    pub placement: Placement,
}

/// A picture to predict from, in the scale of [`Pair::picture`], and its pad; `None` for a simulated one.
pub type Query<'a> = (&'a [f32], Option<usize>);

/// A generator on its way from its bundle to a sensor. To cancel, stop calling [`crate::Descent::step`]: what
/// [`Tuner::tuned`] returns is always usable.
#[derive(Debug)]
pub struct Tuner {
    files: Files,
    sampler: Sampler,
    origin: Origin,
    trainer: Trainer<Recipe>,
}

impl Tuner {
    /// Before the first step, or where the run stood that [`crate::Descent::to_bytes`] kept as `state`: to the last bit as if
    /// it had not been stopped.
    ///
    /// # Errors
    /// If the bundle is of another architecture (which weight says so), if a setting is out of range, if there are no
    /// pairs, if a pair cannot be learned from (which one), or if the state is damaged or of another start, other pairs or
    /// other settings.
    pub fn new(start: &Start, pairs: Vec<Pair>, config: Config, state: Option<&[u8]>) -> Result<Self> {
        if config.steps == 0 {
            return Err(Error::Start { what: "steps", why: "there must be one or more".into() });
        }
        let (files, model, params) = open(start)?;
        pair::check(&pairs, model.sizes.side, model.pads)?;
        let origin = origin(start, &pairs, &config);
        let (batch, steps, threads) = (config.batch, config.steps, config.threads);
        let mut trainer = Trainer::new(Recipe::new(model, pairs, config), params, batch, steps, threads);
        state.map_or(Ok(()), |state| trainer.restore(origin, state))?;
        Ok(Self { files, sampler: start.sampler, origin, trainer })
    }

    /// The generator as it is now: the running mean of the weights.
    pub fn tuned(&self) -> Tuned {
        let params = &self.trainer.average;
        let written = |file: &Onnx, prefix: &str| {
            file.with(|name| {
                params.get(&format!("{prefix}{name}")).map(|entry| entry.values.to_vec()).unwrap_or_default()
            })
        };
        Tuned {
            encoder: written(&self.files.encoder, ENCODER),
            denoiser: written(&self.files.denoiser, DENOISER),
            decoder: written(&self.files.decoder, DECODER),
            placement: placement(params),
        }
    }

    /// Predictions of the generator as it is now (running mean of the weights), in units, for validation; as many
    /// pictures at a time as there are threads.
    ///
    /// # Errors
    /// [`Error::Pair`] with the place of a picture that has another size or values that are not numbers, or is of an
    /// unknown pad.
    pub fn predict(&self, queries: &[Query<'_>]) -> Result<Vec<Vec<f32>>> {
        let model = &self.trainer.objective.model;
        check_queries(queries, model)?;
        let draw = |i: usize| draw(model, &self.trainer.average.leaves(|_| false), self.sampler, queries[i]);
        Ok(self.trainer.workers.run(queries.len(), draw))
    }
}

// The state of a run is about 100 MB for the shipped bundle.
descend!(Tuner);

/// A start, read and checked.
fn open(start: &Start) -> Result<(Files, Model, Params)> {
    let NoiseSchedule { steps, beta_start, beta_end } = start.schedule;
    let refuse = |what, why: &str| Err(Error::Start { what, why: why.to_owned() });
    let inside = |beta: f64| beta > 0.0 && beta < 1.0;
    if !(2..=100_000).contains(&steps) || !inside(beta_start) || !inside(beta_end) {
        return refuse("schedule", "it needs at least two steps, and betas between 0 and 1");
    }
    if !(1..=steps).contains(&start.sampler.steps) || !(0.0..=1.0).contains(&start.sampler.eta) {
        return refuse("sampler", "it needs a step or more, at most as many as the schedule, and an eta from 0 to 1");
    }
    if !start.mean.iter().all(|v| v.is_finite()) || !start.std.iter().all(|&v| v.is_finite() && v > 0.0) {
        return refuse("input", "mean and standard deviation must be numbers, the latter above 0");
    }
    let widths = [start.range_m, start.unit_m].map(|[low, high]| high - low);
    if widths.iter().any(|width| !(width.is_finite() && *width > 0.0)) {
        return refuse("range", "it must rise");
    }
    let files = Files::parse(&start.encoder, &start.denoiser, &start.decoder)?;
    let (sizes, mut params) = files.read()?;
    let place = &start.placement;
    let pads = place.shift.len();
    if pads == 0 || place.field.len() != pads || place.field.iter().any(|field| field.len() != sizes.pixels()) {
        return refuse(
            "placement",
            "it needs a shift and a field of the imprint's size for each pad, and a pad or more",
        );
    }
    let numbers = place.line.iter().chain(place.shift.iter().flatten()).chain(place.field.iter().flatten());
    if numbers.into_iter().any(|v| !v.is_finite()) {
        return refuse("placement", "it has values that are not numbers");
    }
    params.push(LINE, vec![1, 2], place.line.to_vec());
    params.push(SHIFT, vec![pads, 2], place.shift.concat());
    params.push(FIELD, vec![pads, sizes.pixels()], place.field.concat());
    let ([low, high], [zero, one]) = (start.range_m, start.unit_m);
    let factor = (high - low) / 2.0 / (one - zero);
    let unit = [factor as f32, (factor + (low - zero) / (one - zero)) as f32];
    let schedule = Schedule::scaled_linear(steps, beta_start, beta_end);
    let model = Model { sizes, schedule, mean: start.mean, deviation: start.std, unit, pads };
    Ok((files, model, params))
}

/// Line, shifts and fields among the weights.
fn placement(params: &Params) -> Placement {
    let of = |name: &str| params.get(name).map(|entry| entry.values.as_slice()).unwrap_or_default();
    let pads = of(SHIFT).len() / 2;
    Placement {
        line: [of(LINE)[0], of(LINE)[1]],
        shift: of(SHIFT).chunks_exact(2).map(|shift| [shift[0], shift[1]]).collect(),
        field: of(FIELD).chunks_exact(of(FIELD).len() / pads).map(<[f32]>::to_vec).collect(),
    }
}

/// Everything that decides the outcome. Threads do not.
fn origin(start: &Start, pairs: &[Pair], config: &Config) -> Origin {
    let told = (start.schedule, start.mean, start.std, start.range_m, start.unit_m, &start.placement);
    let files = OriginBuilder::default().bytes(&start.encoder).bytes(&start.denoiser).bytes(&start.decoder);
    let begun = files.told(&told).told(&Config { threads: None, ..config.clone() });
    let pair =
        |origin: OriginBuilder, pair: &Pair| origin.numbers(&pair.picture).numbers(&pair.imprint).told(&pair.frame);
    pairs.iter().fold(begun, pair).finish()
}

fn check_queries(queries: &[Query<'_>], model: &Model) -> Result<()> {
    for (index, (picture, pad)) in queries.iter().enumerate() {
        let refuse = |why: String| Err(Error::Pair { index, why });
        if picture.len() != model.sizes.picture() {
            return refuse(format!("its picture has {} values instead of {}", picture.len(), model.sizes.picture()));
        }
        if picture.iter().any(|value| !value.is_finite()) {
            return refuse("its picture has values that are not numbers".to_owned());
        }
        if pad.is_some_and(|pad| pad >= model.pads) {
            return refuse(format!("it is of pad {}, and there are {}", pad.unwrap_or_default(), model.pads));
        }
    }
    Ok(())
}

/// One picture through the whole generator, sampled as the studio does.
fn draw(model: &Model, leaves: &Leaves<'_>, sampler: Sampler, (picture, pad): Query<'_>) -> Vec<f32> {
    let condition = generator::encode(leaves, &model.sizes, &model.standardized(picture));
    let latents = |x: &[f64]| model.latents(x.iter().map(|&v| v as f32).collect());
    let v = |x: &[f64], t: usize| {
        generator::denoise(leaves, &model.sizes, &model.schedule, &latents(x), t, &condition).values().to_vec()
    };
    let clean = latents(&sampled(model, sampler, v));
    model.seen(leaves, &clean, &[pad]).values().to_vec()
}

/// DDIM (equation 12 of the paper) from seeded noise to a clean latent; `v` is the denoiser.
fn sampled(model: &Model, sampler: Sampler, v: impl Fn(&[f64], usize) -> Vec<f32>) -> Vec<f64> {
    let mut noise = Random::sampler(sampler.seed);
    let mut x: Vec<f64> = (0..model.sizes.latent()).map(|_| noise.normal()).collect();
    let steps = model.schedule.trailing(sampler.steps);
    for (i, &t) in steps.iter().enumerate() {
        let after = steps.get(i + 1).map_or(1.0, |&t| model.schedule.bar(t));
        let (bar, (signal, grain)) = (model.schedule.bar(t), model.schedule.amplitudes(t));
        let variance = ((1.0 - after) / (1.0 - bar)).max(0.0) * (1.0 - bar / after).max(0.0);
        let fresh = sampler.eta * variance.sqrt();
        let direction = (1.0 - after - fresh * fresh).max(0.0).sqrt();
        let slope = v(&x, t);
        for (x, v) in x.iter_mut().zip(slope) {
            let v = f64::from(v);
            let (clean, epsilon) = (signal * *x - grain * v, signal * v + grain * *x);
            *x = after.sqrt() * clean + direction * epsilon;
            if fresh > 0.0 {
                *x += fresh * noise.normal();
            }
        }
    }
    x
}

#[cfg(test)]
mod tests;
