//! [`PadId`] and [`PerPad`]: a pad's place in its rig, and one value per pad.

use std::hash::{Hash, Hasher};
use std::ops::{Index, IndexMut};

use serde::{Deserialize, Serialize};

/// The position of a pad in its rig; the rig knows its name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PadId(u8);

impl PadId {
    /// The pad at a position; positions over 255 are the last.
    pub const fn new(index: usize) -> Self {
        Self(if index > 255 { 255 } else { index as u8 })
    }

    /// The position.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A value for each pad that has one. Pads behind the last value have none: how long the list is means nothing.
#[derive(Clone, Debug, Serialize)]
#[serde(transparent)]
pub struct PerPad<T>(Vec<Option<T>>);

impl<T> PerPad<T> {
    /// The pad's value.
    pub fn get(&self, pad: PadId) -> Option<&T> {
        self.0.get(pad.index())?.as_ref()
    }

    /// The pad's value, to be changed.
    pub fn get_mut(&mut self, pad: PadId) -> Option<&mut T> {
        self.0.get_mut(pad.index())?.as_mut()
    }

    /// The values in the order of the pads, `None` for pads without one.
    pub fn iter(&self) -> std::slice::Iter<'_, Option<T>> {
        self.0.iter()
    }

    /// As [`PerPad::iter`], to be changed.
    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, Option<T>> {
        self.0.iter_mut()
    }

    /// The values with their pads.
    pub fn entries(&self) -> impl Iterator<Item = (PadId, &T)> {
        self.0.iter().enumerate().filter_map(|(index, value)| Some((PadId::new(index), value.as_ref()?)))
    }

    /// True where no pad has a value.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(Option::is_none)
    }

    /// References to the values.
    pub fn as_ref(&self) -> PerPad<&T> {
        PerPad(self.0.iter().map(Option::as_ref).collect())
    }

    /// Each place changed by `f`, which also sees the places without a value.
    pub fn map<U>(self, f: impl FnMut(Option<T>) -> Option<U>) -> PerPad<U> {
        PerPad(self.0.into_iter().map(f).collect())
    }

    fn values(&self) -> &[Option<T>] {
        let count = self.0.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        &self.0[..count]
    }
}

impl<T> Default for PerPad<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: PartialEq> PartialEq for PerPad<T> {
    fn eq(&self, other: &Self) -> bool {
        self.values() == other.values()
    }
}

impl<T: Eq> Eq for PerPad<T> {}

impl<T: PartialOrd> PartialOrd for PerPad<T> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        self.values().partial_cmp(other.values())
    }
}

impl<T: Ord> Ord for PerPad<T> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.values().cmp(other.values())
    }
}

impl<T: Hash> Hash for PerPad<T> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.values().hash(state);
    }
}

impl<T> Index<PadId> for PerPad<T> {
    type Output = Option<T>;

    fn index(&self, pad: PadId) -> &Option<T> {
        self.0.get(pad.index()).unwrap_or(&None)
    }
}

impl<T> IndexMut<PadId> for PerPad<T> {
    fn index_mut(&mut self, pad: PadId) -> &mut Option<T> {
        if self.0.len() <= pad.index() {
            self.0.resize_with(pad.index() + 1, || None);
        }
        &mut self.0[pad.index()]
    }
}

impl<T, const N: usize> From<[Option<T>; N]> for PerPad<T> {
    fn from(values: [Option<T>; N]) -> Self {
        Self(values.into())
    }
}

impl<T> FromIterator<Option<T>> for PerPad<T> {
    fn from_iter<I: IntoIterator<Item = Option<T>>>(values: I) -> Self {
        Self(values.into_iter().collect())
    }
}

impl<T> IntoIterator for PerPad<T> {
    type Item = Option<T>;
    type IntoIter = std::vec::IntoIter<Option<T>>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

impl<'a, T> IntoIterator for &'a PerPad<T> {
    type Item = &'a Option<T>;
    type IntoIter = std::slice::Iter<'a, Option<T>>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}
