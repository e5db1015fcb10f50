//! [`Paint`]: what a drawing makes of pixels.

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

/// Value that a drawing gives the pixels it touches.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    EnumIter,
    EnumString,
    IntoStaticStr,
    Serialize,
    Deserialize,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Paint {
    /// Contact.
    #[default]
    Contact,
    /// Free of contact.
    Free,
    /// Neither: a network does not learn from them, and no score counts them.
    Ignore,
    /// The value of the proposal that is shown over the mask.
    LetThrough,
}

impl Paint {
    /// The name in files and on the command line.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// Value that the other button of the pointer gives them.
    #[must_use]
    pub fn reversed(self) -> Self {
        match self {
            Self::Contact => Self::Free,
            Self::Free | Self::Ignore | Self::LetThrough => Self::Contact,
        }
    }
}
