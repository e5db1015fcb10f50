//! [`Labels`]: the labels of a data set as they lie on the disk.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Arc, Mutex};

use super::accepted::{by_imprint, of_imprints};
use super::{
    Change, DrawnMask, ImprintOf, JournalHistory, MaskPlace, Operation, PairLabels, Review, Reviews, Revision, journal,
    note,
};
use crate::error::{TaskError, TaskErrorKind};
use crate::io::catch_panic::lock;
use crate::io::dataset::Dataset;
use crate::io::error::{FileError, FileErrorKind};
use crate::io::masks::{self, MaskStore, StoredMask, StoredReview};
use touch2touch_core::rig::PadId;
use touch2touch_core::units::counted;

/// The labels of an open data set. Clones share what they know.
#[derive(Clone, Debug)]
pub struct Labels {
    store: Arc<Result<MaskStore, FileError>>,
    /// Labels that whoever saves here holds, as far as they were read or given here: only differences are written, over
    /// what somebody else may have written meanwhile.
    saved: Arc<Mutex<BTreeMap<String, PairLabels>>>,
}

fn hand_of(stored: StoredMask) -> DrawnMask {
    DrawnMask { mask: Arc::new(stored.mask), marks: Arc::new(stored.marks), revision: Revision::default() }
}

pub(super) fn store_error(what: &str, err: &FileError) -> TaskError {
    let kind = if err.kind == FileErrorKind::Lost { TaskErrorKind::Lost } else { TaskErrorKind::Failed };
    TaskError { kind, ..TaskError::from_error(what, err).with_hint(err.hint) }
}

impl Labels {
    /// Labels of a data set; where there is no place for labels, there are none, and saving says why.
    pub fn of(dataset: &Dataset) -> Self {
        Self { store: Arc::new(MaskStore::for_dataset(dataset)), saved: Arc::default() }
    }

    /// Labels of a data set that grew: what was written since the opening stays known.
    #[must_use]
    pub fn continued(&self, dataset: &Dataset) -> Self {
        Self { store: Arc::new(MaskStore::for_dataset(dataset)), saved: self.saved.clone() }
    }

    /// The folder they lie in.
    ///
    /// # Errors
    /// If there is no place for labels.
    pub fn folder(&self) -> Result<&Path, TaskError> {
        Ok(self.store("Labels")?.folder())
    }

    pub(crate) fn store(&self, what: &str) -> Result<&MaskStore, TaskError> {
        (*self.store).as_ref().map_err(|err| store_error(what, err))
    }

