//! Keys of imprints, and of what is read off them or their predictions.

use super::super::keys::{ImprintSource, Key, PredictionKey, ShiftMode, TouchKey};
use touch2touch_core::ambiguity::Ambiguity;
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::postprocess::Flag;
use touch2touch_pipeline::compare::Beside;
use touch2touch_pipeline::labels::ImprintOf;

/// One imprint in meters.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ImprintKey {
    /// Measured: it is in the sample.
    Measured(TouchKey),
    /// Derived from a prediction.
    Predicted(PredictionKey, ShiftMode),
    /// The mean of several predictions.
    Mean(MeanKey),
    /// The prediction of another program that lies beside the pair.
    Picture(TouchKey),
}

impl ImprintKey {
    /// The touch it belongs to.
    pub fn touch(&self) -> TouchKey {
        match self {
            Self::Measured(touch) | Self::Picture(touch) => *touch,
            Self::Predicted(recipe, _) => recipe.touch,
            Self::Mean(key) => key.touch,
        }
    }

    /// The name by which masks drawn on it are told; `None` where nobody can have drawn on it.
    pub fn of(&self) -> Option<ImprintOf> {
        match self {
            Self::Measured(_) => Some(ImprintOf::Measured),
            Self::Predicted(recipe, shift) => Some(ImprintOf::predicted(&recipe.bundle, &recipe.config, *shift)),
            Self::Mean(_) | Self::Picture(_) => None,
        }
    }

    /// The side that it is shown on where there are two.
    pub fn side(&self) -> ImprintSource {
        match self {
            Self::Measured(_) => ImprintSource::Measured,
            Self::Predicted(..) | Self::Mean(_) | Self::Picture(_) => ImprintSource::Predicted,
        }
    }
}

/// A prediction in meters.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MetersKey(pub PredictionKey, pub ShiftMode);

impl Key for MetersKey {
    type Value = DepthMap;

    fn bytes(imprint: &DepthMap) -> usize {
        imprint.len() * 4
    }
}

/// A prediction of a color sensor, as a picture.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ColorKey(pub PredictionKey);

impl Key for ColorKey {
    type Value = RgbGrid;

    fn bytes(picture: &RgbGrid) -> usize {
        picture.len() * 12
    }
}

/// The mean of several predictions of one touch.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeanKey {
    /// The touch.
    pub touch: TouchKey,
    /// At least one; they differ in their seeds.
    pub recipes: Vec<PredictionKey>,
    /// The mapping to meters.
    pub shift: ShiftMode,
}

impl Key for MeanKey {
    type Value = DepthMap;

    fn bytes(mean: &DepthMap) -> usize {
        mean.len() * 4
    }
}

/// The picture beside one touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PictureKey(pub TouchKey);

impl Key for PictureKey {
    type Value = Beside;

    fn bytes(found: &Beside) -> usize {
        4 * (found.tile.len() + found.imprint.len())
    }
}

/// The ambiguity of the GelSlim image of a touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AmbiguityKey(pub TouchKey);

impl Key for AmbiguityKey {
    /// `None` for an image without a finite pixel.
    type Value = Option<Ambiguity>;

    fn bytes(found: &Self::Value) -> usize {
        size_of_val(found)
    }
}

/// Flags: implausible things about the way of a prediction to meters.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FlagsKey(pub PredictionKey, pub ShiftMode);

impl Key for FlagsKey {
    type Value = Vec<Flag>;

    fn bytes(found: &Vec<Flag>) -> usize {
        found.len() * 512
    }
}
