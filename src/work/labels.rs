//! [`Labels`]: what people said about the pairs of a data set (masks drawn by hand, review states, accepted poses), as
//! it lies on the disk. The studio and every verb read and write it here.

mod journal;
mod record;

pub use journal::{Act, Change, Deed, Past};
pub use record::{Base, MaskRecord, PAUSE_S, Record, working_seconds};

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

use super::error::TaskError;
use crate::domain::dataset::Problem;
use crate::domain::diffusion::GenerateConfig;
use crate::domain::grid::{DepthMap, Mask};
use crate::domain::hand::AcceptedPose;
use crate::domain::label::{CleanUp, Drawing, Ground, Marks, PackError, PackedMask, Provenance, merge};
use crate::domain::postprocess::ShiftMode;
use crate::domain::rig::{PadId, Rig};
use crate::io::dataset::Dataset;
use crate::io::masks::{self, MaskStore, StoreError, StoredMask, StoredReview};

/// Which imprint of a touch.
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
    Serialize,
    Deserialize,
    EnumIter,
    EnumString,
    IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ImprintSource {
    /// What the Soft Bubble measured.
    #[default]
    Measured,
    /// What the generator predicts from the GelSlim image.
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

/// How far the review of a pair is.
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
    Serialize,
    Deserialize,
    EnumIter,
    EnumString,
    IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
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
    /// Whether somebody has judged the pair, so that nothing changes its masks unasked.
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

    /// The state of a name in files; `None` for an unknown one.
    pub fn from_stored(name: &str) -> Option<Self> {
        name.parse().ok()
    }

    /// Whether nothing more is to be done.
    pub fn is_finished(self) -> bool {
        matches!(self, Self::Done | Self::Skip)
    }
}

/// The imprint that a mask belongs to. A mask says which pixels of *this* picture are contact: another picture of the
/// same touch has its own.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImprintOf {
    /// What the Soft Bubble measured.
    #[default]
    Measured,
    /// One prediction, by all that decides it; see [`ImprintOf::predicted`].
    Predicted(Arc<str>),
}

impl ImprintOf {
    /// The prediction of a generator (its bundle's identity) with these choices.
    pub fn predicted(bundle: &str, config: &GenerateConfig, shift: ShiftMode) -> Self {
        let choices = serde_json::to_string(&(config, shift)).unwrap_or_else(|_| format!("{config:?} {shift:?}"));
        Self::Predicted(format!("{bundle} {choices}").into())
    }

    /// Bundle and choices of a prediction, as [`Self::predicted`] took them; `None` for what was measured, and for what another
    /// version of the program wrote otherwise.
    pub fn prediction(&self) -> Option<(&str, GenerateConfig, ShiftMode)> {
        let Self::Predicted(of) = self else { return None };
        let (bundle, choices) = of.split_once(' ')?;
        let (config, shift) = serde_json::from_str(choices).ok()?;
        Some((bundle, config, shift))
    }

    /// Which of the two it is.
    pub fn source(&self) -> ImprintSource {
        match self {
            Self::Measured => ImprintSource::Measured,
            Self::Predicted(_) => ImprintSource::Predicted,
        }
    }
}

/// What a mask is of.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaskPlace {
    /// The pad.
    pub pad: PadId,
    /// Its imprint.
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
pub struct HandMask {
    /// The contact, in raw bubble orientation, as large as the imprint.
    pub mask: Arc<Mask>,
    /// Where each pixel comes from, and which are ignored.
    pub marks: Arc<Marks>,
    /// Changes with every change of the pixels; equal revisions are equal masks.
    pub revision: Revision,
}

impl HandMask {
    /// A mask whose pixels are all of one provenance.
    pub fn new(mask: impl Into<Arc<Mask>>, from: Provenance) -> Self {
        let mask = mask.into();
        let marks = Arc::new(Marks::all(mask.size(), from));
        Self { mask, marks, revision: Revision::default() }
    }

    /// What it was before the first correction, in words; empty where it was nothing.
    pub fn base(&self) -> String {
        self.marks.base().text()
    }

    /// The pixels of which it says nothing: those that are ignored, and with `hand_checked` all that no person painted.
    pub fn unsaid(&self, hand_checked: bool) -> Option<Mask> {
        let ignored = self.marks.ignored();
        if !hand_checked {
            return ignored.cloned();
        }
        let checked = self.marks.hand_checked();
        let (width, height) = (checked.width(), checked.height());
        Some(Mask::from_fn(width, height, |x, y| !checked[(x, y)] || self.marks.is_ignored(x, y)))
    }

