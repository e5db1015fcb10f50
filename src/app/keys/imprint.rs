//! Keys of imprints, of their masks, and of any two against each other.

use super::super::keys::{ImprintSource, MaskRecipe, PredictionKey, Revision, ShiftMode, TouchKey};
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

/// An automatic mask of one imprint.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaskKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// The recipe.
    pub recipe: MaskRecipe,
}

/// The mask in force, as part of a recipe.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MaskVersion {
    /// Automatic.
    Auto(MaskRecipe),
    /// Corrected by hand.
    Hand(Revision),
}

/// One imprint against another of the same touch.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ComparisonKey {
    /// One: the error map is its imprint minus the other's.
    pub a: ImprintKey,
    /// The other.
    pub b: ImprintKey,
}

impl ComparisonKey {
    /// A prediction against the measurement of its touch.
    pub fn measured(recipe: PredictionKey, shift: ShiftMode) -> Self {
        Self { b: ImprintKey::Measured(recipe.touch), a: ImprintKey::Predicted(recipe, shift) }
    }
}
