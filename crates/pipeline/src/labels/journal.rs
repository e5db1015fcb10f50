//! The journal of a pair's labels: who did what and when, with what it was before and after. Undo begins where it ended,
//! also when the program was closed or killed in between.

use super::accepted::{by_imprint, of_imprints};
use crate::io::masks::ByImprint;
use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{DrawnMask, ImprintOf, MaskPlace, PairLabels, Review, Revision};
use crate::error::TaskError;
use touch2touch_core::label::PackedMask;
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::rig::Rig;

/// Kind of an act that changed the labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Act {
    /// Something new.
    #[default]
    Do,
    /// An act is taken back.
    Undo,
    /// An act that was taken back is done again.
    Redo,
}

/// Act for the journal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Operation {
    /// Kind of the act.
    pub act: Act,
    /// Name of the act, e.g. `lasso`.
    pub name: Cow<'static, str>,
    /// The tool with its numbers, where there is one.
    pub how: Option<serde_json::Value>,
    /// Who did it; `None`: whom the system says.
    pub person: Option<String>,
}

impl Operation {
    /// Something new without numbers.
    pub fn named(name: impl Into<Cow<'static, str>>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }
}

/// Difference between labels before and after an act; each pair is `[before, after]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Change {
    /// Masks.
    pub masks: BTreeMap<MaskPlace, [Option<DrawnMask>; 2]>,
    /// The review state.
    pub review: Option<[Review; 2]>,
    /// Accepted poses.
    pub accepted: BTreeMap<ImprintOf, [Option<AcceptedPose>; 2]>,
    /// The note.
    pub note: Option<[String; 2]>,
}

/// True for the same pixels from the same source; the revision is of one run of the program.
pub(super) fn same(a: Option<&DrawnMask>, b: Option<&DrawnMask>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => a.is_same(b),
        _ => false,
    }
}

impl Change {
    /// From labels to others.
    pub fn between(before: &PairLabels, after: &PairLabels) -> Self {
        let mut change = Self::default();
        for place in before.masks.keys().chain(after.masks.keys()) {
            let pair = [before.masks.get(place), after.masks.get(place)];
            if !same(pair[0], pair[1]) {
                let plain = |hand: &DrawnMask| DrawnMask { revision: Revision::default(), ..hand.clone() };
                change.masks.insert(place.clone(), pair.map(|hand| hand.map(plain)));
            }
        }
        change.review = (before.review != after.review).then_some([before.review, after.review]);
        for of in before.accepted.keys().chain(after.accepted.keys()) {
            let pair = [before.accepted.get(of).copied(), after.accepted.get(of).copied()];
            if pair[0] != pair[1] {
                change.accepted.insert(of.clone(), pair);
            }
        }
        change.note = (before.note != after.note).then(|| [before.note.clone(), after.note.clone()]);
        change
    }

    /// True where nothing differs.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Makes labels what they are after it.
    pub fn apply_to(&self, labels: &mut PairLabels) {
        for (place, [_, after]) in &self.masks {
            labels.put(place, after.clone());
        }
        if let Some([_, after]) = self.review {
            labels.review = after;
        }
        if let Some([_, after]) = &self.note {
            labels.note.clone_from(after);
        }
        for (of, [_, after]) in &self.accepted {
            labels.accept(of, *after);
        }
    }

    /// The way back.
    #[must_use]
    pub fn inverse(mut self) -> Self {
        self.masks.values_mut().for_each(|pair| pair.reverse());
        self.review.iter_mut().for_each(|pair| pair.reverse());
        self.accepted.values_mut().for_each(|pair| pair.reverse());
        self.note.iter_mut().for_each(|pair| pair.reverse());
        self
    }

    /// True where the order of the two changes matters.
    fn overlaps(&self, other: &Self) -> bool {
        self.masks.keys().any(|place| other.masks.contains_key(place))
            || self.review.is_some() && other.review.is_some()
            || self.note.is_some() && other.note.is_some()
            || self.accepted.keys().any(|of| other.accepted.contains_key(of))
    }

    /// True where it ended in these labels.
    fn leads_to(&self, labels: &PairLabels) -> bool {
        self.masks.iter().all(|(place, [_, after])| same(after.as_ref(), labels.masks.get(place)))
            && self.review.is_none_or(|[_, after]| after == labels.review)
            && self.note.as_ref().is_none_or(|[_, after]| *after == labels.note)
            && self.accepted.iter().all(|(of, [_, after])| *after == labels.accepted.get(of).copied())
    }
}

/// Something that was done before the labels were read.
#[derive(Clone, Debug, PartialEq)]
pub struct Past {
    /// Name of the act.
    pub name: Cow<'static, str>,
    /// Difference that it made.
    pub change: Change,
}

