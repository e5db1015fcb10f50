//! The two sides of a comparison, and how they are shown.

use serde::{Deserialize, Serialize};
use strum::EnumIter;

use touch2touch_pipeline::compare::subject::Subject;

/// The way in which two imprints are held against each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum VersusMode {
    /// A at the left, B at the right.
    Side,
    /// A at the left of a line that is dragged, B at the right of it.
    Wipe,
    /// A minus B.
    #[default]
    Difference,
    /// Both clouds in 3D.
    Clouds,
    /// The cloud of A in 3D, colored by how far it lies from that of B.
    Apart,
}

impl VersusMode {
    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Side => "Side",
            Self::Wipe => "Wipe",
            Self::Difference => "Difference",
            Self::Clouds => "3D",
            Self::Apart => "3D difference",
        }
    }

    /// The tooltip.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Side => "A on the left, B on the right",
            Self::Wipe => "A left, B right of a line that you drag",
            Self::Difference => "A minus B in millimeters: blue where A is shallower, red where it is deeper",
            Self::Clouds => "Contact points of both in 3D, with the CAD model at both poses",
            Self::Apart => "Points of A in 3D, colored by their distance to the surface of B, in mm",
        }
    }

    /// True where it is a 3D view.
    pub fn is_3d(self) -> bool {
        matches!(self, Self::Clouds | Self::Apart)
    }
}

/// Two imprints that are compared, and how.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Versus {
    /// One.
    pub a: Subject,
    /// The other.
    pub b: Subject,
    /// The way.
    pub mode: VersusMode,
}

impl Default for Versus {
    fn default() -> Self {
        Self { a: Subject::shown(), b: Subject::Measured, mode: VersusMode::default() }
    }
}

impl Versus {
    /// True where it is the error: what is predicted minus what was measured, as at first.
    pub fn is_error(&self) -> bool {
        *self == Self::default()
    }

    /// A in place of B and the other way round.
    #[must_use]
    pub fn swapped(self) -> Self {
        Self { a: self.b, b: self.a, mode: self.mode }
    }
}
