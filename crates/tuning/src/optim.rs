//! [`AdamW`]: the optimizer, with the gradient clipped over all weights; [`ramp`]: how its rates change;
//! [`follow`]: the running mean of the weights.

use std::sync::Arc;

use crate::params::Params;

/// Rate at which one array learns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rate {
    /// Step size at the height of the ramp.
    pub rate: f32,
    /// Pull toward zero, per unit of step size.
    pub decay: f32,
    /// Pull toward the values of the start, per unit of step size.
    pub anchor: f32,
}

/// Steps of rising rates.
const WARM_UP: usize = 10;
/// Share of the rates that is left at the end.
const REST: f32 = 0.02;
/// Longest gradient.
const CLIP: f32 = 1.0;

/// Factor of all rates at a step of a plan, counted from 0: a linear rise, then half a cosine down to a rest.
pub(crate) fn ramp(step: usize, steps: usize) -> f32 {
    let rise = ((step + 1) as f32 / WARM_UP as f32).min(1.0);
    let done = step as f32 / steps.max(1) as f32;
    rise * (REST + (1.0 - REST) * (1.0 + (std::f32::consts::PI * done).cos()) / 2.0)
}

/// AdamW over plain vectors. Moments exist for what is trained.
#[derive(Clone, Debug)]
pub(crate) struct AdamW {
    pub(crate) moments: Vec<Option<Moments>>,
    pub(crate) steps: u32,
}

/// Running means of an array's gradient and of its square.
#[derive(Clone, Debug)]
pub(crate) struct Moments {
    pub(crate) first: Vec<f32>,
    pub(crate) second: Vec<f32>,
}

const BETAS: [f32; 2] = [0.9, 0.99];
const EPSILON: f32 = 1e-8;

impl AdamW {
    /// Before the first step, for arrays of which those with a rate are trained.
    pub(crate) fn new(params: &Params, rates: &[Option<Rate>]) -> Self {
        let zeros = |count: usize| Moments { first: vec![0.0; count], second: vec![0.0; count] };
        let moments = params.entries().iter().zip(rates).map(|(entry, rate)| rate.map(|_| zeros(entry.values.len())));
        Self { moments: moments.collect(), steps: 0 }
    }

    /// One step against the gradient, which is shortened to a length of [`CLIP`] over all arrays. All rates are multiplied
    /// by `factor`; `start` is where anchors pull to.
    pub(crate) fn step(
        &mut self,
        params: &mut Params,
        start: &Params,
        gradient: &[Option<Vec<f32>>],
        rates: &[Option<Rate>],
        factor: f32,
    ) {
        let shorten = (CLIP / (norm(gradient) as f32 + 1e-6)).min(1.0);
        self.steps += 1;
        let [unbias_first, unbias_second] = BETAS.map(|beta| 1.0 / (1.0 - beta.powi(self.steps as i32)));
        let arrays = params.values_mut().zip(start.entries()).zip(gradient).zip(rates).zip(&mut self.moments);
        for ((((values, start), gradient), rate), moments) in arrays {
            let (Some(gradient), Some(rate), Some(moments)) = (gradient, rate, moments) else { continue };
            let size = rate.rate * factor;
            let pairs = Arc::make_mut(values).iter_mut().zip(start.values.iter()).zip(gradient);
            let pairs = pairs.zip(moments.first.iter_mut().zip(&mut moments.second));
            for (((value, start), gradient), (first, second)) in pairs {
                let gradient = gradient * shorten;
                *first = BETAS[0] * *first + (1.0 - BETAS[0]) * gradient;
                *second = BETAS[1] * *second + (1.0 - BETAS[1]) * gradient * gradient;
                let pull = rate.decay * *value + rate.anchor * (*value - start);
                let along = *first * unbias_first / ((*second * unbias_second).sqrt() + EPSILON);
                *value -= size * (pull + along);
            }
        }
    }
}

/// Length of a gradient over all arrays.
pub(crate) fn norm(gradient: &[Option<Vec<f32>>]) -> f64 {
    gradient.iter().flatten().flatten().map(|&value| f64::from(value).powi(2)).sum::<f64>().sqrt()
}

/// Largest share of the running mean of the weights that a step keeps.
const KEPT: f32 = 0.95;