/// History of a pair, as its journal tells it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JournalHistory {
    /// Acts that can be taken back, the oldest first.
    pub done: Vec<Past>,
    /// Acts that were taken back and can be done again, the oldest first.
    pub undone: Vec<Past>,
    /// Fault of the journal: lines of it that cannot be read.
    pub problem: Option<TaskError>,
}

/// A mask that changed.
#[derive(Serialize, Deserialize)]
struct MaskLine {
    finger: String,
    of: ImprintOf,
    before: Option<PackedMask>,
    after: Option<PackedMask>,
}

/// A line of the journal.
#[derive(Serialize, Deserialize)]
pub(super) struct Line {
    unix_s: u64,
    person: String,
    act: Act,
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    how: Option<serde_json::Value>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    masks: Vec<MaskLine>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    review: Option<[Review; 2]>,
    #[serde(flatten)]
    accepted: ByImprint<[Option<AcceptedPose>; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    note: Option<[String; 2]>,
}

impl Line {
    pub(super) fn new(deed: &Operation, change: &Change, rig: &Rig, person: String, unix_s: u64) -> Self {
        let mask = |(place, [before, after]): (&MaskPlace, &[Option<DrawnMask>; 2])| MaskLine {
            finger: rig.pad_key(place.pad).into_owned(),
            of: place.of.clone(),
            before: before.as_ref().map(DrawnMask::pack),
            after: after.as_ref().map(DrawnMask::pack),
        };
        Self {
            unix_s,
            person,
            act: deed.act,
            name: deed.name.clone().into_owned(),
            how: deed.how.clone(),
            masks: change.masks.iter().map(mask).collect(),
            review: change.review,
            accepted: by_imprint(&change.accepted),
            note: change.note.clone(),
        }
    }

    /// Who did it.
    pub(super) fn person(&self) -> Option<String> {
        Some(self.person.clone()).filter(|person| !person.is_empty())
    }

    /// Act of the line; `None` if a mask in it cannot be understood.
    pub(super) fn read(self, rig: &Rig) -> Option<(Act, Past)> {
        let mut masks = BTreeMap::new();
        for line in self.masks {
            let pad = rig.pads().find(|pad| rig.pad_key(*pad) == line.finger)?;
            let mut pair = [None, None];
            for (hand, pixels) in pair.iter_mut().zip([line.before, line.after]) {
                *hand = pixels.map(|pixels| DrawnMask::unpack(&pixels, Revision::default())).transpose().ok()?;
            }
            masks.insert(MaskPlace { pad, of: line.of }, pair);
        }
        let change = Change { masks, review: self.review, accepted: of_imprints(self.accepted), note: self.note };
        Some((self.act, Past { name: self.name.into(), change }))
    }
}

/// Number of a journal's lines, and of those that cannot be understood.
pub(super) fn count(bytes: &[u8]) -> [usize; 2] {
    let lines = || bytes.split(|&b| b == b'\n').filter(|line| !line.trim_ascii().is_empty());
    [lines().count(), lines().filter(|line| serde_json::from_slice::<Line>(line).is_err()).count()]
}

/// Acts that can be taken back and acts that can be done again, the oldest first, of the lines of a journal.
///
/// Only as far as it leads to the labels as they are: where another program changed them, what came before is history,
/// and nothing that can be undone.
pub(super) fn fold<'a>(lines: impl Iterator<Item = &'a [u8]>, labels: &PairLabels, rig: &Rig) -> JournalHistory {
    let (mut done, mut undone): (Vec<Past>, Vec<Past>) = (Vec::new(), Vec::new());
    for line in lines {
        let Some((act, past)) = serde_json::from_slice::<Line>(line).ok().and_then(|line| line.read(rig)) else {
            continue;
        };
        let (from, to) = match act {
            Act::Do => {
                undone.retain(|other| !other.change.overlaps(&past.change));
                done.push(past);
                continue;
            }
            Act::Undo => (&mut done, &mut undone),
            Act::Redo => (&mut undone, &mut done),
        };
        let meant = if act == Act::Undo { past.change.clone().inverse() } else { past.change.clone() };
        match from.iter().rposition(|other| other.change == meant) {
            Some(at) => to.push(from.remove(at)),
            // Several acts in one line: the way on from here is not known.
            None => from.retain(|other| !other.change.overlaps(&past.change)),
        }
    }
    // From the last one back: each must begin where the one before it ended. `made` has the change that was made last: of what
    // was undone, the inverse.
    let keep_fitting = |pasts: &mut Vec<Past>, made: fn(Change) -> Change| {
        let mut now = labels.clone();
        let kept = pasts.iter().rev().take_while(|past| {
            let change = made(past.change.clone());
            let fits = change.leads_to(&now);
            if fits {
                change.inverse().apply_to(&mut now);
            }
            fits
        });
        let first = pasts.len() - kept.count();
        pasts.drain(..first);
    };
    keep_fitting(&mut done, |change| change);
    keep_fitting(&mut undone, Change::inverse);
    JournalHistory { done, undone, problem: None }
}
