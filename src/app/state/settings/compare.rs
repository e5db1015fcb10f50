//! The two sides of a comparison, and how they are shown.

use serde::{Deserialize, Serialize};
use strum::EnumIter;

use touch2touch_pipeline::compare::subject::Subject;

/// The way in which two imprints are held against each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum CompareMode {
    /// A at the left, B at the right.
    Side,
    /// A minus B.
    #[default]
    Difference,
}

impl CompareMode {
    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Side => "Side",
            Self::Difference => "Difference",
        }
    }

    /// The tooltip.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Side => "A on the left, B on the right",
            Self::Difference => "A minus B in millimeters: blue where A is shallower, red where it is deeper",
        }
    }
}

/// Two imprints that are compared, and how.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct CompareChoice {
    /// One.
    pub a: Subject,
    /// The other.
    pub b: Subject,
    /// The way.
    pub mode: CompareMode,
}

impl Default for CompareChoice {
    fn default() -> Self {
        Self { a: Subject::shown(), b: Subject::Measured, mode: CompareMode::default() }
    }
}

impl CompareChoice {
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
