//! Undo: reversible changes of the document, one entry per gesture, within a budget of bytes.

use std::borrow::Cow;

use super::super::keys::Revision;
use super::labels::{Document, DrawnMask, MaskPlace, Review};
use touch2touch_core::label::PackedMask;
use touch2touch_core::manual::AcceptedPose;
use touch2touch_pipeline::labels::{Change, ImprintOf, Past};

/// A corrected mask in few bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct KeptMask {
    packed: PackedMask,
    /// `None`: of an earlier run, so that it gets a new one.
    revision: Option<Revision>,
}

impl KeptMask {
    /// One of this run.
    pub fn of(hand: &DrawnMask) -> Self {
        Self { packed: hand.pack(), revision: Some(hand.revision) }
    }

    fn unpack(&self, doc: &mut Document) -> Option<DrawnMask> {
        let revision = self.revision.unwrap_or_else(|| doc.next_revision());
        // It was packed from a mask, so that it can be read; where it cannot, nothing is put in its place.
        DrawnMask::unpack(&self.packed, revision).ok()
    }
}

/// One reversible change of the document.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Replaces a corrected mask; `None` = the automatic source is in force.
    Mask {
        /// The place of the mask.
        place: MaskPlace,
        /// The mask.
        mask: Option<KeptMask>,
    },
    /// Replaces the review state.
    Review {
        /// The state.
        review: Review,
    },
    /// Replaces the note.
    Note {
        /// The text.
        note: String,
    },
    /// Replaces the accepted pose.
    Pose {
        /// The imprint it was made from.
        of: ImprintOf,
        /// `grasp_from_object`.
        pose: Option<AcceptedPose>,
    },
}

impl Edit {
    /// Exchanges the value held here with the one in `doc`; afterwards `self` is the inverse edit.
    fn swap(&mut self, doc: &mut Document, pair: &str) {
        match self {
            Self::Mask { place, mask } => {
                let new = mask.take().and_then(|kept| kept.unpack(doc));
                let labels = doc.labels.entry(pair.to_owned()).or_default();
                *mask = labels.put(place, new).as_ref().map(KeptMask::of);
            }
            Self::Review { review } => *review = doc.set_review(pair, *review),
            Self::Note { note } => *note = doc.set_note(pair, std::mem::take(note)),
            Self::Pose { of, pose } => {
                let labels = doc.labels.entry(pair.to_owned()).or_default();
                *pose = labels.accept(of, pose.take());
            }
        }
    }

    /// The place of the mask, if it concerns one.
    pub fn place(&self) -> Option<&MaskPlace> {
        match self {
            Self::Mask { place, .. } => Some(place),
            Self::Review { .. } | Self::Note { .. } | Self::Pose { .. } => None,
        }
    }

    fn bytes(&self) -> usize {
        std::mem::size_of::<Self>()
            + match self {
                Self::Mask { mask, .. } => mask.as_ref().map_or(0, |kept| kept.packed.bytes()),
                Self::Note { note, .. } => note.len(),
                Self::Review { .. } | Self::Pose { .. } => 0,
            }
    }
}

/// The changes of one gesture.
#[derive(Clone, Debug, PartialEq)]
pub struct Gesture {
    /// The pair's name.
    pub pair: String,
    /// The name of what it did, e.g. `brush stroke`: shown when it is undone.
    pub name: Cow<'static, str>,
    /// The changes in the order they were made.
    pub edits: Vec<Edit>,
}

impl Gesture {
    /// The gesture that makes a change of the labels of `pair`. Masks get the revision; without one, of an earlier run,
    /// each a new one.
    pub(in crate::app) fn forth(
        pair: &str,
        name: Cow<'static, str>,
        change: &Change,
        revision: Option<Revision>,
    ) -> Self {
        let mut edits = Vec::new();
        for (place, [_, after]) in &change.masks {
            let mask = after.as_ref().map(|hand| KeptMask { packed: hand.pack(), revision });
            edits.push(Edit::Mask { place: place.clone(), mask });
        }
        edits.extend(change.review.map(|[_, after]| Edit::Review { review: after }));
        edits.extend(change.note.as_ref().map(|[_, after]| Edit::Note { note: after.clone() }));
        for (of, [_, after]) in &change.accepted {
            edits.push(Edit::Pose { of: of.clone(), pose: *after });
        }
        Self { pair: pair.to_owned(), name, edits }
    }

    /// True where everything it changes is on screen.
    fn is_on_screen(&self, pair: &str, shown: &[MaskPlace]) -> bool {
        self.pair == pair && self.edits.iter().all(|e| e.place().is_none_or(|place| shown.contains(place)))
    }

    /// True where undoing one before the other would matter.
    fn overlaps(&self, other: &Gesture) -> bool {
        let same = |a: &Edit, b: &Edit| {
            a.place() == b.place() && (a.place().is_some() || std::mem::discriminant(a) == std::mem::discriminant(b))
        };
        self.pair == other.pair && self.edits.iter().any(|a| other.edits.iter().any(|b| same(a, b)))
    }

