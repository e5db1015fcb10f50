//! [`Guided`]: classifier-free guidance around any denoiser.

use super::{Denoiser, ModelError, Prediction, Tensor};

/// Scales that can be asked for: 1 is the plain conditional model, 0 the unconditional one.
pub const GUIDANCE: std::ops::RangeInclusive<f64> = 0.0..=20.0;

/// A denoiser whose answer is moved away from what it says without the condition:
/// `unconditional + scale · (conditional − unconditional)` (Ho & Salimans 2021, equation 6 with scale = 1 + w).
///
/// Both answers come from one call. The combination is linear, so it is the same for noise, v and
/// sample predictions.
pub struct Guided<'a> {
    inner: &'a mut dyn Denoiser,
    /// The condition that says nothing, one item without the batch axis.
    blank: Tensor,
    scale: f64,
    /// Conditions of both halves, kept from call to call.
    both: Option<Tensor>,
}

impl<'a> Guided<'a> {
    /// `blank` is the condition of the unconditional half, without the batch axis.
    pub fn new(inner: &'a mut dyn Denoiser, blank: Tensor, scale: f64) -> Self {
        Self { inner, blank, scale, both: None }
    }

    /// The conditions of both halves.
    fn conditions(&mut self, condition: &Tensor) -> Result<(), ModelError> {
        let batch = condition.batch();
        let fits = |both: &Tensor| both.batch() == 2 * batch && both.data().starts_with(condition.data());
        if !self.both.as_ref().is_some_and(fits) {
            let found = self.blank.shape().to_vec();
            let expected = condition.shape().get(1..).unwrap_or_default().to_vec();
            let items = (0..batch).filter_map(|i| condition.item(i)).chain((0..batch).map(|_| self.blank.clone()));
            let both = Tensor::stack(&items.collect::<Vec<_>>());
            self.both = Some(both.ok_or(ModelError::Shape { graph: "condition_encoder".into(), expected, found })?);
        }
        Ok(())
    }
}

impl Denoiser for Guided<'_> {
    fn predict(&mut self, latent: &Tensor, timestep: u32, condition: &Tensor) -> Result<Tensor, ModelError> {
        self.conditions(condition)?;
        let Some(both) = &self.both else { return self.inner.predict(latent, timestep, condition) };
        let twice = Tensor::concat(&[latent, latent]).expect("a tensor has its own shape");
        let output = self.inner.predict(&twice, timestep, both)?;
        if output.shape() != twice.shape() {
            let (expected, found) = (twice.shape().to_vec(), output.shape().to_vec());
            return Err(ModelError::Shape { graph: "denoiser".into(), expected, found });
        }
        let (with, without) = output.data().split_at(output.data().len() / 2);
        let mix = |(&with, &without): (&f32, &f32)| {
            let (with, without) = (f64::from(with), f64::from(without));
            (without + self.scale * (with - without)) as f32
        };
        let data = with.iter().zip(without).map(mix).collect();
        Ok(Tensor::new(latent.shape().to_vec(), data).expect("half of twice the latent"))
    }

    fn prediction(&self) -> Prediction {
        self.inner.prediction()
    }

    fn latent_shape(&self) -> Vec<usize> {
        self.inner.latent_shape()
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::super::{GenerateConfig, Progress, Schedule, sample};
    use super::*;

    /// Says that the clean sample is the mean of the condition; counts its calls and the largest batch.
    #[derive(Default)]
    struct Echo {
        calls: usize,
        batch: usize,
    }

    impl Denoiser for Echo {
        fn predict(&mut self, latent: &Tensor, _: u32, condition: &Tensor) -> Result<Tensor, ModelError> {
            self.calls += 1;
            self.batch = self.batch.max(latent.batch());
            assert_eq!(latent.batch(), condition.batch());
            let data = (0..latent.batch()).flat_map(|i| {
                let item = condition.item(i).unwrap();
                vec![item.data().iter().sum::<f32>() / item.data().len() as f32; 4]
            });
            Ok(Tensor::new(latent.shape().to_vec(), data.collect()).unwrap())
        }

        fn prediction(&self) -> Prediction {
            Prediction::Sample
        }

        fn latent_shape(&self) -> Vec<usize> {
            vec![1, 2, 2]
        }
    }

    fn run(echo: &mut Echo, blank: f32, scale: f64) -> Tensor {
        let condition = Tensor::stack(&[Tensor::filled(vec![3], 2.0), Tensor::filled(vec![3], -1.0)]).unwrap();
        let mut guided = Guided::new(echo, Tensor::filled(vec![3], blank), scale);
        let schedule = Schedule::scaled_linear(1000, 0.0015, 0.0155).unwrap();
        let config = GenerateConfig { steps: 5, ..Default::default() };
        sample(
            &mut guided,
            &schedule,
            &config,
            &vec![config.seed; condition.batch()],
            &condition,
            &mut |_: Progress| ControlFlow::Continue(()),
        )
        .unwrap()
    }

    #[test]
    fn the_answer_moves_away_from_the_unconditional_one_in_one_call_a_step() {
        for (scale, expected) in [(1.0, [2.0, -1.0]), (0.0, [0.5, 0.5]), (3.0, [5.0, -4.0])] {
            let mut echo = Echo::default();
            let latent = run(&mut echo, 0.5, scale);
            assert_eq!((echo.calls, echo.batch), (5, 4), "two images, guided: one call of four");
            for (i, expected) in expected.into_iter().enumerate() {
                let item = latent.item(i).unwrap();
                assert!(item.data().iter().all(|v| (v - expected).abs() < 1e-5), "scale {scale}: {item:?}");
            }
        }
    }

    #[test]
    fn a_blank_condition_of_another_shape_is_refused() {
        let mut echo = Echo::default();
        let mut guided = Guided::new(&mut echo, Tensor::filled(vec![2], 0.0), 2.0);
        let refused = guided.predict(&Tensor::filled(vec![1, 1, 2, 2], 0.0), 9, &Tensor::filled(vec![1, 3], 0.0));
        assert!(matches!(refused, Err(ModelError::Shape { .. })));
    }
}
