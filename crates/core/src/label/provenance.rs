//! [`Provenance`]: where the value of a pixel of a corrected mask comes from.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

use super::clean_up::CleanUp;
use crate::frames::PlanarPose;
use crate::units::{text_deg, text_mm};

/// Pose of the tool that a CAD distance was measured at. Poses are `grasp_from_object`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CadPose {
    /// The true one.
    Truth,
    /// The one that a registration answered.
    Registered(PlanarPose),
    /// One that a person moved there.
    Nudged(PlanarPose),
}

impl CadPose {
    fn text(self) -> String {
        let pose = |pose: PlanarPose| {
            // On screen a pose has the lab's sign: that of its inverse.
            let angle = text_deg(-pose.theta_rad);
            format!("{angle}, y {}, z {}", text_mm(pose.y_m), text_mm(pose.z_m))
        };
        match self {
            Self::Truth => "the true pose".into(),
            Self::Registered(planar) => format!("the registered pose ({})", pose(planar)),
            Self::Nudged(planar) => format!("a pose moved by hand ({})", pose(planar)),
        }
    }
}

/// Provenance of the value of a pixel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self", tag = "kind", rename_all = "snake_case")]
pub enum Provenance {
    /// Nothing: nobody and nothing said that it is contact.
    #[default]
    Nothing,
    /// A person looked at it and painted it.
    Hand {
        /// Name of the person; empty where nobody knows.
        person: String,
    },
    /// Imprint above a depth.
    Threshold {
        /// The depth, meters.
        min_m: f32,
    },
    /// The deepest share of the pixels.
    TopPercent {
        /// The share, percent.
        percent: f32,
    },
    /// Distance to the CAD model.
    Cad {
        /// The greatest distance of contact, meters.
        within_m: f32,
        /// Pose of the model.
        at: CadPose,
    },
    /// A mask model.
    Model {
        /// Name of the model.
        name: String,
        /// The identity of its bundle: a hash of its files.
        id: String,
        /// The least probability of contact, where it is not the bundle's own.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        probability: Option<f32>,
    },
    /// The simulator.
    Truth,
    /// No contact: the imprint is flat.
    Flat,
    /// A depth, because what was asked found no contact.
    Depth {
        /// The depth, meters.
        min_m: f32,
        /// Words for the provenance that was asked for.
        instead_of: String,
    },
    /// Grown from what a person painted.
    Grown,
    /// A clean-up of what was there.
    CleanUp {
        /// Clean-up.
        what: CleanUp,
    },
    /// A person looked at the whole mask, found it right, and marked its pair done.
    Accepted {
        /// Name of the person; empty where nobody knows.
        person: String,
        /// Provenance of the mask before.
        was: Box<Provenance>,
    },
    /// A file that another program wrote.
    Imported {
        /// Name of the file.
        file: String,
    },
    /// Words of a file that knew no other provenance.
    Told {
        /// Words of the file.
        text: String,
    },
}

impl Serialize for Provenance {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl<'de> Deserialize<'de> for Provenance {
    /// One of a kind that this program does not know is read as its words: no mask is refused for where it comes from.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let stored = Value::deserialize(deserializer)?;
        Self::deserialize(&stored).or_else(|err| {
            let kind = stored.get("kind").and_then(Value::as_str);
            kind.map(|_| Self::told(words(&stored))).ok_or_else(|| D::Error::custom(err))
        })
    }
}

/// The words of a stored provenance: its kind, then its fields.
fn words(stored: &Value) -> String {
    match stored {
        Value::Object(fields) => {
            let kind = fields.get("kind").and_then(Value::as_str).map(|kind| kind.replace('_', " "));
            let rest = fields.iter().filter(|(name, _)| *name != "kind").map(|(_, field)| words(field));
            kind.into_iter().chain(rest).collect::<Vec<_>>().join(" ")
        }
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

impl Provenance {
    /// Provenance from the words of a file; [`Self::Nothing`] without any.
    pub fn told(text: impl Into<String>) -> Self {
        let text = text.into();
        if text.is_empty() { Self::Nothing } else { Self::Told { text } }
    }

    /// A person, by name; an empty one where nobody knows.
    pub fn hand(person: impl Into<String>) -> Self {
        Self::Hand { person: person.into() }
    }

    /// True where a person looked at this very pixel.
    pub(crate) fn is_hand(&self) -> bool {
        matches!(self, Self::Hand { .. })
    }

    /// In words, with its numbers; empty for nothing.
    pub fn text(&self) -> String {
        match self {
            Self::Nothing => String::new(),
            Self::Hand { person } if person.is_empty() => "By hand".into(),
            Self::Hand { person } => format!("By hand, {person}"),
            Self::Threshold { min_m } => format!("Threshold {}", text_mm((*min_m).into())),
            Self::TopPercent { percent } => format!("Top {percent:.1} %"),
            Self::Cad { within_m, at: CadPose::Truth } => format!("CAD within {}", text_mm((*within_m).into())),
            Self::Cad { within_m, at } => format!("CAD within {} at {}", text_mm((*within_m).into()), at.text()),
            Self::Model { name, probability, .. } => {
                // Many models have it in their names.
                let kind = if name.contains("UNet") { "" } else { "UNet " };
                let least = probability.map_or(String::new(), |least| format!(", probability {least}"));
                format!("{kind}{name}{least}")
            }
            Self::Truth => "Simulator truth".into(),
            Self::Flat => "No contact: the imprint is flat".into(),
            Self::Depth { min_m, instead_of } => {
                format!("Depth {}: {instead_of} found no contact", text_mm((*min_m).into()))
            }
            Self::Grown => "Grown from strokes".into(),
            Self::CleanUp { what } if what.kind.is_sized() => {
                format!("{}, {}", what.kind.name(), text_mm(what.size_mm * 1e-3))
            }
            Self::CleanUp { what } => what.kind.name().into(),
            Self::Accepted { person, was } if person.is_empty() => format!("Accepted: {}", was.text()),
            Self::Accepted { person, was } => format!("Accepted by {person}: {}", was.text()),
            Self::Imported { file } => format!("Imported from {file}"),
            Self::Told { text } => text.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_names_that_is_not_known_is_read_as_its_words() {
        for (stored, words) in [
            (
                r#"{"kind": "copied", "from": "the mask of a/1", "moved": {"y_m": 0.001}}"#,
                "copied the mask of a/1 0.001",
            ),
            (r#"{"kind": "clean_up", "what": {"kind": "clear_border", "size_mm": 0.0}}"#, "clean up clear border 0.0"),
            (r#"{"kind": "of_another_program"}"#, "of another program"),
        ] {
            let read: Provenance = serde_json::from_str(stored).unwrap();
            assert_eq!(read, Provenance::told(words), "{stored}");
            assert_eq!(serde_json::from_value::<Provenance>(serde_json::to_value(&read).unwrap()).unwrap(), read);
        }
        let accepted = r#"{"kind": "accepted", "person": "Anna", "was": {"kind": "copied", "from": "it"}}"#;
        assert_eq!(serde_json::from_str::<Provenance>(accepted).unwrap().text(), "Accepted by Anna: copied it");
        let known = Provenance::Threshold { min_m: 0.002 };
        assert_eq!(serde_json::from_str::<Provenance>(&serde_json::to_string(&known).unwrap()).unwrap(), known);
        for broken in ["1", "{}", r#"{"kind": 1}"#] {
            assert!(serde_json::from_str::<Provenance>(broken).is_err(), "{broken}");
        }
    }
}
