//! [`Labels`]: what people said about the pairs of a data set (masks drawn by hand, review states, accepted poses), as
//! it lies on the disk. The studio and every verb read and write it here.

pub mod filter;
pub mod progress;

mod accepted;
mod journal;
mod recovery;
mod stored;

pub use journal::{Act, Change, JournalHistory, Operation, Past};
pub use recovery::{Recovered, Unsaved, recover, take_in};
pub use stored::Labels;

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

use crate::io::masks;
use crate::io::predicted_id::PredictedId;
use touch2touch_core::dataset::Problem;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::label::{CleanUp, Drawing, Ground, Marks, PackError, PackedMask, Provenance, merge};
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::{PadId, Rig};

/// Source of an imprint of a touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, EnumIter, EnumString, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ImprintSource {
    /// Imprint that the Soft Bubble measured.
    #[default]
    Measured,
    /// Imprint that the generator predicts from the GelSlim image.
    Predicted,
}

impl ImprintSource {
    /// The name in files and on the command line.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Measured => Self::Predicted,
            Self::Predicted => Self::Measured,
        }
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "Measured",
            Self::Predicted => "Predicted",
        }
    }
}

/// State of a pair's review.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, EnumIter, EnumString, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Review {
    /// Nobody looked at it.
    #[default]
    Todo,
    /// The mask was touched.
    InProgress,
    /// Something about it is wrong.
    Flagged,
    /// Finished.
    Done,
    /// Left out on purpose.
    Skip,
}

impl Review {
    /// True where somebody has judged the pair, so that nothing changes its masks unasked.
    pub fn is_judged(self) -> bool {
        !matches!(self, Self::Todo | Self::InProgress)
    }

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
        self.into()
    }

    /// True where nothing more is to be done.
    pub fn is_finished(self) -> bool {
        matches!(self, Self::Done | Self::Skip)
    }
}

/// The imprint that a mask belongs to. A mask says which pixels of *this* picture are contact: another picture of the
/// same touch has its own.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImprintOf {
    /// Imprint that the Soft Bubble measured.
    #[default]
    Measured,
    /// One prediction, by all that decides it.
    Predicted(PredictedId),
}

impl ImprintOf {
    /// The prediction of a generator (its bundle's identity) with these choices.
    pub fn predicted(bundle: &str, config: &GenerateConfig, shift: ShiftMode) -> Self {
        Self::Predicted(PredictedId::new(bundle, config, shift))
    }

    /// A prediction of which nobody wrote down which one it is.
    pub fn unknown() -> Self {
        Self::Predicted(PredictedId::unknown())
    }

    /// Description for people: of a prediction the first digits of its bundle's identity, the choices, the shift.
    pub fn text(&self) -> String {
        match self {
            Self::Measured => "the measured imprint".into(),
            Self::Predicted(id) => match id.parts() {
                Some((bundle, config, shift)) => {
                    let bundle: String = bundle.chars().take(8).collect();
                    format!("the prediction of bundle {bundle} · {} · {}", config.text(), shift.label())
                }
                None => "a prediction that was not written down".into(),
            },
        }
    }

    /// Source of the imprint.
    pub fn source(&self) -> ImprintSource {
        match self {
            Self::Measured => ImprintSource::Measured,
            Self::Predicted(_) => ImprintSource::Predicted,
        }
    }
}

/// Pad and imprint that a mask is of.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaskPlace {
    /// The pad.
    pub pad: PadId,
    /// Imprint of the pad.
    pub of: ImprintOf,
}

impl MaskPlace {
    /// The measured imprint of a pad.
    pub fn measured(pad: PadId) -> Self {
        Self { pad, of: ImprintOf::Measured }
    }
}

/// Counts changes: equal revisions of the same thing are equal. Never reused within a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Revision(pub u64);

/// A mask that a person corrected.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnMask {
    /// The contact, in raw bubble orientation, as large as the imprint.
    pub mask: Arc<Mask>,
    /// Origin of each pixel, and the ignored pixels.
    pub marks: Arc<Marks>,
    /// Changes with every change of the pixels; equal revisions are equal masks.
    pub revision: Revision,
}