    fn bytes(&self) -> usize {
        self.edits.iter().map(Edit::bytes).sum()
    }
}

/// Gestures done and undone.
///
/// Undo takes the last gesture whose every change is on screen, so it never touches a pair, a finger or a prediction that
/// is not;
/// a gesture that others were made on top of waits for these to be undone first.
#[derive(Clone, Debug)]
pub struct History {
    done: Vec<Gesture>,
    undone: Vec<Gesture>,
    budget: usize,
}

impl Default for History {
    fn default() -> Self {
        // A usual mask of 175 x 140 takes one to three kilobytes, the most ragged one 150.
        Self::new(64 << 20)
    }
}

impl History {
    /// An empty history of at most `budget` bytes.
    pub fn new(budget: usize) -> Self {
        Self { done: Vec::new(), undone: Vec::new(), budget }
    }

    /// Records a gesture that was just made. What it makes impossible to redo is forgotten.
    pub fn record(&mut self, gesture: Gesture) {
        if gesture.edits.is_empty() {
            return;
        }
        self.undone.retain(|other| !other.overlaps(&gesture));
        self.done.push(gesture);
        self.keep_budget();
    }

    /// Does what a gesture says, and records it.
    pub(in crate::app) fn make(&mut self, doc: &mut Document, mut gesture: Gesture) {
        gesture.edits.iter_mut().for_each(|edit| edit.swap(doc, &gesture.pair));
        self.record(gesture);
    }

    /// Takes in what was done to a pair, and taken back, before its labels were read.
    pub(crate) fn restore(&mut self, pair: &str, done: &[Past], undone: &[Past]) {
        if self.done.iter().chain(&self.undone).any(|gesture| gesture.pair == pair) {
            return;
        }
        let forth = |past: &Past| Gesture::forth(pair, past.name.clone(), &past.change, None);
        let back = |past: &Past| Gesture::forth(pair, past.name.clone(), &past.change.clone().inverse(), None);
        // Older than what was done in this run: the first to go where the budget ends.
        self.done.splice(0..0, done.iter().map(back));
        self.undone.splice(0..0, undone.iter().map(forth));
        self.keep_budget();
    }

    fn keep_budget(&mut self) {
        let mut bytes: usize = self.done.iter().chain(&self.undone).map(Gesture::bytes).sum();
        while bytes > self.budget && self.done.len() > 1 {
            bytes -= self.done.remove(0).bytes();
        }
    }

    /// Takes back the last gesture on screen. Returns what it did.
    pub fn undo(&mut self, doc: &mut Document, pair: &str, shown: &[MaskPlace]) -> Option<&Gesture> {
        Self::travel([&mut self.done, &mut self.undone], doc, pair, shown)
    }

    /// Does the last gesture taken back on screen again. Returns what it did.
    pub fn redo(&mut self, doc: &mut Document, pair: &str, shown: &[MaskPlace]) -> Option<&Gesture> {
        Self::travel([&mut self.undone, &mut self.done], doc, pair, shown)
    }

