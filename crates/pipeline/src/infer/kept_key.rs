//! [`KeptKey`]: everything a generated result depends on, as a key.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::engine::EngineKind;
use super::recipe_id::{Named, RecipeId};
use crate::io::digest::hex;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::RgbGrid;

/// All that decides a prediction: the picture and, in [`RecipeId`], the recipe. The shift is none of it: it is applied to
/// the result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptKey {
    /// [`input_digest`] of the GelSlim difference: the content, so that neither a name nor a place can be mistaken for
    /// another's, and data that was moved is still known.
    pub input: String,
    /// [`super::bundle::Bundle::hash`].
    pub bundle: String,
    /// The engine; results differ in the last bits.
    pub engine: EngineKind,
    /// The choices.
    pub config: GenerateConfig,
}

impl KeptKey {
    /// The identity of the recipe.
    pub fn id(&self) -> RecipeId {
        Named::prediction(&self.bundle, &self.config, self.engine.into()).id()
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
    use touch2touch_core::diffusion::{Sampler, Spacing};

    #[test]
    fn a_key_survives_a_file_and_every_choice_counts() {
        let config = GenerateConfig { eta: 0.25, ..Default::default() };
        let key = |config: &GenerateConfig| KeptKey {
            input: "a1".into(),
            bundle: "00ff".into(),
            engine: EngineKind::Rten,
            config: *config,
        };
        let back: KeptKey = serde_json::from_str(&serde_json::to_string(&key(&config)).unwrap()).unwrap();
        assert_eq!(back, key(&config));
        let others = [
            GenerateConfig { eta: 0.250_000_1, ..config },
            GenerateConfig { seed: 43, ..config },
            GenerateConfig { steps: 51, ..config },
            GenerateConfig { sampler: Sampler::Ddpm, ..config },
            GenerateConfig { spacing: Spacing::Lab, ..config },
        ];
        for other in &others {
            assert_ne!((key(&config), key(&config).id()), (key(other), key(other).id()));
            assert_ne!(key(&config).id(), key(other).id());
        }
        let zero = GenerateConfig { eta: 0.0, ..config };
        assert_eq!(key(&zero).id(), key(&GenerateConfig { eta: -0.0, ..config }).id());
        assert_ne!(key(&zero).id(), KeptKey { engine: EngineKind::Ort, ..key(&zero) }.id());
    }
}