impl DrawnMask {
    /// A mask whose pixels are all of one provenance.
    pub fn new(mask: impl Into<Arc<Mask>>, from: Provenance) -> Self {
        let mask = mask.into();
        let marks = Arc::new(Marks::all(mask.size(), from));
        Self { mask, marks, revision: Revision::default() }
    }

    /// The mask as the person `by` accepts it whole: an automatic one that is right.
    #[must_use]
    pub fn accepted(mut self, by: &str) -> Self {
        let was = Box::new(self.marks.base().clone());
        self.marks = Arc::new(Marks::all(self.mask.size(), Provenance::Accepted { person: by.to_owned(), was }));
        self
    }

    /// Source of the mask before the first correction, in words; empty where there was none.
    pub fn base(&self) -> String {
        self.marks.base().text()
    }

    /// The pixels of which it says nothing: those that are ignored, and with `manual_checked` all that no person painted.
    pub fn unsaid(&self, manual_checked: bool) -> Option<Mask> {
        let ignored = self.marks.ignored();
        if !manual_checked {
            return ignored.cloned();
        }
        let checked = self.marks.manual_checked();
        let (width, height) = (checked.width(), checked.height());
        Some(Mask::from_fn(width, height, |x, y| !checked[(x, y)] || self.marks.is_ignored(x, y)))
    }

    /// Draws on it, as the person `by`. Whether it touched anything.
    pub fn draw(&mut self, drawing: &Drawing, ground: Ground<'_>, by: Provenance) -> bool {
        let mut touched = Mask::filled(self.mask.width(), self.mask.height(), false);
        self.draw_on(drawing, &mut touched, ground, 0, by)
    }

    /// Draws what comes after the first `from` points of a drawing that grows, as the person `by`. `touched` holds what was
    /// drawn on so far. Whether it touched anything new.
    pub fn draw_on(
        &mut self,
        drawing: &Drawing,
        touched: &mut Mask,
        ground: Ground<'_>,
        from: usize,
        by: Provenance,
    ) -> bool {
        let Some(rect) = drawing.touch(touched, ground, from) else { return false };
        let (mask, marks) = (Arc::make_mut(&mut self.mask), Arc::make_mut(&mut self.marks));
        marks.paint(mask, (touched, rect), drawing.paint, ground.proposed, by);
        true
    }

    /// Takes another mask's pixels over where they differ; see [`Marks::replace`].
    pub fn replace(&mut self, new: &Mask, by: Provenance, keep_manual: bool) -> bool {
        Arc::make_mut(&mut self.marks).replace(Arc::make_mut(&mut self.mask), new, by, keep_manual)
    }

    /// Takes another mask over with what it ignores; see [`Marks::take_over`].
    pub fn take_over(&mut self, new: &Mask, ignored: Option<&Mask>, by: Provenance, keep_manual: bool) -> [usize; 2] {
        let (mask, marks) = (Arc::make_mut(&mut self.mask), Arc::make_mut(&mut self.marks));
        marks.take_over(mask, new, ignored, by, keep_manual)
    }

    /// Cleans it up; whether anything changed. What changes nothing leaves no trace. Sizes are those of the rig's depth
    /// images.
    pub fn clean(&mut self, clean_up: CleanUp, rig: &Rig) -> bool {
        let clean = clean_up.apply(&self.mask, rig.depth_px_per_mm());
        clean != *self.mask && self.replace(&clean, Provenance::CleanUp { what: clean_up }, false)
    }

    /// True for the same pixels of the same provenances, whatever the revision.
    pub fn is_same(&self, other: &Self) -> bool {
        self.mask == other.mask && self.marks == other.marks
    }

    /// Merge of this mask with the one that somebody else made of the same `base` (`theirs`); see [`merge`].
    #[must_use]
    pub fn merged(&self, base: Option<&Self>, theirs: &Self) -> Self {
        // Where nobody had drawn, it is the automatic mask that this one began from.
        let base = base.cloned().unwrap_or_else(|| Self::new(self.mask.clone(), self.marks.base().clone()));
        let parts = [&base, self, theirs].map(|hand| (&*hand.mask, &*hand.marks));
        match merge(parts[0], parts[1], parts[2]) {
            Some((mask, marks)) => Self { mask: mask.into(), marks: marks.into(), revision: self.revision },
            // Of another imprint: the journal has it.
            None => self.clone(),
        }
    }