    /// Takes the last gesture on screen from one list to the other; the last change of it goes first.
    fn travel<'a>(
        [from, to]: [&'a mut Vec<Gesture>; 2],
        doc: &mut Document,
        pair: &str,
        shown: &[MaskPlace],
    ) -> Option<&'a Gesture> {
        let mut gesture = from.remove(Self::position(from, pair, shown)?);
        gesture.edits.reverse();
        gesture.edits.iter_mut().for_each(|edit| edit.swap(doc, &gesture.pair));
        to.push(gesture);
        to.last()
    }

    /// The gestures that can be taken back, the oldest first.
    pub fn done(&self) -> &[Gesture] {
        &self.done
    }

    /// The name of what undo would take back.
    pub fn next_undo(&self, pair: &str, shown: &[MaskPlace]) -> Option<&Gesture> {
        Self::position(&self.done, pair, shown).map(|at| &self.done[at])
    }

    /// The name of what redo would do.
    pub(crate) fn next_redo(&self, pair: &str, shown: &[MaskPlace]) -> Option<&Gesture> {
        Self::position(&self.undone, pair, shown).map(|at| &self.undone[at])
    }

    /// Forgets what was done to a pair: it is shown as another one from now on.
    pub fn forget(&mut self, pair: &str) {
        self.done.retain(|gesture| gesture.pair != pair);
        self.undone.retain(|gesture| gesture.pair != pair);
    }

    /// Forgets everything: another data set is open.
    pub fn clear(&mut self) {
        self.done.clear();
        self.undone.clear();
    }

    fn position(stack: &[Gesture], pair: &str, shown: &[MaskPlace]) -> Option<usize> {
        (0..stack.len()).rev().find(|&at| {
            stack[at].is_on_screen(pair, shown) && !stack[at + 1..].iter().any(|later| later.overlaps(&stack[at]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::grid::Mask;
    use touch2touch_core::label::Provenance;
    use touch2touch_core::rig::{PadId, lab};
    use touch2touch_pipeline::io::predicted_id::PredictedId;
    use touch2touch_pipeline::labels::ImprintOf;

    fn hand(doc: &mut Document, pair: &str, finger: PadId) -> DrawnMask {
        let hand = DrawnMask::new(Mask::filled(8, 4, false), Provenance::Nothing);
        doc.labels.entry(pair.into()).or_default().put(&MaskPlace::measured(finger), Some(hand.clone()));
        hand
    }

    /// The edit that makes 2 x 2 pixels from `(x, 1)` on the contact.
    fn edit(doc: &mut Document, finger: PadId, x: usize) -> Edit {
        let full = Mask::from_fn(8, 4, |px, py| (x..x + 2).contains(&px) && (1..3).contains(&py));
        let hand = DrawnMask { revision: doc.next_revision(), ..DrawnMask::new(full, Provenance::Nothing) };
        Edit::Mask { place: MaskPlace::measured(finger), mask: Some(KeptMask::of(&hand)) }
    }

    fn paint(doc: &mut Document, history: &mut History, pair: &str, finger: PadId, x: usize) {
        let edits = vec![edit(doc, finger, x)];
        history.make(doc, Gesture { pair: pair.into(), name: "stroke".into(), edits });
    }

    #[test]
    fn swapping_twice_changes_nothing() {
        let mut doc = Document::default();
        let place = MaskPlace::measured(lab::RIGHT);
        let before = hand(&mut doc, "a", lab::RIGHT);
        let mut edit = edit(&mut doc, lab::RIGHT, 6);
        let copy = edit.clone();
        edit.swap(&mut doc, "a");
        let there = doc.drawn_mask("a", &place).unwrap();
        assert!(there.mask[(7, 2)] && there.revision > before.revision);
        edit.swap(&mut doc, "a");
        assert_eq!(doc.drawn_mask("a", &place), Some(&before), "with its revision: results of it are still good");
        assert_eq!(edit, copy);
        // A mask of an earlier run gets a revision that nothing has.
        let mut edit =
            Edit::Mask { place: place.clone(), mask: Some(KeptMask { revision: None, ..KeptMask::of(&before) }) };
        edit.swap(&mut doc, "a");
        assert_eq!(doc.drawn_mask("a", &place).unwrap().revision.0, doc.last_revision);
    }

    #[test]
    fn undo_stays_on_screen() {
        let mut doc = Document::default();
        let mut history = History::default();
        for (pair, finger) in [("a", lab::RIGHT), ("a", lab::LEFT), ("b", lab::RIGHT)] {
            hand(&mut doc, pair, finger);
            paint(&mut doc, &mut history, pair, finger, 0);
        }
        assert!(history.undo(&mut doc, "c", &lab::PADS.map(MaskPlace::measured)).is_none());
        assert!(history.undo(&mut doc, "a", &[MaskPlace::measured(lab::RIGHT)]).is_some());
        assert!(history.undo(&mut doc, "a", &[MaskPlace::measured(lab::RIGHT)]).is_none());
        assert!(!doc.drawn_mask("a", &MaskPlace::measured(lab::RIGHT)).unwrap().mask[(0, 1)]);
        assert!(doc.drawn_mask("a", &MaskPlace::measured(lab::LEFT)).unwrap().mask[(0, 1)]);
        assert!(doc.drawn_mask("b", &MaskPlace::measured(lab::RIGHT)).unwrap().mask[(0, 1)]);
        // A prediction that is not on screen is not touched either.
        let predicted =
            MaskPlace { pad: lab::RIGHT, of: ImprintOf::Predicted(PredictedId::from("a prediction".to_owned())) };
        let mut edit = Edit::Mask { place: predicted.clone(), mask: None };
        edit.swap(&mut doc, "a");
        history.record(Gesture { pair: "a".into(), name: "stroke".into(), edits: vec![edit] });
        assert!(history.next_undo("a", &[MaskPlace::measured(lab::RIGHT)]).is_none());
        assert!(history.undo(&mut doc, "a", &[predicted]).is_some());
        // A new stroke on the other finger does not take the redo of this one away; one on this finger does.
        paint(&mut doc, &mut history, "a", lab::LEFT, 4);
        assert!(history.next_redo("a", &[MaskPlace::measured(lab::RIGHT)]).is_some());
        paint(&mut doc, &mut history, "a", lab::RIGHT, 4);
        assert!(history.next_redo("a", &[MaskPlace::measured(lab::RIGHT)]).is_none());
    }

    #[test]
    fn the_budget_drops_the_oldest() {
        let mut doc = Document::default();
        hand(&mut doc, "a", lab::RIGHT);
        let one = edit(&mut doc, lab::RIGHT, 2).bytes();
        let mut history = History::new(3 * one + one / 2);
        for x in 0..6 {
            paint(&mut doc, &mut history, "a", lab::RIGHT, x);
        }
        let mut undone = 0;
        while history.undo(&mut doc, "a", &lab::PADS.map(MaskPlace::measured)).is_some() {
            undone += 1;
        }
        assert_eq!(undone, 3);
    }
}