    /// Draws on it, as the person `by`.
    pub fn draw(&mut self, drawing: &Drawing, ground: Ground<'_>, by: Provenance) {
        let mut touched = Mask::filled(self.mask.width(), self.mask.height(), false);
        self.draw_on(drawing, &mut touched, ground, 0, by);
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
    pub fn replace(&mut self, new: &Mask, by: Provenance, keep_hand: bool) -> bool {
        Arc::make_mut(&mut self.marks).replace(Arc::make_mut(&mut self.mask), new, by, keep_hand)
    }

    /// Takes another mask over with what it ignores; see [`Marks::take_over`].
    pub fn take_over(&mut self, new: &Mask, ignored: Option<&Mask>, by: Provenance, keep_hand: bool) -> [usize; 2] {
        let (mask, marks) = (Arc::make_mut(&mut self.mask), Arc::make_mut(&mut self.marks));
        marks.take_over(mask, new, ignored, by, keep_hand)
    }

    /// Cleans it up; whether anything changed. Sizes are those of the rig's depth images.
    pub fn clean(&mut self, clean_up: CleanUp, rig: &Rig) -> bool {
        let clean = clean_up.apply(&self.mask, rig.depth_px_per_mm());
        self.replace(&clean, Provenance::CleanUp { what: clean_up }, false)
    }

    /// A copy of it for the other imprint of the touch, `from` being that of this one.
    #[must_use]
    pub fn copied(&self, from: ImprintSource) -> Self {
        let whose = if self.marks.has_hand_work() { "By hand".into() } else { self.base() };
        let from = format!("the {} imprint's mask ({whose})", from.name().to_lowercase());
        Self::new(self.mask.clone(), Provenance::Copied { from, moved: None })
    }

    /// The same pixels of the same provenances, whatever the revision.
    pub fn is_same(&self, other: &Self) -> bool {
        self.mask == other.mask && self.marks == other.marks
    }

    /// What was made of `base` here, and by somebody else there (`theirs`), in one; see [`merge`].
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

    /// What was packed, with the revision that it had.
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

/// What a person said about one pair.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairLabels {
    /// Corrected masks.
    pub masks: BTreeMap<MaskPlace, HandMask>,
    /// The review state.
    pub review: Review,
    /// Accepted `grasp_from_object` poses: from the measured, from the predicted imprint.
    pub accepted: [Option<AcceptedPose>; 2],
    /// What a person wrote about it, in one line; empty for nothing. See [`note`].
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

/// What people said about the pairs of a data set, apart from masks and poses.
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
    /// Whether it says nothing, so that nothing need be stored.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The mask drawn by hand on the measured imprint of a pad.
    pub fn measured(&self, pad: PadId) -> Option<&HandMask> {
        self.masks.get(&MaskPlace::measured(pad))
    }

    /// The mask drawn by hand on an imprint, if it is as large.
    pub fn drawn(&self, place: &MaskPlace, imprint: &DepthMap) -> Option<&HandMask> {
        self.masks.get(place).filter(|hand| hand.mask.size() == imprint.size())
    }

    /// Puts a mask in its place, or takes it away; returns what was there.
    pub fn put(&mut self, place: &MaskPlace, mask: Option<HandMask>) -> Option<HandMask> {
        match mask {
            Some(mask) => self.masks.insert(place.clone(), mask),
            None => self.masks.remove(place),
        }
    }

    /// Corrects a mask, or takes the correction back; the pair counts as begun.
    pub fn draw(&mut self, place: &MaskPlace, mask: Option<HandMask>) {
        self.put(place, mask);
        if self.review == Review::Todo {
            self.review = Review::InProgress;
        }
    }

    /// The pose accepted for `source`.
    pub fn accepted(&self, source: ImprintSource) -> Option<AcceptedPose> {
        self.accepted[source as usize]
    }
}

/// The labels of an open data set. Clones share what they know.
#[derive(Clone, Debug)]
pub struct Labels {
    store: Arc<Result<MaskStore, StoreError>>,
    /// What whoever saves here holds, as far as it was read or given here: only differences are written, over what
    /// somebody else may have written meanwhile.
    saved: Arc<Mutex<BTreeMap<String, PairLabels>>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn hand_of(stored: StoredMask) -> HandMask {
    HandMask { mask: Arc::new(stored.mask), marks: Arc::new(stored.marks), revision: Revision::default() }
}

fn store_error(what: &str, err: &StoreError) -> TaskError {
    TaskError::from_error(what, err).with_hint(err.hint())
}

impl Labels {
    /// Those of a data set; where there is no place for labels, there are none, and saving says why.
    pub fn of(dataset: &Dataset) -> Self {
        Self { store: Arc::new(MaskStore::for_dataset(dataset)), saved: Arc::default() }
    }

