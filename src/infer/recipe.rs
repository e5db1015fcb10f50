//! [`Recipe`]: everything a generated result depends on, as a key.

use serde::{Deserialize, Serialize};

use super::engine::EngineKind;
use crate::domain::diffusion::{GenerateConfig, Sampler, Spacing};
use crate::domain::sensor::Finger;

/// Same recipe, same result. The shift is not part of it: it is applied to the result.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Recipe {
    /// The pair's name within its dataset, with whatever tells datasets apart.
    pub pair: String,
    /// Which finger's image.
    pub finger: Finger,
    /// [`super::bundle::Bundle::hash`].
    pub bundle: String,
    /// The engine; results differ in the last bits.
    pub engine: EngineKind,
    /// Seed of the noise.
    pub seed: u64,
    /// Sampling steps.
    pub steps: u32,
    /// The bits of eta, so that recipes can be compared and hashed; see [`Recipe::eta`].
    eta_bits: u64,
    /// The update rule.
    pub sampler: Sampler,
    /// The training steps visited.
    pub spacing: Spacing,
}

impl Recipe {
    /// The recipe of one generation.
    pub fn new(pair: String, finger: Finger, bundle: String, engine: EngineKind, config: &GenerateConfig) -> Self {
        let GenerateConfig { steps, eta, seed, sampler, spacing } = *config;
        // + 0.0 turns -0 into 0, which means the same.
        Self { pair, finger, bundle, engine, seed, steps, eta_bits: (eta + 0.0).to_bits(), sampler, spacing }
    }

    /// Share of fresh noise per step.
    pub fn eta(&self) -> f64 {
        f64::from_bits(self.eta_bits)
    }

    /// The choices of the recipe.
    pub fn config(&self) -> GenerateConfig {
        GenerateConfig {
            steps: self.steps,
            eta: self.eta(),
            seed: self.seed,
            sampler: self.sampler,
            spacing: self.spacing,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recipe_is_a_key_and_survives_a_file() {
        let config = GenerateConfig { eta: 0.25, ..Default::default() };
        let recipe =
            |config: &GenerateConfig| Recipe::new("a/1".into(), Finger::Left, "00ff".into(), EngineKind::Rten, config);
        let text = serde_json::to_string(&recipe(&config)).unwrap();
        let back: Recipe = serde_json::from_str(&text).unwrap();
        assert_eq!((back.config(), &back), (config, &recipe(&config)));
        assert_ne!(recipe(&config), recipe(&GenerateConfig { eta: 0.250_000_1, ..config }));
        let zero = GenerateConfig { eta: 0.0, ..config };
        assert_eq!(recipe(&zero), recipe(&GenerateConfig { eta: -0.0, ..config }));
    }
}
