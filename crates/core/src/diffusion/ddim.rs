//! The samplers: [`sample`] runs DDIM, DDPM or DPM-Solver++(2M) over any [`Denoiser`].

use std::cmp::Ordering;
use std::hash::{Hash, Hasher};
use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::{
    Denoiser, GaussianNoise, ModelError, Prediction, Progress, Schedule, ScheduleError, Spacing, Step, Tensor, Watch,
};

/// Sampler: the rule by which the noise is taken away.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, strum::EnumIter, strum::EnumString, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Sampler {
    /// Denoising diffusion implicit models; `eta` 0 is deterministic, 1 is ancestral sampling.
    #[default]
    // What settings and bundles of earlier versions may name, whose ends are next to the same.
    #[serde(alias = "dpm_solver2m")]
    Ddim,
    /// Ancestral sampling: DDIM with `eta` 1, whatever the configuration says.
    Ddpm,
}

impl Sampler {
    /// Name in settings, files and on the command line.
    pub fn key(self) -> &'static str {
        self.into()
    }
}

/// The choices of one generation. Together with the input and the bundle it determines the result, and is part of its key:
/// numbers are compared by their bits, only that 0 and -0 mean the same.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct GenerateConfig {
    /// Sampling steps, 1 to the schedule's training steps.
    pub steps: u32,
    /// Share of fresh noise per step, 0 to 1; for [`Sampler::Ddim`].
    pub eta: f64,
    /// Seed of the starting noise and of the fresh noise.
    pub seed: u64,
    /// The update rule.
    pub sampler: Sampler,
    /// The training steps visited.
    pub spacing: Spacing,
}

impl GenerateConfig {
    /// The settings as they stand beside each picture, 3D view and file of a prediction: `2 steps · seed 42`, with the
    /// sampler and its noise where they are not the usual ones.
    pub fn text(&self) -> String {
        let Self { steps, eta, seed, sampler, .. } = *self;
        let plural = if steps == 1 { "" } else { "s" };
        let mut text = format!("{steps} step{plural} · seed {seed}");
        if sampler != Sampler::default() {
            text += &format!(" · {}", <&str>::from(sampler));
        }
        if eta != 0.0 {
            text += &format!(" · eta {eta}");
        }
        text
    }

    /// All of it as whole numbers, which have an order.
    fn bits(&self) -> (u32, u64, Sampler, u64, Spacing) {
        let Self { steps, eta, seed, sampler, spacing } = *self;
        // + 0.0 turns -0 into 0.
        (steps, seed, sampler, (eta + 0.0).to_bits(), spacing)
    }
}

impl PartialEq for GenerateConfig {
    fn eq(&self, other: &Self) -> bool {
        self.bits() == other.bits()
    }
}

impl Eq for GenerateConfig {}

impl PartialOrd for GenerateConfig {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for GenerateConfig {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bits().cmp(&other.bits())
    }
}

impl Hash for GenerateConfig {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.bits().hash(state);
    }
}

impl Default for GenerateConfig {
    fn default() -> Self {
        Self { steps: 50, eta: 0.0, seed: 42, sampler: Sampler::Ddim, spacing: Spacing::Trailing }
    }
}

/// Why a generation has no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DiffusionError {
    /// The progress closure asked to stop.
    #[error("cancelled")]
    Cancelled,
    /// The schedule cannot be used this way.
    #[error(transparent)]
    Schedule(#[from] ScheduleError),
    /// The model failed.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A choice that cannot be used, and what to choose.
    #[error("{0}")]
    Choice(String),
}

