//! The document: labels, review states, accepted poses. Small, reversible, saved by itself.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::super::keys::{EstimateKey, ImprintSource, Revision};
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::label::{DrawTool, Drawing, Ground, Provenance, VisiblePixels};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::labels::progress::Progress;
pub use touch2touch_pipeline::labels::{DrawnMask, MaskPlace, PairLabels, Review};
use touch2touch_pipeline::masks::propose::Proposal;

/// The outcome of reading the stored labels of a pair.
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
    /// Notes of all pairs: known at opening.
    pub notes: BTreeMap<String, String>,
    /// The pairs by tool and review state.
    pub progress: Progress,
    /// True where a review state was changed since they were counted.
    pub(in crate::app) marked: bool,
    /// Pairs whose last change is not on the disk yet.
    pub unsaved: BTreeSet<String>,
    /// The pairs whose last writing failed, and why.
    pub failed: BTreeMap<String, TaskError>,
    /// Pairs whose last change is in another folder than that of the data set.
    pub elsewhere: BTreeSet<String>,
    /// The question that is asked about them.
    pub question: Option<Question>,
    /// The last request to write each of them.
    pub(in crate::app) asked: BTreeMap<String, Revision>,
    /// The stroke being drawn.
    pub stroke: Option<Stroke>,
    /// The start of the last change of a mask.
    pub changed: Option<Changed>,
    /// The last revision given out.
    pub(in crate::app) last_revision: u64,
}

/// Why a person is asked about labels that are not on the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// The window is to be closed.
    Closing,
    /// The data set is not where it was opened.
    Lost,
}

/// The last change of a mask, so that what it did to the pose can be said.
#[derive(Clone, Debug, PartialEq)]
pub struct Changed {
    /// The pair's name.
    pub pair: String,
    /// The imprint.
    pub source: ImprintSource,
    /// The deed.
    pub name: Cow<'static, str>,
    /// The pose before, by its recipe.
    pub before: Option<EstimateKey>,
}

/// Labels that somebody else changed while they were being changed here.
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    /// The labels that were to be written.
    pub given: PairLabels,
    /// The labels on the disk now: both.
    pub now: PairLabels,
}

/// A stroke between pointer down and pointer up.
#[derive(Clone, Debug)]
pub struct Stroke {
    /// The pair's name.
    pub pair: String,
    /// The place of the mask that it is drawn on.
    pub place: MaskPlace,
    /// The imprint it is drawn on.
    pub source: ImprintSource,
    /// The drawing.
    pub drawing: Drawing,
    /// The proposal that is let through.
    pub(in crate::app) proposed: Option<Arc<Proposal>>,
    /// The places of its pixels in the 3D picture that it is drawn on.
    pub(in crate::app) seen: Option<VisiblePixels>,
    /// The pose before the stroke, as [`Changed::before`].
    pub(in crate::app) pose: Option<EstimateKey>,
    /// The hand mask before the stroke; `None` if there was none.
    pub(in crate::app) before: Option<DrawnMask>,
    /// The mask in force before the stroke, which is drawn on.
    pub(in crate::app) start: DrawnMask,
    /// The pixels that were touched.
    pub(in crate::app) touched: Mask,
    /// Who draws.
    pub(in crate::app) by: Provenance,
}

impl Stroke {
    /// Draws on the mask: what a brush did since its first `from` points, anything else anew. Whether it touched anything.
    pub(in crate::app) fn draw_on(&mut self, hand: &mut DrawnMask, imprint: &DepthMap, from: usize) -> bool {
        let mut undone = false;
        if !matches!(self.drawing.tool, DrawTool::Brush { .. }) {
            undone = !hand.is_same(&self.start);
            *hand = DrawnMask { revision: hand.revision, ..self.start.clone() };
            self.touched.as_mut_slice().fill(false);
        }
        let proposed = self.proposed.as_ref().map(|proposal| &proposal.mask);
        let ground = Ground { imprint, proposed, seen: self.seen.as_ref() };
        hand.draw_on(&self.drawing, &mut self.touched, ground, from, self.by.clone()) || undone
    }
}

impl Document {
    /// Labels of the pairs looked at so far, without strokes that are still being drawn.
    pub fn finished_labels(&self) -> BTreeMap<String, PairLabels> {
        self.labels.keys().filter_map(|name| Some((name.clone(), self.finished(name)?))).collect()
    }

    /// True where a polygon is being drawn that is not closed.
    pub fn has_open_polygon(&self) -> bool {
        self.stroke.as_ref().is_some_and(|stroke| stroke.drawing.is_by_clicks())
    }

    /// The labels of a pair without the stroke that is still being drawn: it may be given up.
    pub(in crate::app) fn finished(&self, name: &str) -> Option<PairLabels> {
        let mut labels = self.labels.get(name)?.clone();
        if let Some(stroke) = self.stroke.as_ref().filter(|stroke| stroke.pair == name) {
            labels.put(&stroke.place, stroke.before.clone());
        }
        Some(labels)
    }

    /// Forgets the masks and poses of a pair: they are read again when it is looked at.
    pub(in crate::app) fn reread(&mut self, name: &str) {
        self.labels.remove(name);
        self.stored.remove(name);
        self.changed = None;
    }

    /// The labels of a pair, if there are any.
    pub fn pair(&self, name: &str) -> Option<&PairLabels> {
        self.labels.get(name)
    }

    /// The corrected mask of one imprint.
    pub fn drawn_mask(&self, name: &str, place: &MaskPlace) -> Option<&DrawnMask> {
        self.labels.get(name)?.masks.get(place)
    }

    /// The review state of a pair.
    pub fn review(&self, name: &str) -> Review {
        self.reviews.get(name).copied().unwrap_or_default()
    }

    /// The note of a pair; empty for none.
    pub fn note(&self, name: &str) -> &str {
        self.notes.get(name).map_or("", String::as_str)
    }

    /// True where the stored labels were read, so that the pair may be edited.
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
    pub(in crate::app) fn next_revision(&mut self) -> Revision {
        self.last_revision += 1;
        Revision(self.last_revision)
    }

    /// Changes the review state in both places that hold it; returns the state before.
    pub(in crate::app) fn set_review(&mut self, name: &str, review: Review) -> Review {
        let labels = self.labels.entry(name.to_owned()).or_default();
        let before = std::mem::replace(&mut labels.review, review);
        self.marked |= before != review;
        if review == Review::Todo {
            self.reviews.remove(name);
        } else {
            self.reviews.insert(name.to_owned(), review);
        }
        before
    }

    /// Changes the note in both places that hold it; returns the one before.
    pub(in crate::app) fn set_note(&mut self, name: &str, note: String) -> String {
        let labels = self.labels.entry(name.to_owned()).or_default();
        if note.is_empty() {
            self.notes.remove(name);
        } else {
            self.notes.insert(name.to_owned(), note.clone());
        }
        std::mem::replace(&mut labels.note, note)
    }
}