/// Takes the weights after a step, counted from 0, into their running mean, which begins as the weights themselves. It
/// forgets faster at the beginning, when they still move far.
pub(crate) fn follow(average: &mut Params, params: &Params, step: usize) {
    let kept = KEPT.min((2 + step) as f32 / (6 + step) as f32);
    for (mean, entry) in average.values_mut().zip(params.entries()) {
        // What is not trained stays shared.
        if Arc::ptr_eq(mean, &entry.values) {
            continue;
        }
        for (mean, value) in Arc::make_mut(mean).iter_mut().zip(entry.values.iter()) {
            *mean += (value - *mean) * (1.0 - kept);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn params(values: &[f32]) -> Params {
        let mut params = Params::default();
        params.push("trained", vec![values.len()], values.to_vec());
        params.push("frozen", vec![1], vec![3.0]);
        params
    }

    const PLAIN: Rate = Rate { rate: 0.1, decay: 0.0, anchor: 0.0 };

    #[test]
    fn the_first_step_has_the_size_of_the_rate() {
        let mut weights = params(&[1.0, -2.0, 5.0]);
        let (start, rates) = (weights.clone(), [Some(PLAIN), None]);
        let mut adam = AdamW::new(&weights, &rates);
        adam.step(&mut weights, &start, &[Some(vec![0.3, -0.2, 0.0]), None], &rates, 1.0);
        let trained = &weights.entries()[0].values;
        assert!((trained[0] - 0.9).abs() < 1e-5 && (trained[1] + 1.9).abs() < 1e-5 && trained[2] == 5.0);
        assert_eq!(*weights.entries()[1].values, [3.0]);
    }

    #[test]
    fn a_long_gradient_is_shortened_as_a_whole() {
        // The second step shows it: the moments hold shortened gradients of different lengths.
        let rates = [Some(PLAIN), None];
        let run = |scale: f32| {
            let mut weights = params(&[1.0, 1.0]);
            let start = weights.clone();
            let mut adam = AdamW::new(&weights, &rates);
            for k in [1.0, scale] {
                adam.step(&mut weights, &start, &[Some(vec![3.0 * k, 4.0 * k]), None], &rates, 1.0);
            }
            weights.entries()[0].values.to_vec()
        };
        let (a, b) = (run(1.0), run(1000.0));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-5), "{a:?} {b:?}");
    }

    #[test]
    fn an_anchor_pulls_back_to_the_start_and_decay_to_zero() {
        for (anchor, decay, end) in [(1.0, 0.0, 2.0), (0.0, 1.0, 0.0)] {
            let rates = [Some(Rate { rate: 0.1, decay, anchor }), None];
            let (start, mut weights) = (params(&[2.0]), params(&[4.0]));
            let mut adam = AdamW::new(&weights, &rates);
            for _ in 0..200 {
                adam.step(&mut weights, &start, &[Some(vec![0.0]), None], &rates, 1.0);
            }
            assert!((weights.entries()[0].values[0] - end).abs() < 1e-4);
        }
    }

    #[test]
    fn a_bowl_is_descended() {
        let rates = [Some(PLAIN), None];
        let mut weights = params(&[3.0, -2.0]);
        let start = weights.clone();
        let mut adam = AdamW::new(&weights, &rates);
        for step in 0..300 {
            let slope: Vec<f32> = weights.entries()[0].values.iter().map(|w| 2.0 * (w - 0.5)).collect();
            adam.step(&mut weights, &start, &[Some(slope), None], &rates, ramp(step, 300));
        }
        assert!(weights.entries()[0].values.iter().all(|w| (w - 0.5).abs() < 1e-3));
    }

    #[test]
    fn rates_rise_and_fall() {
        let factor = |step| ramp(step, 50);
        assert!((factor(0) - 0.1).abs() < 1e-3);
        assert!(factor(9) > 0.9 && factor(25) < 0.52 && factor(49) < 0.03);
        assert!((10..49).all(|step| factor(step + 1) < factor(step)));
    }

    #[test]
    fn the_mean_follows_the_weights() {
        let mut average = params(&[0.0]);
        (0..400).for_each(|step| follow(&mut average, &params(&[1.0]), step));
        assert!((average.entries()[0].values[0] - 1.0).abs() < 1e-4);
    }
}
