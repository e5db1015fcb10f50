//! Keys of raw predictions, by who asks for them.

use std::sync::Arc;

use super::super::keys::TouchKey;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::job::PreviewPicture;
use touch2touch_pipeline::steps::prediction::Prediction;
use touch2touch_pipeline::steps::recipe::Recipe;

/// Everything that decides a prediction.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PredictionKey {
    /// The touch whose GelSlim image is the condition.
    pub touch: TouchKey,
    /// The bundle's identity (its digest): a changed bundle is another recipe.
    pub bundle: Arc<str>,
    /// The choices of the generation.
    pub config: GenerateConfig,
    /// The model runtime: two of them round differently.
    pub runtime: EngineChoice,
}

impl PredictionKey {
    /// The key of a touch by a recipe; `None` where that has no generator.
    pub fn of(touch: TouchKey, recipe: &Recipe) -> Option<Self> {
        let (model, config) = recipe.generator.as_ref()?;
        Some(Self { touch, bundle: model.id.clone(), config: *config, runtime: recipe.engine })
    }

    /// The key of another finger of the pair.
    #[must_use]
    pub fn on(&self, finger: PadId) -> Self {
        Self { touch: self.touch.pair.finger(finger), ..self.clone() }
    }

    /// The key that differs in its seed alone.
    #[must_use]
    pub fn with_seed(&self, seed: u64) -> Self {
        Self { config: GenerateConfig { seed, ..self.config }, ..self.clone() }
    }
}

/// Predictions with their keys.
pub(crate) type Keyed = Vec<(PredictionKey, Arc<Prediction>)>;

/// A prediction as it looks on the way.
#[derive(Clone, Debug)]
pub struct Preview {
    /// The key of what is being made.
    pub recipe: PredictionKey,
    /// The picture.
    pub picture: PreviewPicture,
}