    /// In few bytes.
    pub fn pack(&self) -> PackedMask {
        PackedMask::pack(&self.mask, &self.marks)
    }

    /// Mask from its packed form, with the revision that it had.
    ///
    /// # Errors
    /// If it is damaged.
    pub fn unpack(packed: &PackedMask, revision: Revision) -> Result<Self, PackError> {
        let (mask, marks) = packed.unpack()?;
        Ok(Self { mask: mask.into(), marks: marks.into(), revision })
    }
}

/// Whom the system says the person is.
pub fn system_person() -> Option<String> {
    masks::person()
}

/// Labels of one pair.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairLabels {
    /// Corrected masks.
    pub masks: BTreeMap<MaskPlace, DrawnMask>,
    /// The review state.
    pub review: Review,
    /// Accepted `grasp_from_object` poses, by the imprint that they were made from.
    pub accepted: BTreeMap<ImprintOf, AcceptedPose>,
    /// Note that a person wrote about it, in one line; empty for none. See [`note`].
    pub note: String,
}

/// Longest note, characters.
pub const MAX_NOTE: usize = 1000;

/// A text as a note of a pair: one line without control characters, of at most [`MAX_NOTE`] characters.
pub fn note(text: &str) -> String {
    let words: Vec<&str> =
        text.split(|c: char| c.is_whitespace() || c.is_control()).filter(|w| !w.is_empty()).collect();
    words.join(" ").chars().take(MAX_NOTE).collect::<String>().trim_end().to_owned()
}

/// Reviews and notes of the pairs of a data set, without masks and poses.
#[derive(Clone, Debug, Default)]
pub struct Reviews {
    /// Review states that are not "todo", by pair name.
    pub states: BTreeMap<String, Review>,
    /// Notes, by pair name.
    pub notes: BTreeMap<String, String>,
    /// The files that cannot be read.
    pub problems: Vec<Problem>,
}

impl PairLabels {
    /// True where it says nothing, so that nothing need be stored.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The mask drawn by hand on the measured imprint of a pad.
    pub fn measured(&self, pad: PadId) -> Option<&DrawnMask> {
        self.masks.get(&MaskPlace::measured(pad))
    }

    /// The mask drawn by hand on an imprint, if it is as large: where there is one it is in force, and no other. The one place
    /// that says so; [`crate::steps::mask::contact_mask`] makes what is in force elsewhere.
    pub fn drawn(&self, place: &MaskPlace, imprint: &DepthMap) -> Option<&DrawnMask> {
        self.drawn_of_size(place, imprint.size())
    }

    /// Mask drawn on an imprint, if it is of this size.
    pub(crate) fn drawn_of_size(&self, place: &MaskPlace, size: [usize; 2]) -> Option<&DrawnMask> {
        self.masks.get(place).filter(|hand| hand.mask.size() == size)
    }

    /// Puts a mask in its place, or takes it away; returns what was there.
    pub fn put(&mut self, place: &MaskPlace, mask: Option<DrawnMask>) -> Option<DrawnMask> {
        match mask {
            Some(mask) => self.masks.insert(place.clone(), mask),
            None => self.masks.remove(place),
        }
    }

    /// Corrects a mask, or takes the correction back; the pair counts as begun.
    pub fn draw(&mut self, place: &MaskPlace, mask: Option<DrawnMask>) {
        self.put(place, mask);
        if self.review == Review::Todo {
            self.review = Review::InProgress;
        }
    }

    /// The pose accepted of an imprint.
    pub fn accepted(&self, of: &ImprintOf) -> Option<AcceptedPose> {
        self.accepted.get(of).copied()
    }

    /// Accepts a pose of an imprint, or withdraws it; returns what was there.
    pub fn accept(&mut self, of: &ImprintOf, pose: Option<AcceptedPose>) -> Option<AcceptedPose> {
        match pose {
            Some(pose) => self.accepted.insert(of.clone(), pose),
            None => self.accepted.remove(of),
        }
    }
}
