//! [`Schedule`]: how much signal is left at each training step, and which steps a sampler visits.

use serde::{Deserialize, Serialize};

use super::Prediction;

/// The share of signal ᾱ at each training step, in f64, never rising.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    pub(super) alpha_bar: Vec<f64>,
}

/// Spacing of the training steps that a sampler visits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, strum::EnumIter, strum::EnumString, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Spacing {
    /// The public latent-diffusion release's: `1, 1 + c, 1 + 2c, …` with `c = T / steps` rounded down. The last, noisiest
    /// steps of the training are left out, and the number of steps is `ceil(T / c)`, not always the one asked for.
    Lab,
    /// `round(T - i·T/steps) - 1` for `i = 0, 1, …`: starts at the noisiest step, where the latent really is pure noise.
    #[default]
    Trailing,
}

/// Below this ᾱ the clean latent cannot be computed from a noise prediction: rounding in the model's f32 output is
/// amplified by 1/√ᾱ, here 1e5, to the size of the latent's details.
const MIN_SIGNAL_FOR_NOISE: f64 = 1e-10;

/// One step of a sampler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The training step, what the model is told.
    pub timestep: u32,
    /// ᾱ before the step.
    pub alpha_bar: f64,
    /// ᾱ after the step; 1 after the last one.
    pub alpha_bar_next: f64,
}

/// Fault that keeps numbers from being a schedule, or a schedule from being used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ScheduleError(String);

impl Schedule {
    /// From the signal shares themselves.
    ///
    /// # Errors
    /// Empty, outside [0, 1], NaN, or rising anywhere (even in the last bit: a rise makes a noise variance negative).
    pub(crate) fn from_alpha_bar(alpha_bar: Vec<f64>) -> Result<Self, ScheduleError> {
        check_length(alpha_bar.len())?;
        for (step, &value) in alpha_bar.iter().enumerate() {
            if !(0.0..=1.0).contains(&value) {
                return refuse(format!("the signal share at training step {step} is {value}, outside 0 to 1"));
            }
        }
        if let Some(step) = alpha_bar.windows(2).position(|w| w[1] > w[0]) {
            let step = step + 1;
            return refuse(format!("the signal share rises at training step {step}; a schedule must fall"));
        }
        Ok(Self { alpha_bar })
    }

    /// Square roots of the betas evenly spaced: what latent diffusion calls "linear". The lab: (1000, 0.0015, 0.0155).
    ///
    /// # Errors
    /// As [`Self::linear`].
    pub fn scaled_linear(steps: usize, beta_start: f64, beta_end: f64) -> Result<Self, ScheduleError> {
        check_betas(steps, beta_start, beta_end)?;
        let (start, end) = (beta_start.sqrt(), beta_end.sqrt());
        let fraction = |i: usize| i as f64 / (steps.max(2) - 1) as f64;
        let alpha_bar = (0..steps).scan(1.0, |product, i| {
            *product *= 1.0 - (start + fraction(i) * (end - start)).powi(2);
            Some(*product)
        });
        Self::from_alpha_bar(alpha_bar.collect())
    }

    /// The number of training steps.
    pub fn training_steps(&self) -> usize {
        self.alpha_bar.len()
    }

    /// The steps a sampler takes, noisiest first; the last one ends at ᾱ = 1, the clean latent.
    ///
    /// # Errors
    /// No step or more than the training has, and where `prediction` is noise and a visited ᾱ is (almost) 0.
    pub fn steps(&self, steps: u32, spacing: Spacing, prediction: Prediction) -> Result<Vec<Step>, ScheduleError> {
        let total = self.alpha_bar.len();
        let count = steps as usize;
        if count == 0 || count > total {
            return refuse(format!("{steps} sampling steps; choose 1 to {total}"));
        }
        let timesteps: Vec<usize> = match spacing {
            Spacing::Trailing => {
                // Rounded half up in whole numbers: (2·(T·S - i·T) + S) / (2·S).
                (0..count).map(|i| (2 * total * (count - i) + count) / (2 * count) - 1).collect()
            }
            Spacing::Lab => {
                let stride = total / count;
                // The "+ 1" runs over the end for a stride of 1 (and for a single training step): those are dropped.
                let mut up: Vec<usize> = (0..total).step_by(stride).map(|t| t + 1).filter(|&t| t < total).collect();
                if up.is_empty() {
                    up.push(total - 1);
                }
                up.reverse();
                up
            }
        };
        let next = timesteps.iter().skip(1).map(|&t| self.alpha_bar[t]).chain(std::iter::once(1.0));
        timesteps
            .iter()
            .zip(next)
            .map(|(&t, alpha_bar_next)| {
                let alpha_bar = self.alpha_bar[t];
                if alpha_bar < MIN_SIGNAL_FOR_NOISE && prediction == Prediction::Epsilon {
                    return refuse(format!(
                        "training step {t} is pure noise, so a model that predicts noise says nothing about the image \
                         there; use a model that predicts v or the sample, or another spacing"
                    ));
                }
                Ok(Step { timestep: t as u32, alpha_bar, alpha_bar_next })
            })
            .collect()
    }
}

