//! [`Prediction`]: what a generator made of a touch.

use std::collections::BTreeMap;
use std::sync::Arc;

use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::fit::Fitted;
use touch2touch_core::postprocess::{ColorChain, DepthChain, RawPrediction, ShiftMode};

/// Per range mapping the steps to meters, or why it cannot be done.
pub(crate) type Chains = Arc<BTreeMap<ShiftMode, Result<DepthChain, String>>>;

/// A prediction: the decoder's picture, with the ways to meters.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// The decoder's picture.
    pub raw: RawPrediction,
    /// The ways to meters that its bundle offers.
    pub chains: Chains,
    /// The fit of the bundle to a rig, if it was fitted to one.
    pub fit: Option<Arc<Fitted>>,
    /// The steps to a color sensor's picture; `None` where it is depth that was predicted.
    pub color: Option<ColorChain>,
    /// The identity of the generator's bundle.
    pub bundle: Arc<str>,
    /// The engine that made it, for people.
    pub engine: String,
    /// Time that making it took, seconds; what was made together shares its time.
    pub seconds: f64,
    /// True where it was made earlier and only read now.
    pub kept: bool,
}

/// Model, settings and depth scale of a prediction, in words.
pub fn predicted_by(bundle: &str, config: &GenerateConfig, shift: ShiftMode) -> String {
    format!("{bundle} · {} · {}", config.text(), shift.label().to_lowercase())
}
