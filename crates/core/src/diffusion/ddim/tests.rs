//! DDIM against denoisers whose answer is known in closed form.

use super::*;

/// Knows the clean latent and so the exact noise: `x = √ᾱ·x₀ + √(1-ᾱ)·ε`.
struct Perfect {
    schedule: Schedule,
    clean: Vec<f32>,
    prediction: Prediction,
    calls: usize,
}

/// The exact posterior mean for data N(mean, std²), independent per pixel: E[x₀|x] = m + s²√ᾱ(x - √ᾱ·m)/(ᾱs² + 1-ᾱ).
struct Gaussian {
    schedule: Schedule,
    mean: Vec<f64>,
    std: f64,
    prediction: Prediction,
}

fn express(prediction: Prediction, x: f64, clean: f64, alpha_bar: f64) -> f64 {
    let (signal, noise) = (alpha_bar.sqrt(), (1.0 - alpha_bar).sqrt());
    let epsilon = if noise > 0.0 { (x - signal * clean) / noise } else { 0.0 };
    match prediction {
        Prediction::Epsilon => epsilon,
        Prediction::V => signal * epsilon - noise * clean,
        Prediction::Sample => clean,
    }
}

impl Denoiser for Perfect {
    fn predict(&mut self, latent: &Tensor, timestep: u32, _: &Tensor) -> Result<Tensor, ModelError> {
        self.calls += 1;
        let alpha_bar = self.schedule.alpha_bar[timestep as usize];
        let clean = self.clean.iter().cycle();
        let data = latent.data().iter().zip(clean);
        let data = data.map(|(&x, &c)| express(self.prediction, x.into(), c.into(), alpha_bar) as f32).collect();
        Ok(Tensor::new(latent.shape().to_vec(), data).unwrap())
    }

    fn prediction(&self) -> Prediction {
        self.prediction
    }

    fn latent_shape(&self) -> Vec<usize> {
        vec![1, 2, self.clean.len() / 2]
    }
}

impl Denoiser for Gaussian {
    fn predict(&mut self, latent: &Tensor, timestep: u32, _: &Tensor) -> Result<Tensor, ModelError> {
        let a = self.schedule.alpha_bar[timestep as usize];
        let variance = self.std * self.std;
        let data = latent.data().iter().zip(self.mean.iter().cycle()).map(|(&x, &mean)| {
            let x = f64::from(x);
            let clean = mean + variance * a.sqrt() * (x - a.sqrt() * mean) / (a * variance + 1.0 - a);
            express(self.prediction, x, clean, a) as f32
        });
        Ok(Tensor::new(latent.shape().to_vec(), data.collect()).unwrap())
    }

    fn prediction(&self) -> Prediction {
        self.prediction
    }

    fn latent_shape(&self) -> Vec<usize> {
        vec![4, 16, 16]
    }
}

const KINDS: [Prediction; 3] = [Prediction::Epsilon, Prediction::V, Prediction::Sample];

fn lab() -> Schedule {
    Schedule::scaled_linear(1000, 0.0015, 0.0155).unwrap()
}

fn condition(batch: usize) -> Tensor {
    Tensor::filled(vec![batch, 1, 2, 2], 0.0)
}

fn run(denoiser: &mut dyn Denoiser, schedule: &Schedule, config: GenerateConfig) -> Result<Tensor, DiffusionError> {
    sample(denoiser, schedule, &config, &[config.seed], &condition(1), &mut |_: Progress| ControlFlow::Continue(()))
}

#[test]
fn gaussian_data_comes_back_with_its_mean_and_spread() {
    // 1024 pixels: standard error of the mean 0.5/32, of the deviation 0.5/45; four of them, plus the sampler's own
    // error, which falls with the number of steps.
    let means: Vec<f64> = (0..1024).map(|i| f64::from(i % 7) - 3.0).collect();
    for prediction in KINDS {
        for eta in [0.0, 0.5, 1.0] {
            let mut model = Gaussian { schedule: lab(), mean: means.clone(), std: 0.5, prediction };
            let config = GenerateConfig { steps: 250, eta, seed: 3, ..Default::default() };
            let sample = run(&mut model, &lab(), config).unwrap();
            let rest: Vec<f64> = sample.data().iter().zip(&means).map(|(&x, m)| f64::from(x) - m).collect();
            let mean = rest.iter().sum::<f64>() / 1024.0;
            let std = (rest.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 1024.0).sqrt();
            assert!(mean.abs() < 0.07, "{prediction:?} eta {eta}: mean off by {mean}");
            assert!((std - 0.5).abs() < 0.05, "{prediction:?} eta {eta}: spread {std}");
        }
    }
}