    /// Review states and notes of all pairs.
    pub fn reviews(&self) -> Reviews {
        let store = match &*self.store {
            Ok(store) => store,
            Err(err) => {
                return Reviews { problems: vec![err.to_problem()], ..Reviews::default() };
            }
        };
        let (stored, problems) = store.reviews();
        let mut reviews = Reviews { problems, ..Reviews::default() };
        for (pair, stored) in stored {
            if let Some(state) = stored.review.parse::<Review>().ok().filter(|state| *state != Review::Todo) {
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
        let fail = |err: FileError| store_error(&what, &err);
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
        let fail = |err: FileError| store_error(&what, &err);
        let mut labels = PairLabels::default();
        for pad in store.rig().pads() {
            if let Some(stored) = store.load(name, pad).map_err(fail)? {
                labels.masks.insert(MaskPlace::measured(pad), hand_of(stored));
            }
            for (of, stored) in store.load_predicted(name, pad).map_err(fail)? {
                labels.masks.insert(MaskPlace { pad, of: ImprintOf::Predicted(of) }, hand_of(stored));
            }
        }
        if let Some(stored) = store.load_review(name).map_err(fail)? {
            labels.review = stored.review.parse::<Review>().map_err(|_| {
                TaskError::new(&what, format!("the review state \"{}\" is not known", stored.review))
                    .with_hint("It may come from a newer version of this program.")
            })?;
            labels.accepted = of_imprints(stored.accepted);
            labels.note = note(&stored.note);
        }
        lock(&self.saved).insert(name.to_owned(), labels.clone());
        Ok(labels)
    }

    /// The mask that lies on the disk in a place now.
    fn there(&self, store: &MaskStore, name: &str, place: &MaskPlace) -> Result<Option<DrawnMask>, FileError> {
        let stored = match &place.of {
            ImprintOf::Measured => store.load(name, place.pad)?,
            ImprintOf::Predicted(of) => {
                store.load_predicted(name, place.pad)?.into_iter().find(|(other, _)| other == of).map(|(_, m)| m)
            }
        };
        Ok(stored.map(hand_of))
    }

    /// Acts that changed the labels of a pair before they were read, and those that were taken back; as far as the
    /// journal tells and it leads to `labels`.
    pub fn past(&self, name: &str, labels: &PairLabels) -> JournalHistory {
        let Ok(store) = &*self.store else { return JournalHistory::default() };
        // Without a journal there is nothing to take back; that it cannot be read is all that is wrong then.
        let bytes = store.journal(name).unwrap_or_default();
        let past = journal::fold(bytes.split(|&b| b == b'\n'), labels, store.rig());
        JournalHistory { problem: self.journal_problem(name), ..past }
    }

    /// Fault of a pair's journal: it cannot be read, or lines of it cannot. Masks do not depend on it.
    pub fn journal_problem(&self, name: &str) -> Option<TaskError> {
        let Ok(store) = &*self.store else { return None };
        let what = format!("Journal of {name}");
        match store.journal(name) {
            Err(err) => Some(store_error(&what, &err)),
            Ok(bytes) => {
                let [lines, unread] = journal::count(&bytes);
                let file = store.journal_file(name);
                let why = format!("{unread} of {} cannot be understood ({})", counted(lines, "line"), file.display());
                let hint = "They were cut short, or are of something else: what they say was done cannot be taken back. \
                            The masks themselves are whole.";
                (unread > 0).then(|| TaskError::new(what, why).with_hint(hint))
            }
        }
    }

    /// Writes the labels of a pair, so that a kill at any moment leaves the old or the new ones, and says in the pair's
    /// journal what was done. Where somebody else changed a mask since it was read here, both are kept, by pixel; then the
    /// labels as they are now are returned.
    ///
    /// # Errors
    /// If they cannot be written; [`TaskErrorKind::Lost`] where the data set is not there any more.
    pub fn save(&self, name: &str, labels: &PairLabels, deed: &Operation) -> Result<Option<PairLabels>, TaskError> {
        let what = format!("Save the labels of {name}");
        let store = self.store(&what)?;
        let fail = |err: FileError| store_error(&what, &err);
        let before = self.known(name);
        let mut change = Change::between(&before, labels);
        let by = Signed::now(deed);
        // Held until all is written: two windows that save at once come one after the other.
        let _held = (before != *labels).then(|| store.hold()).transpose().map_err(fail)?;
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
            by.write_mask(store, name, place, new.as_ref()).map_err(fail)?;
        }
        if before.review != labels.review || before.accepted != labels.accepted || before.note != labels.note {
            store.save_review(name, &stored_review(labels)).map_err(fail)?;
        }
        lock(&self.saved).insert(name.to_owned(), labels.clone());
        if !change.is_empty() {
            let line = journal::Line::new(deed, &change, store.rig(), by.person, by.unix_s);
            store.append_journal(name, &line).map_err(|err| {
                let err = fail(err);
                let why =
                    format!("masks, review state and note are saved, the record of what was done is not: {}", err.why);
                TaskError { why, ..err }
            })?;
        }
        Ok((!Change::between(labels, &merged).is_empty()).then_some(merged))
    }

    /// The labels of a pair as they were read or written last.
    pub(super) fn known(&self, name: &str) -> PairLabels {
        lock(&self.saved).get(name).cloned().unwrap_or_default()
    }
}

/// Who writes, and when.
pub(super) struct Signed {
    pub(super) person: String,
    pub(super) unix_s: u64,
}

impl Signed {
    pub(super) fn now(deed: &Operation) -> Self {
        let person = deed.person.clone().or_else(masks::person).unwrap_or_default();
        Self { person, unix_s: masks::now_unix_s() }
    }

    /// Writes a mask to its place, or removes it there.
    pub(super) fn write_mask(
        &self,
        store: &MaskStore,
        name: &str,
        place: &MaskPlace,
        mask: Option<&DrawnMask>,
    ) -> Result<(), FileError> {
        let stored = mask.map(|hand| StoredMask {
            mask: (*hand.mask).clone(),
            marks: (*hand.marks).clone(),
            person: self.person.clone(),
            saved_unix_s: self.unix_s,
        });
        match &place.of {
            ImprintOf::Measured => store.save(name, place.pad, stored.as_ref()),
            ImprintOf::Predicted(of) => store.save_predicted(name, place.pad, of, stored.as_ref()),
        }
    }
}

pub(super) fn stored_review(labels: &PairLabels) -> StoredReview {
    let accepted = by_imprint(&labels.accepted);
    StoredReview { review: labels.review.stored().into(), accepted, note: labels.note.clone() }
}
