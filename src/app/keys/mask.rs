//! Keys of contact masks.

use super::super::keys::{ImprintKey, Key, MaskRecipe, Revision};
use touch2touch_core::contact::ContactMask;

/// An automatic mask of one imprint.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaskKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// The recipe.
    pub recipe: MaskRecipe,
}

impl Key for MaskKey {
    type Value = ContactMask;

    fn bytes(found: &ContactMask) -> usize {
        found.mask.len()
    }
}

/// The mask in force, as part of a recipe.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MaskVersion {
    /// Automatic.
    Auto(MaskRecipe),
    /// Corrected by hand.
    Hand(Revision),
}