    /// Those in a folder that another program or person wrote, of the same sensors.
    pub fn in_folder(dataset: &Dataset, folder: &Path) -> Self {
        let store = MaskStore::in_folder(folder.to_owned()).of_rig(dataset.rig.clone());
        Self { store: Arc::new(Ok(store)), saved: Arc::default() }
    }

    /// The same of a data set that grew: what was written since the opening stays known.
    #[must_use]
    pub fn continued(&self, dataset: &Dataset) -> Self {
        Self { store: Arc::new(MaskStore::for_dataset(dataset)), saved: self.saved.clone() }
    }

    /// What a person drew a second time without seeing the first; in a folder of its own.
    ///
    /// # Errors
    /// If there is no place for labels.
    pub fn repeats_of(&self, person: &str) -> Result<Self, TaskError> {
        let store = self.store("Repeats")?.repeats_of(person);
        Ok(Self { store: Arc::new(Ok(store)), saved: Arc::default() })
    }

    /// The folder they lie in.
    ///
    /// # Errors
    /// If there is no place for labels.
    pub fn folder(&self) -> Result<&Path, TaskError> {
        Ok(self.store("Labels")?.folder())
    }

    pub(super) fn store(&self, what: &str) -> Result<&MaskStore, TaskError> {
        (*self.store).as_ref().map_err(|err| store_error(what, err))
    }

    /// Review states and notes of all pairs.
    pub fn reviews(&self) -> Reviews {
        let store = match &*self.store {
            Ok(store) => store,
            Err(err) => {
                let problem =
                    Problem { file: std::path::PathBuf::new(), what: err.to_string(), hint: err.hint().into() };
                return Reviews { problems: vec![problem], ..Reviews::default() };
            }
        };
        let (stored, problems) = store.reviews();
        let mut reviews = Reviews { problems, ..Reviews::default() };
        for (pair, stored) in stored {
            if let Some(state) = Review::from_stored(&stored.review).filter(|state| *state != Review::Todo) {
                reviews.states.insert(pair.clone(), state);
            }
            let text = note(&stored.note);
            if !text.is_empty() {
                reviews.notes.insert(pair, text);
            }
        }
        reviews
    }

    /// The pairs and fingers that have a mask drawn by hand.
    pub fn masks(&self) -> Vec<(String, PadId)> {
        (*self.store).as_ref().map_or_else(|_| Vec::new(), MaskStore::masks)
    }

    /// Who drew the masks of a pair that are on the disk.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn persons(&self, name: &str) -> Result<BTreeSet<String>, TaskError> {
        let what = format!("Labels of {name}");
        let store = self.store(&what)?;
        let fail = |err: StoreError| store_error(&what, &err);
        let mut persons = BTreeSet::new();
        for pad in store.rig().pads() {
            persons.extend(store.load(name, pad).map_err(fail)?.map(|stored| stored.person));
            persons.extend(store.load_predicted(name, pad).map_err(fail)?.into_iter().map(|(_, stored)| stored.person));
        }
        Ok(persons)
    }