/// Generates one latent per entry of `condition`, each from a seed of its own (`config.seed` is not used), so that a batch
/// gives exactly what its entries give alone.
///
/// The [`Watch`] is told before each step and once at the end, and can end the loop within one step; one that wants them
/// gets clean latents on the way.
///
/// # Errors
/// See [`DiffusionError`].
pub fn sample(
    denoiser: &mut dyn Denoiser,
    schedule: &Schedule,
    config: &GenerateConfig,
    seeds: &[u64],
    condition: &Tensor,
    watch: &mut dyn Watch,
) -> Result<Tensor, DiffusionError> {
    if !(0.0..=1.0).contains(&config.eta) {
        return Err(DiffusionError::Choice(format!("eta is {}; choose 0 (deterministic) to 1", config.eta)));
    }
    if seeds.len() != condition.batch() {
        let why = format!("{} seeds for {} conditions", seeds.len(), condition.batch());
        return Err(DiffusionError::Choice(why));
    }
    let prediction = denoiser.prediction();
    let steps = schedule.steps(config.steps, config.spacing, prediction)?;
    let of = steps.len() as u32;
    let tell = |watch: &mut dyn Watch, step: u32| match watch.progress(Progress { step, of }) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(DiffusionError::Cancelled),
    };

    let one = denoiser.latent_shape();
    let len: usize = one.iter().product();
    let shape: Vec<usize> = std::iter::once(seeds.len()).chain(one).collect();
    let mut noises: Vec<GaussianNoise> = seeds.iter().map(|&seed| GaussianNoise::new(seed)).collect();
    // The trajectory is kept in f64; the model sees it rounded to f32.
    let mut x: Vec<f64> = noises.iter_mut().flat_map(|n| (0..len).map(|_| n.draw()).collect::<Vec<_>>()).collect();
    let mut input = Tensor::filled(shape.clone(), 0.0);
    // The clean latent as it was estimated one step earlier, for the second order.
    for (done, step) in steps.iter().enumerate() {
        tell(watch, done as u32)?;
        input.data_mut().iter_mut().zip(&x).for_each(|(to, &from)| *to = from as f32);
        let output = denoiser.predict(&input, step.timestep, condition)?;
        if output.shape() != shape {
            let (expected, found) = (shape.clone(), output.shape().to_vec());
            return Err(ModelError::Shape { graph: "denoiser".into(), expected, found }.into());
        }
        let count = output.non_finite();
        if count > 0 {
            return Err(ModelError::NonFinite { graph: "denoiser".into(), count }.into());
        }
        let after = Progress { step: done as u32 + 1, of };
        if after.step < of && watch.wants_estimate(after) {
            let update = Update::new(step, prediction, 0.0);
            let clean = x.iter().zip(output.data()).map(|(&x, &output)| update.split(x, f64::from(output)).0 as f32);
            watch.estimate(after, &Tensor::new(shape.clone(), clean.collect()).expect("one value per latent value"));
        }
        let eta = if config.sampler == Sampler::Ddpm { 1.0 } else { config.eta };
        let update = Update::new(step, prediction, eta);
        for ((x, output), noise) in x.chunks_mut(len.max(1)).zip(output.data().chunks(len.max(1))).zip(&mut noises) {
            for (x, &output) in x.iter_mut().zip(output) {
                *x = update.apply(*x, f64::from(output), noise);
            }
        }
    }
    tell(watch, of)?;
    input.data_mut().iter_mut().zip(&x).for_each(|(to, &from)| *to = from as f32);
    Ok(input)
}

/// The coefficients of one DDIM step, equation 12 of the paper.
struct Update {
    prediction: Prediction,
    signal: f64,
    noise: f64,
    signal_next: f64,
    direction_next: f64,
    sigma: f64,
}

impl Update {
    fn new(step: &Step, prediction: Prediction, eta: f64) -> Self {
        let (now, next) = (step.alpha_bar, step.alpha_bar_next);
        // Equation 16. The clamps only catch rounding: a schedule never rises.
        let variance = if now < 1.0 && next > 0.0 {
            ((1.0 - next) / (1.0 - now)).max(0.0) * (1.0 - now / next).max(0.0)
        } else {
            0.0
        };
        let sigma = eta * variance.sqrt();
        Self {
            prediction,
            signal: now.sqrt(),
            noise: (1.0 - now).sqrt(),
            signal_next: next.sqrt(),
            direction_next: (1.0 - next - sigma * sigma).max(0.0).sqrt(),
            sigma,
        }
    }

    /// The clean latent and the noise that `x` is made of, by the model's output.
    fn split(&self, x: f64, output: f64) -> (f64, f64) {
        match self.prediction {
            // signal > 0: Schedule::steps refuses pure noise for this prediction.
            Prediction::Epsilon => ((x - self.noise * output) / self.signal, output),
            Prediction::V => (self.signal * x - self.noise * output, self.signal * output + self.noise * x),
            Prediction::Sample if self.noise == 0.0 => (output, 0.0),
            Prediction::Sample => (output, (x - self.signal * output) / self.noise),
        }
    }

    fn apply(&self, x: f64, output: f64, noise: &mut GaussianNoise) -> f64 {
        let (clean, epsilon) = self.split(x, output);
        let mean = self.signal_next * clean + self.direction_next * epsilon;
        if self.sigma > 0.0 { mean + self.sigma * noise.draw() } else { mean }
    }
}

#[cfg(test)]
mod tests;