#[test]
fn deterministic_sampling_follows_the_exact_flow() {
    // For Gaussian data the eta = 0 path has a closed form: x₀ = m + s·z with z the start's standardised value
    // at the noisiest step. Discretised, the error falls with the number of steps.
    let (mean, std) = (0.8, 0.3);
    let mut errors = Vec::new();
    for steps in [50, 1000] {
        let mut model = Gaussian { schedule: lab(), mean: vec![mean], std, prediction: Prediction::Epsilon };
        let samples = run(&mut model, &lab(), GenerateConfig { steps, ..Default::default() }).unwrap();
        let a = lab().alpha_bar[999];
        let mut noise = GaussianNoise::new(42);
        let worst = samples.data().iter().map(|&x| {
            let start = noise.draw();
            let z = (start - a.sqrt() * mean) / (a * std * std + 1.0 - a).sqrt();
            (f64::from(x) - (mean + std * z)).abs()
        });
        errors.push(worst.fold(0.0, f64::max));
    }
    assert!(errors[0] < 0.2 && errors[1] < 0.02, "{errors:?}");
    assert!(errors[1] < errors[0] / 4.0, "{errors:?}");
}

#[test]
fn a_batch_gives_what_its_entries_give_alone() {
    let means: Vec<f64> = vec![0.2];
    let mut model = Gaussian { schedule: lab(), mean: means, std: 0.7, prediction: Prediction::V };
    let config = GenerateConfig { steps: 5, eta: 0.8, ..Default::default() };
    let mut go =
        |seeds: &[u64]| {
            sample(&mut model, &lab(), &config, seeds, &condition(seeds.len()), &mut |_: Progress| {
                ControlFlow::Continue(())
            })
            .unwrap()
        };
    let batch = go(&[5, 6, 5]);
    assert_eq!(batch.item(0), go(&[5]).item(0));
    assert_eq!(batch.item(1), go(&[6]).item(0));
    assert_eq!(batch.item(0), batch.item(2));
    assert_ne!(batch.item(0), batch.item(1));
}

