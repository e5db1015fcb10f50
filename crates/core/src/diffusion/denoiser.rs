//! [`Denoiser`]: what a model is to the samplers.

use serde::{Deserialize, Serialize};

use super::Tensor;

/// Meaning of a denoiser's output, with `x = √ᾱ·x₀ + √(1-ᾱ)·ε`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Prediction {
    /// The noise ε.
    Epsilon,
    /// The velocity `√ᾱ·ε - √(1-ᾱ)·x₀` (Salimans & Ho 2022).
    V,
    /// The clean sample x₀.
    Sample,
}

/// A model could not do its part.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The engine gave up.
    #[error("the graph `{graph}` could not be run: {reason}")]
    Run {
        /// The graph's role in its bundle.
        graph: String,
        /// The engine's words.
        reason: String,
    },
    /// A tensor of another shape than agreed.
    #[error("the graph `{graph}` gave a tensor of shape {found:?} instead of {expected:?}")]
    Shape {
        /// The graph's role in its bundle.
        graph: String,
        /// Shape that the bundle states.
        expected: Vec<usize>,
        /// Shape that came.
        found: Vec<usize>,
    },
    /// NaN or infinity in an output.
    #[error(
        "the graph `{graph}` gave {count} values that are not numbers; its input may be far from what it was trained on"
    )]
    NonFinite {
        /// The graph's role in its bundle.
        graph: String,
        /// Number of such values.
        count: usize,
    },
}

/// A trained (or closed-form) model that tells signal from noise.
pub trait Denoiser {
    /// Predicts, for each entry of the batch, what [`Denoiser::prediction`] names.
    ///
    /// `latent` is `[batch, …latent_shape]`, `condition` has the same batch; the result has the shape of `latent`.
    ///
    /// # Errors
    /// [`ModelError`] if the model cannot be run.
    fn predict(&mut self, latent: &Tensor, timestep: u32, condition: &Tensor) -> Result<Tensor, ModelError>;

    /// Meaning of the output of [`Denoiser::predict`].
    fn prediction(&self) -> Prediction;

    /// Shape of one latent, without the batch.
    fn latent_shape(&self) -> Vec<usize>;
}