fn check_betas(steps: usize, start: f64, end: f64) -> Result<(), ScheduleError> {
    check_length(steps)?;
    let inside = |beta: f64| beta > 0.0 && beta < 1.0;
    if inside(start) && inside(end) {
        return Ok(());
    }
    refuse(format!("the betas run from {start} to {end}, but must lie between 0 and 1"))
}

fn check_length(steps: usize) -> Result<(), ScheduleError> {
    if (1..=1_000_000).contains(&steps) {
        return Ok(());
    }
    refuse(format!("a schedule of {steps} training steps; 1 to 1000000 can be used"))
}

fn refuse<T>(why: String) -> Result<T, ScheduleError> {
    Err(ScheduleError(why))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lab() -> Schedule {
        Schedule::scaled_linear(1000, 0.0015, 0.0155).unwrap()
    }

    #[test]
    fn the_labs_schedule_has_the_published_values() {
        let schedule = lab();
        // Values to the digits given for the lab's model.
        for (step, expected, tolerance) in
            [(0, 0.9985, 1e-9), (1, 0.996_995_6, 5e-8), (996, 0.000_700_70, 5e-9), (999, 0.000_668_67, 5e-9)]
        {
            let alpha_bar = schedule.alpha_bar[step];
            assert!((alpha_bar - expected).abs() < tolerance, "step {step}: {alpha_bar}");
        }
    }

    #[test]
    fn spacings_visit_the_documented_steps() {
        let schedule = lab();
        let visit = |n, spacing| -> Vec<u32> {
            schedule.steps(n, spacing, Prediction::Epsilon).unwrap().iter().map(|s| s.timestep).collect()
        };
        let lab = visit(200, Spacing::Lab);
        assert_eq!((lab.len(), lab[0], lab[198], lab[199]), (200, 996, 6, 1));
        assert_eq!(visit(300, Spacing::Lab).len(), 333);
        assert_eq!(visit(1, Spacing::Lab), [1]);
        assert_eq!(visit(4, Spacing::Trailing), [999, 749, 499, 249]);
        assert_eq!(visit(1, Spacing::Trailing), [999]);
        for n in 1..=1000 {
            for spacing in [Spacing::Lab, Spacing::Trailing] {
                let steps = visit(n, spacing);
                assert!(steps.windows(2).all(|w| w[1] < w[0]), "{n} {spacing:?}");
                assert!(steps[0] < 1000);
            }
        }
        assert_eq!(visit(1000, Spacing::Trailing).len(), 1000);
        assert!(schedule.steps(1001, Spacing::Lab, Prediction::V).is_err());
        assert!(schedule.steps(0, Spacing::Trailing, Prediction::V).is_err());
    }

    #[test]
    fn impossible_schedules_are_refused() {
        let risen = 0.5f64.next_up();
        for shares in [vec![], vec![0.9, 0.5, risen], vec![1.0, f64::NAN], vec![1.1]] {
            assert!(Schedule::from_alpha_bar(shares).is_err());
        }
        for (start, end) in [(0.0, 0.1), (0.1, 1.0), (f64::NAN, 0.1), (-0.1, 0.1)] {
            assert!(Schedule::scaled_linear(10, start, end).is_err());
        }
        for steps in [0, usize::MAX] {
            assert!(Schedule::scaled_linear(steps, 0.1, 0.2).is_err());
        }
        let to_zero = Schedule::from_alpha_bar(vec![0.9, 0.0]).unwrap();
        let refused = to_zero.steps(2, Spacing::Trailing, Prediction::Epsilon).unwrap_err();
        assert!(refused.to_string().starts_with("training step 1 is pure noise"), "{refused}");
        assert!(to_zero.steps(2, Spacing::Trailing, Prediction::V).is_ok());
    }
}
