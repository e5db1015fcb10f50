//! The document: labels, review states, accepted poses. Small, reversible, saved by itself.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use strum::EnumIter;

use super::error::TaskError;
use super::keys::{ImprintSource, Revision};
use crate::domain::grid::Mask;
use crate::domain::hand::AcceptedPose;
use crate::domain::rig::{PadId, PerPad};

/// How far the review of a pair is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum Review {
    /// Nobody looked at it.
    #[default]
    Todo,
    /// Its mask was touched.
    InProgress,
    /// Something about it is wrong.
    Flagged,
    /// Finished.
    Done,
    /// Left out on purpose.
    Skip,
}

impl Review {
    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Todo => "todo",
            Self::InProgress => "in progress",
            Self::Flagged => "flagged",
            Self::Done => "done",
            Self::Skip => "skip",
        }
    }

    /// The name in files.
    pub fn stored(self) -> &'static str {
        match self {
            Self::InProgress => "in_progress",
            other => other.name(),
        }
    }

    /// The state of a name in files; `None` for an unknown one.
    pub fn from_stored(name: &str) -> Option<Self> {
        use strum::IntoEnumIterator as _;
        Self::iter().find(|review| review.stored() == name)
    }

    /// Whether nothing more is to be done.
    pub fn is_finished(self) -> bool {
        matches!(self, Self::Done | Self::Skip)
    }
}

/// A mask that a person corrected.
#[derive(Clone, Debug, PartialEq)]
pub struct HandMask {
    /// The pixels, in raw bubble orientation, as large as the imprint.
    pub mask: Arc<Mask>,
    /// Changes with every change of the pixels; equal revisions are equal masks.
    pub revision: Revision,
    /// What it was before the first correction, for the label: e.g. `Threshold 5.00 mm`.
    pub base: String,
}

/// What a person said about one pair.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairLabels {
    /// Corrected masks.
    pub masks: PerPad<HandMask>,
    /// The review state.
    pub review: Review,
    /// Accepted `grasp_from_object` poses: from the measured, from the predicted imprint.
    pub accepted: [Option<AcceptedPose>; 2],
}

impl PairLabels {
    /// Whether it says nothing, so that nothing need be stored.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The pose accepted for `source`.
    pub fn accepted(&self, source: ImprintSource) -> Option<AcceptedPose> {
        self.accepted[source as usize]
    }
}

/// What happened when the stored labels of a pair were read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stored {
    /// They were read, or there are none.
    Loaded,
    /// They could not be read. The pair cannot be edited, so that nothing overwrites them.
    Blocked(TaskError),
}

/// Everything a person made, by pair name.
#[derive(Clone, Debug, Default)]
pub struct Document {
    /// Labels of the pairs looked at so far.
    pub labels: BTreeMap<String, PairLabels>,
    /// Pairs whose stored labels were read.
    pub stored: BTreeMap<String, Stored>,
    /// Review states that are not "todo", of all pairs: known at opening.
    pub reviews: BTreeMap<String, Review>,
    /// Pairs whose last change is not on the disk yet.
    pub unsaved: BTreeSet<String>,
    /// The stroke being drawn.
    pub stroke: Option<Stroke>,
    /// The last revision given out.
    pub(super) last_revision: u64,
}

/// A stroke between pointer down and pointer up.
#[derive(Clone, Debug)]
pub struct Stroke {
    /// The pair's name.
    pub pair: String,
    /// The finger.
    pub finger: PadId,
    /// Whether it adds or removes.
    pub value: bool,
    /// Radius, image pixels.
    pub radius_px: f32,
    /// The last position, image pixels.
    pub at: [f32; 2],
    /// The hand mask before the stroke; `None` if there was none.
    pub(super) before: Option<HandMask>,
    /// The pixels before the stroke, as large as the imprint.
    pub(super) pixels: Arc<Mask>,
}

impl Document {
    /// What is known about a pair, if anything.
    pub fn pair(&self, name: &str) -> Option<&PairLabels> {
        self.labels.get(name)
    }

    /// The corrected mask of one finger.
    pub fn hand_mask(&self, name: &str, finger: PadId) -> Option<&HandMask> {
        self.labels.get(name)?.masks[finger].as_ref()
    }

    /// The review state of a pair.
    pub fn review(&self, name: &str) -> Review {
        self.reviews.get(name).copied().unwrap_or_default()
    }

    /// Whether the stored labels were read, so that the pair may be edited.
    pub fn is_editable(&self, name: &str) -> bool {
        self.stored.get(name) == Some(&Stored::Loaded)
    }

    /// Why a pair cannot be edited, if its stored labels could not be read.
    pub fn blocked(&self, name: &str) -> Option<&TaskError> {
        match self.stored.get(name)? {
            Stored::Blocked(err) => Some(err),
            Stored::Loaded => None,
        }
    }

    /// A revision never given out before.
    pub(super) fn next_revision(&mut self) -> Revision {
        self.last_revision += 1;
        Revision(self.last_revision)
    }

    /// Changes the review state in both places that hold it; returns the state before.
    pub(super) fn set_review(&mut self, name: &str, review: Review) -> Review {
        let labels = self.labels.entry(name.to_owned()).or_default();
        let before = std::mem::replace(&mut labels.review, review);
        if review == Review::Todo {
            self.reviews.remove(name);
        } else {
            self.reviews.insert(name.to_owned(), review);
        }
        before
    }
}
