//! Facts about a data set for whoever opens it: sensors, pairs, tools, depths, labels, faults, and the worth of the models
//! on a sample of it ([`worth()`]); each with what would better it ([`Cure`]). The verb `doctor` and the studio's panel say
//! the same lines.

mod cure;
mod examined;
mod facts;
mod worth;

use serde::Serialize;
use strum::IntoStaticStr;

pub use cure::Cure;
pub use examined::{Examined, examined};
pub use facts::facts;
pub use worth::{SAMPLE, Worth, worth};

/// Subject of a fact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Topic {
    /// The sensors.
    Sensors,
    /// The pairs.
    Pairs,
    /// The tools.
    Tools,
    /// Their CAD models, and the unit of these.
    Cad,
    /// Depth cameras and true poses.
    Cameras,
    /// The range of the imprints.
    Range,
    /// Masks that were drawn.
    Masks,
    /// Review states.
    Reviews,
    /// Faults.
    Problems,
    /// Worth of the generator.
    Generator,
    /// Worth of the mask model.
    MaskModel,
}

impl Topic {
    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sensors => "Sensors",
            Self::Pairs => "Pairs",
            Self::Tools => "Tools",
            Self::Cad => "CAD models",
            Self::Cameras => "Cameras",
            Self::Range => "Depths",
            Self::Masks => "Masks",
            Self::Reviews => "Reviews",
            Self::Problems => "Problems",
            Self::Generator => "Generator",
            Self::MaskModel => "Mask model",
        }
    }
}

/// Degree to which a fact should trouble somebody.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Grade {
    /// As it should be, or nothing to judge.
    #[default]
    Plain,
    /// Something does not work with it, or could be better.
    Caution,
    /// Something is wrong.
    Wrong,
}

/// One line about a data set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fact {
    /// Subject.
    pub topic: Topic,
    /// Words of it, with units.
    pub text: String,
    /// Degree to which it should trouble somebody.
    pub grade: Grade,
    /// Cures: one button each.
    pub cures: Vec<Cure>,
}

impl Fact {
    /// A fact that nothing need be done about.
    pub(crate) fn plain(topic: Topic, text: impl Into<String>) -> Self {
        Self { topic, text: text.into(), grade: Grade::Plain, cures: Vec::new() }
    }

    /// With a grade.
    #[must_use]
    pub(crate) fn graded(self, grade: Grade) -> Self {
        Self { grade, ..self }
    }

    /// With one more cure.
    #[must_use]
    pub(crate) fn with_cure(mut self, cure: Cure) -> Self {
        self.cures.push(cure);
        self
    }
}