#[test]
fn cancelling_stops_within_one_step() {
    let mut model = Perfect { schedule: lab(), clean: vec![0.0; 4], prediction: Prediction::Epsilon, calls: 0 };
    let mut seen = Vec::new();
    let config = GenerateConfig { steps: 20, ..Default::default() };
    let result = sample(&mut model, &lab(), &config, &[config.seed], &condition(1), &mut |p: Progress| {
        seen.push(p);
        if p.step == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!(result, Err(DiffusionError::Cancelled));
    assert_eq!(model.calls, 3);
    assert_eq!(seen, (0..=3).map(|step| Progress { step, of: 20 }).collect::<Vec<_>>());
}

#[test]
fn wrong_parameters_and_models_are_errors() {
    struct Broken(Vec<usize>, f32);
    impl Denoiser for Broken {
        fn predict(&mut self, _: &Tensor, _: u32, _: &Tensor) -> Result<Tensor, ModelError> {
            Ok(Tensor::filled(self.0.clone(), self.1))
        }
        fn prediction(&self) -> Prediction {
            Prediction::Epsilon
        }
        fn latent_shape(&self) -> Vec<usize> {
            vec![1, 2, 2]
        }
    }
    let config = GenerateConfig::default();
    let with = |shape: Vec<usize>, value, config| run(&mut Broken(shape, value), &lab(), config);
    assert!(matches!(
        with(vec![1, 1, 2, 2], f32::NAN, config),
        Err(DiffusionError::Model(ModelError::NonFinite { count: 4, .. }))
    ));
    assert!(matches!(with(vec![1, 4], 0.0, config), Err(DiffusionError::Model(ModelError::Shape { .. }))));
    for eta in [-0.1, 1.1, f64::NAN] {
        let config = GenerateConfig { eta, ..config };
        assert!(matches!(with(vec![1, 1, 2, 2], 0.0, config), Err(DiffusionError::Choice(_))));
    }
    let mut model = Broken(vec![1, 1, 2, 2], 0.0);
    let result =
        sample(&mut model, &lab(), &config, &[1, 2], &condition(1), &mut |_: Progress| ControlFlow::Continue(()));
    assert_eq!(result, Err(DiffusionError::Choice("2 seeds for 1 conditions".into())));
}

#[test]
fn ancestral_sampling_is_that_of_ddim_and_pure_noise_stays_finite() {
    let ancestral = |sampler, eta| {
        let mut model = Gaussian { schedule: lab(), mean: vec![0.0], std: 1.0, prediction: Prediction::V };
        run(&mut model, &lab(), GenerateConfig { steps: 20, sampler, eta, ..Default::default() }).unwrap()
    };
    assert_eq!(ancestral(Sampler::Ddpm, 0.0), ancestral(Sampler::Ddim, 1.0));
    // A schedule that ends in pure noise has an infinite first step.
    let mut bars: Vec<f64> = (0..100).map(|i| 1.0 - f64::from(i) / 99.0).collect();
    bars[0] = 1.0;
    let pure = Schedule::from_alpha_bar(bars).unwrap();
    for steps in [1, 2, 5, 100] {
        let mut model = Gaussian { schedule: pure.clone(), mean: vec![0.4], std: 0.2, prediction: Prediction::V };
        let config = GenerateConfig { steps, sampler: Sampler::Ddpm, ..Default::default() };
        assert_eq!(run(&mut model, &pure, config).unwrap().non_finite(), 0, "{steps} steps");
    }
}

/// Row E22 of the list of numerical failures: every number of steps of the training, each sampler, eta from 0 to 1.
#[test]
fn e22_every_number_of_steps_stays_finite_with_every_sampler() {
    for sampler in [Sampler::Ddim, Sampler::Ddpm] {
        assert_eq!(sampler.key().parse(), Ok(sampler));
    }
    for steps in 1..=1000 {
        let sampler = [Sampler::Ddim, Sampler::Ddpm][steps as usize % 2];
        let prediction = KINDS[steps as usize / 2 % 3];
        let spacing = [Spacing::Lab, Spacing::Trailing][steps as usize / 6 % 2];
        let eta = f64::from(steps % 11) / 10.0;
        let mut model = Perfect { schedule: lab(), clean: vec![0.3, -2.0], prediction, calls: 0 };
        let config = GenerateConfig { steps, eta, sampler, spacing, ..Default::default() };
        let sample = run(&mut model, &lab(), config).unwrap();
        let worst = sample.data().iter().zip([0.3f32, -2.0]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-5, "{config:?}: {worst}");
    }
}

/// Row E22: pure noise is refused where the model predicts noise, and no noise at all is
/// finite; single precision has no say in how much noise the first step has.
#[test]
fn e22_schedules_at_the_edge_of_the_numbers() {
    let f16_would_lose = Schedule::from_alpha_bar(vec![1.0 - 1e-9, 0.5, 1e-9]).unwrap();
    let shares = [vec![1.0], vec![1.0, 1.0, 1.0], vec![0.0], vec![1.0, 0.0], vec![1.0, 1.0 - 1e-16, 1e-308]];
    let schedules = shares.into_iter().map(|s| Schedule::from_alpha_bar(s).unwrap()).chain([f16_would_lose]);
    for schedule in schedules {
        for prediction in KINDS {
            for sampler in [Sampler::Ddim, Sampler::Ddpm] {
                for steps in 1..=schedule.training_steps() as u32 {
                    let mut model = Perfect { schedule: schedule.clone(), clean: vec![0.7; 4], prediction, calls: 0 };
                    let config = GenerateConfig { steps, sampler, ..Default::default() };
                    match run(&mut model, &schedule, config) {
                        Ok(latent) => assert_eq!(latent.non_finite(), 0, "{schedule:?} {prediction:?} {config:?}"),
                        Err(err) => {
                            assert_eq!(prediction, Prediction::Epsilon, "{err}");
                            assert!(err.to_string().contains("pure noise"), "{err}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn estimates_are_what_the_model_sees_and_are_made_only_where_wanted() {
    struct Eye {
        wanted: u32,
        seen: Vec<(u32, Vec<f32>)>,
    }
    impl Watch for Eye {
        fn progress(&mut self, _: Progress) -> ControlFlow<()> {
            ControlFlow::Continue(())
        }
        fn wants_estimate(&mut self, after: Progress) -> bool {
            assert!(after.step < after.of);
            after.step == self.wanted
        }
        fn estimate(&mut self, after: Progress, clean: &Tensor) {
            self.seen.push((after.step, clean.data().to_vec()));
        }
    }
    let clean = vec![-1.5, 0.25, 0.0, 2.0];
    for sampler in [Sampler::Ddim, Sampler::Ddpm] {
        for prediction in KINDS {
            let mut model = Perfect { schedule: lab(), clean: clean.clone(), prediction, calls: 0 };
            let mut eye = Eye { wanted: 3, seen: Vec::new() };
            let config = GenerateConfig { steps: 8, sampler, ..Default::default() };
            sample(&mut model, &lab(), &config, &[1], &condition(1), &mut eye).unwrap();
            assert_eq!(eye.seen.len(), 1);
            let (step, seen) = &eye.seen[0];
            assert_eq!(*step, 3);
            assert!(seen.iter().zip(&clean).all(|(a, b)| (a - b).abs() < 1e-4), "{sampler:?} {prediction:?} {seen:?}");
        }
    }
}
