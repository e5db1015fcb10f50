//! Keys of comparisons of any two imprints.

use super::super::keys::{CloudKey, ImprintKey, Key, PredictionKey, ShiftMode};
use touch2touch_pipeline::compare::Comparison;
use touch2touch_pipeline::compare::deviation::CloudDifference;

/// One imprint against another of the same touch.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VersusKey {
    /// One: the error map is its imprint minus the other's.
    pub a: ImprintKey,
    /// The other.
    pub b: ImprintKey,
}

impl VersusKey {
    /// A prediction against the measurement of its touch.
    pub fn measured(recipe: PredictionKey, shift: ShiftMode) -> Self {
        Self { b: ImprintKey::Measured(recipe.touch), a: ImprintKey::Predicted(recipe, shift) }
    }
}

impl Key for VersusKey {
    type Value = Comparison;

    fn bytes(found: &Comparison) -> usize {
        found.error.len() * 4
    }
}

/// The distances of the points of one cloud from another.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CloudDifferenceKey {
    /// The cloud whose points are measured.
    pub a: CloudKey,
    /// The other.
    pub b: CloudKey,
}

impl Key for CloudDifferenceKey {
    type Value = CloudDifference;

    fn bytes(found: &CloudDifference) -> usize {
        found.bytes()
    }
}
