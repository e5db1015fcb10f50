//! Keys of contact masks.

use std::sync::Arc;

use super::super::keys::{ImprintKey, Key, MaskRecipe, Revision};
use touch2touch_core::contact::{ContactMask, MaskBasis};
use touch2touch_core::grid::Mask;

/// An automatic mask of one imprint.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaskKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// The recipe.
    pub recipe: MaskRecipe,
}

impl Key for MaskKey {
    type Value = AutomaticMask;

    fn bytes(found: &AutomaticMask) -> usize {
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

/// An automatic mask.
#[derive(Clone, Debug)]
pub struct AutomaticMask {
    /// The pixels in contact.
    pub mask: Arc<Mask>,
    /// The basis that it is made of in the end.
    pub basis: MaskBasis,
    /// As [`ContactMask::unsure`].
    pub unsure: Option<f64>,
}

impl From<ContactMask> for AutomaticMask {
    fn from(found: ContactMask) -> Self {
        Self { mask: Arc::new(found.mask), basis: found.basis, unsure: found.unsure }
    }
}
