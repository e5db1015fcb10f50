//! The two sides of a comparison, and how they are shown.

use serde::{Deserialize, Serialize};
use strum::EnumIter;

use touch2touch_pipeline::compare::subject::Subject;

with_texts! {
    /// The way in which two imprints are held against each other.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, EnumIter)]
    #[serde(rename_all = "snake_case")]
    pub enum CompareMode(name, tooltip) {
        /// A at the left, B at the right.
        Side = "Side", "A on the left, B on the right";
        /// A minus B.
        #[default]
        Difference = "Difference", "A minus B in millimeters: blue where A is shallower, red where it is deeper";
    }
}

with_defaults! {
    /// Two imprints that are compared, and how.
    #[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct CompareChoice {
        /// One.
        pub a: Subject = Subject::shown(),
        /// The other.
        pub b: Subject = Subject::Measured,
        /// The way.
        pub mode: CompareMode = CompareMode::default(),
    }
}

impl CompareChoice {
    /// True where it is the error: what is predicted minus what was measured, as at first.
    pub fn is_error(&self) -> bool {
        *self == Self::default()
    }
}