    /// Reads the labels of a pair; empty if there are none.
    ///
    /// # Errors
    /// If there are some and they cannot be read: then they must not be written either.
    pub fn load(&self, name: &str) -> Result<PairLabels, TaskError> {
        let what = format!("Labels of {name}");
        // Without a place for labels there are none; saving says why.
        let Ok(store) = &*self.store else { return Ok(PairLabels::default()) };
        let fail = |err: StoreError| store_error(&what, &err);
        let mut labels = PairLabels::default();
        for pad in store.rig().pads() {
            if let Some(stored) = store.load(name, pad).map_err(fail)? {
                labels.masks.insert(MaskPlace::measured(pad), hand_of(stored));
            }
            for (of, stored) in store.load_predicted(name, pad).map_err(fail)? {
                labels.masks.insert(MaskPlace { pad, of: ImprintOf::Predicted(of.into()) }, hand_of(stored));
            }
        }
        if let Some(stored) = store.load_review(name).map_err(fail)? {
            labels.review = Review::from_stored(&stored.review).ok_or_else(|| {
                TaskError::new(&what, format!("the review state \"{}\" is not known", stored.review))
                    .with_hint("It may come from a newer version of this program.")
            })?;
            labels.accepted = stored.accepted;
            labels.note = note(&stored.note);
        }
        lock(&self.saved).insert(name.to_owned(), labels.clone());
        Ok(labels)
    }

    /// The mask that lies on the disk in a place now.
    fn there(&self, store: &MaskStore, name: &str, place: &MaskPlace) -> Result<Option<HandMask>, StoreError> {
        let stored = match &place.of {
            ImprintOf::Measured => store.load(name, place.pad)?,
            ImprintOf::Predicted(of) => {
                store.load_predicted(name, place.pad)?.into_iter().find(|(other, _)| **other == **of).map(|(_, m)| m)
            }
        };
        Ok(stored.map(hand_of))
    }

    /// What was done to the labels of a pair before they were read, and what was taken back of it, the oldest first; as
    /// far as the journal tells and it leads to `labels`.
    pub fn past(&self, name: &str, labels: &PairLabels) -> (Vec<Past>, Vec<Past>) {
        let Ok(store) = &*self.store else { return Default::default() };
        // Without a journal there is nothing to take back, and that is all.
        let bytes = store.journal(name).unwrap_or_default();
        journal::fold(bytes.split(|&b| b == b'\n'), labels, store.rig())
    }

    /// Writes the labels of a pair, so that a kill at any moment leaves the old or the new ones, and says in the pair's
    /// journal what was done. Where somebody else changed a mask since it was read here, both are kept, by pixel; then the
    /// labels as they are now are returned.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn save(&self, name: &str, labels: &PairLabels, deed: &Deed) -> Result<Option<PairLabels>, TaskError> {
        let what = format!("Save the labels of {name}");
        let store = self.store(&what)?;
        let fail = |err: StoreError| store_error(&what, &err);
        let before = lock(&self.saved).get(name).cloned().unwrap_or_default();
        let mut change = Change::between(&before, labels);
        let person = deed.person.clone().or_else(masks::person).unwrap_or_default();
        // Held until all is written: two windows that save at once come one after the other.
        let _held = (before != *labels).then(|| store.hold());
        let mut merged = labels.clone();
        for (place, [old, new]) in &mut change.masks {
            let there = self.there(store, name, place).map_err(fail)?;
            if !journal::same(there.as_ref(), old.as_ref()) {
                *new = match (&*new, &there) {
                    (Some(ours), Some(theirs)) => Some(ours.merged(old.as_ref(), theirs)),
                    (ours, theirs) => ours.clone().or_else(|| theirs.clone()),
                };
                *old = there;
                merged.put(place, new.clone());
            }
            let stored = new.as_ref().map(|hand| StoredMask {
                mask: (*hand.mask).clone(),
                marks: (*hand.marks).clone(),
                person: person.clone(),
                saved_unix_s: masks::now_unix_s(),
            });
            match &place.of {
                ImprintOf::Measured => store.save(name, place.pad, stored.as_ref()),
                ImprintOf::Predicted(of) => store.save_predicted(name, place.pad, of, stored.as_ref()),
            }
            .map_err(fail)?;
        }
        if before.review != labels.review || before.accepted != labels.accepted || before.note != labels.note {
            let (review, accepted) = (labels.review.stored().into(), labels.accepted);
            let review = StoredReview { review, accepted, note: labels.note.clone() };
            store.save_review(name, &review).map_err(fail)?;
        }
        lock(&self.saved).insert(name.to_owned(), labels.clone());
        if !change.is_empty() {
            let line = journal::Line::new(deed, &change, store.rig(), person, masks::now_unix_s());
            store.append_journal(name, &line).map_err(fail)?;
        }
        Ok((!Change::between(labels, &merged).is_empty()).then_some(merged))
    }
}
