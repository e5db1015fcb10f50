//! [`Random`]: numbers that depend on a seed and on what they are for, not on what was drawn before.
//!
//! So a run that goes on after a stop needs no state of a generator, only the number of its steps.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// A stream of numbers.
#[derive(Clone, Debug)]
pub(crate) struct Random {
    rng: ChaCha8Rng,
    spare: Option<f64>,
}

/// Purpose of a stream; streams of different purposes have nothing to do with each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Decisions about a whole batch.
    Batch = 1,
    /// The order of the pairs.
    Order = 2,
    /// Variation of a pair.
    Variation = 3,
    /// Noise that sampling begins with.
    Noise = 4,
}

impl Random {
    /// The stream of a seed for a purpose, at a step, for an item.
    pub(crate) fn new(seed: u64, purpose: Purpose, step: usize, item: usize) -> Self {
        let mut key = [0; 32];
        for (to, part) in key.chunks_exact_mut(8).zip([seed, purpose as u64, step as u64, item as u64]) {
            to.copy_from_slice(&part.to_le_bytes());
        }
        Self { rng: ChaCha8Rng::from_seed(key), spare: None }
    }

    /// The stream from which the studio's sampler draws its noise.
    pub(crate) fn sampler(seed: u64) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed), spare: None }
    }

    /// Uniform in [0, 1).
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.rng.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in [−1, 1).
    pub(crate) fn signed(&mut self) -> f64 {
        2.0 * self.uniform() - 1.0
    }

    /// True with this probability.
    pub(crate) fn happens(&mut self, probability: f64) -> bool {
        self.uniform() < probability
    }

    /// A whole number below `count`, which must not be 0.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((self.uniform() * count as f64) as usize).min(count - 1)
    }

    /// Standard normal (Box-Muller; both numbers of a pair are used, cosine first).
    pub(crate) fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        // 1 − u lies in (0, 1], so the logarithm is finite.
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        let (sin, cos) = (std::f64::consts::TAU * self.uniform()).sin_cos();
        self.spare = Some(radius * sin);
        radius * cos
    }

    /// Standard normal numbers.
    pub(crate) fn normals(&mut self, count: usize) -> Vec<f32> {
        (0..count).map(|_| self.normal() as f32).collect()
    }

    /// The numbers below `count` in a random order.
    pub(crate) fn order(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        for last in (1..count).rev() {
            order.swap(last, self.below(last + 1));
        }
        order
    }
}

/// The `k`-th item of a sequence in which all of `of` come once, in random order, before any comes again; sequences of
/// different `kind` have nothing to do with each other.
pub(crate) fn dealt(seed: u64, of: &[usize], k: usize, kind: usize) -> usize {
    let (round, place) = (k / of.len(), k % of.len());
    of[Random::new(seed, Purpose::Order, round, kind).order(of.len())[place]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_by_each_part_of_their_name() {
        let first = |seed, purpose, step, item| Random::new(seed, purpose, step, item).uniform();
        let base = first(1, Purpose::Noise, 2, 3);
        assert_eq!(base, first(1, Purpose::Noise, 2, 3));
        let others = [
            first(2, Purpose::Noise, 2, 3),
            first(1, Purpose::Order, 2, 3),
            first(1, Purpose::Noise, 3, 3),
            first(1, Purpose::Noise, 2, 4),
        ];
        assert!(others.iter().all(|&other| other != base));
    }

    #[test]
    fn orders_hold_each_number_once_and_numbers_stay_in_range() {
        let mut random = Random::new(5, Purpose::Order, 0, 0);
        let mut order = random.order(100);
        assert_ne!(order, (0..100).collect::<Vec<_>>());
        order.sort_unstable();
        assert_eq!(order, (0..100).collect::<Vec<_>>());
        assert!((0..1000).all(|_| random.below(3) < 3));
        let normals = random.normals(20_000);
        let (mean, square) = (normals.iter().sum::<f32>() / 2e4, normals.iter().map(|v| v * v).sum::<f32>() / 2e4);
        assert!(mean.abs() < 0.03 && (square - 1.0).abs() < 0.03);
    }
}
