//! [`KeptKey`]: everything a generated result depends on, as a key.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::engine::EngineKind;
use crate::io::digest::{hex, sha256};
use touch2touch_core::diffusion::{GenerateConfig, Sampler, Spacing};
use touch2touch_core::grid::RgbGrid;

/// Same recipe, same result. The shift is not part of it: it is applied to the result.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptKey {
    /// [`input_digest`] of the GelSlim difference: the content, so that neither a name nor a place can be mistaken for
    /// another's, and data that was moved is still known.
    pub input: String,
    /// [`super::bundle::Bundle::hash`].
    pub bundle: String,
    /// The engine; results differ in the last bits.
    pub engine: EngineKind,
    /// Seed of the noise.
    pub seed: u64,
    /// Sampling steps.
    pub steps: u32,
    /// The bits of eta, so that recipes can be compared and hashed; see [`KeptKey::config`].
    eta_bits: u64,
    /// The update rule.
    pub sampler: Sampler,
    /// The training steps visited.
    pub spacing: Spacing,
    /// The bits of the guidance scale.
    guidance_bits: u64,
}

impl KeptKey {
    /// The recipe of one generation.
    pub fn new(input: String, bundle: String, engine: EngineKind, config: &GenerateConfig) -> Self {
        let GenerateConfig { steps, eta, seed, sampler, spacing, guidance } = *config;
        // + 0.0 turns -0 into 0, which means the same.
        let (eta_bits, guidance_bits) = ((eta + 0.0).to_bits(), (guidance + 0.0).to_bits());
        Self { input, bundle, engine, seed, steps, eta_bits, sampler, spacing, guidance_bits }
    }

    /// The choices of the recipe.
    pub fn config(&self) -> GenerateConfig {
        GenerateConfig {
            steps: self.steps,
            eta: f64::from_bits(self.eta_bits),
            seed: self.seed,
            sampler: self.sampler,
            spacing: self.spacing,
            guidance: f64::from_bits(self.guidance_bits),
        }
    }

    /// A name for it: hex digits that no other recipe has.
    pub fn digest(&self) -> String {
        sha256(&serde_json::to_vec(self).unwrap_or_default())
    }
}

/// The identity of a GelSlim difference image: SHA-256 of its size and of every value, in hex.
pub(crate) fn input_digest(difference: &RgbGrid) -> String {
    let mut hash = Sha256::new();
    for side in difference.size() {
        hash.update((side as u64).to_le_bytes());
    }
    let mut row = Vec::with_capacity(difference.width() * 12);
    for y in 0..difference.height() {
        row.clear();
        row.extend(difference.row(y).iter().flatten().flat_map(|v| v.to_le_bytes()));
        hash.update(&row);
    }
    hex(&hash.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::grid::Grid;

    #[test]
    fn a_recipe_is_a_key_and_survives_a_file() {
        let config = GenerateConfig { eta: 0.25, ..Default::default() };
        let recipe = |config: &GenerateConfig| KeptKey::new("a1".into(), "00ff".into(), EngineKind::Rten, config);
        let text = serde_json::to_string(&recipe(&config)).unwrap();
        let back: KeptKey = serde_json::from_str(&text).unwrap();
        assert_eq!((back.config(), &back), (config, &recipe(&config)));
        let others = [
            GenerateConfig { eta: 0.250_000_1, ..config },
            GenerateConfig { seed: 43, ..config },
            GenerateConfig { steps: 51, ..config },
            GenerateConfig { sampler: Sampler::Ddpm, ..config },
            GenerateConfig { spacing: Spacing::Lab, ..config },
            GenerateConfig { guidance: 2.0, ..config },
        ];
        for other in &others {
            assert_ne!(recipe(&config), recipe(other));
            assert_ne!(recipe(&config).digest(), recipe(other).digest());
        }
        let zero = GenerateConfig { eta: 0.0, ..config };
        assert_eq!(recipe(&zero), recipe(&GenerateConfig { eta: -0.0, ..config }));
    }

    #[test]
    fn an_image_is_known_by_every_value_and_by_its_shape() {
        let image = Grid::from_fn(4, 3, |x, y| [x as f32, y as f32, 0.5]);
        let mut other = image.clone();
        other[(3, 2)][2] = 0.500_000_1;
        let turned = Grid::from_vec(3, 4, image.as_slice().to_vec()).unwrap();
        assert_eq!(input_digest(&image), input_digest(&image.clone()));
        assert_ne!(input_digest(&image), input_digest(&other));
        assert_ne!(input_digest(&image), input_digest(&turned));
    }
}
