//! Records of the work on a pair, as its journal tells of it, apart from pixels.

use serde::Deserialize;

use super::{Act, Review};
use touch2touch_core::label::Provenance;

/// Something that was done to the labels of a pair.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Record {
    /// When, seconds since 1970 (UTC).
    pub unix_s: u64,
    /// Who.
    #[serde(default)]
    pub person: String,
    /// Kind of the act: new, taken back or done again.
    #[serde(default)]
    pub act: Act,
    /// Name of the act, e.g. `brush stroke`.
    #[serde(default)]
    pub name: String,
    /// The masks it changed.
    #[serde(default)]
    pub masks: Vec<MaskRecord>,
    /// The review state before and after, where that changed.
    #[serde(default)]
    pub review: Option<[Review; 2]>,
}

/// A mask that was changed.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct MaskRecord {
    /// The finger.
    #[serde(default)]
    pub finger: String,
    /// The imprint, as it is in the file.
    #[serde(default)]
    pub of: serde_json::Value,
    /// Base of the mask after the act; `None` where it was removed.
    #[serde(default)]
    pub after: Option<Base>,
}

/// Base that a mask is made from.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Base {
    /// In words, as older journals say it, e.g. `Threshold 5.00 mm`.
    #[serde(default)]
    base: String,
    /// Sources of its pixels, the one that the correction began from first.
    #[serde(default)]
    layers: Vec<Provenance>,
}

impl Base {
    /// Source that the correction began from.
    pub fn provenance(&self) -> Provenance {
        self.layers.first().cloned().unwrap_or_else(|| Provenance::told(self.base.as_str()))
    }
}

impl From<Provenance> for Base {
    fn from(base: Provenance) -> Self {
        Self { base: String::new(), layers: vec![base] }
    }
}

/// A longer time between two deeds is a pause, seconds: nobody worked on the pair then.
pub(crate) const PAUSE_S: u64 = 60;

/// The time that some deeds took, seconds: from each to the next, unless that was a pause.
pub(crate) fn working_seconds(records: &[Record]) -> u64 {
    // A clock that was set back is no time.
    let between = |pair: &[Record]| pair[1].unix_s.saturating_sub(pair[0].unix_s);
    records.windows(2).map(between).filter(|&s| s <= PAUSE_S).sum()
}

/// The lines of a journal that can be understood, in their order.
pub(super) fn parse(bytes: &[u8]) -> Vec<Record> {
    bytes.split(|&b| b == b'\n').filter_map(|line| serde_json::from_slice(line).ok()).collect()
}

/// Number of a journal's lines, and of those that cannot be understood.
#[derive(Debug, PartialEq)]
pub(super) struct Lines {
    pub(super) all: usize,
    pub(super) unread: usize,
}

/// Counts the lines of a journal.
pub(super) fn count(bytes: &[u8]) -> Lines {
    let lines = || bytes.split(|&b| b == b'\n').filter(|line| !line.trim_ascii().is_empty());
    let unread = lines().filter(|line| serde_json::from_slice::<Record>(line).is_err());
    Lines { all: lines().count(), unread: unread.count() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_without_their_pixels_and_what_is_no_line_is_left_out() {
        let text = br#"{"unix_s":7,"person":"Anna","act":"do","name":"lasso","masks":[{"finger":"right","of":"measured","before":null,"after":{"size":[2,2],"runs":[4],"base":"Threshold 5.00 mm","later":1}}],"review":["todo","in_progress"],"accepted":[null,null]}
{"unix_s":9,"person":"","act":"undo","name":"lasso","masks":[{"finger":"right","of":"measured","before":{"size":[2,2],"runs":[4],"base":""},"after":null},{"finger":"left","of":"measured","before":null,"after":{"width":2,"height":1,"runs":[2],"layers":[{"kind":"grown"},{"kind":"hand","person":"Anna"}],"layer_runs":[[0,2]]}}],"accepted":[null,null]}
{"unix_s":1"#;
        assert_eq!(count(b"{\"of\": \"something else\"}\n\n"), Lines { all: 1, unread: 1 });
        let found = parse(text);
        assert_eq!((found.len(), count(text)), (2, Lines { all: 3, unread: 1 }));
        assert_eq!((found[0].unix_s, found[0].person.as_str(), found[0].act), (7, "Anna", Act::Do));
        assert_eq!(found[0].masks[0].after.as_ref().unwrap().provenance().text(), "Threshold 5.00 mm");
        assert_eq!(found[0].review, Some([Review::Todo, Review::InProgress]));
        assert_eq!((found[1].act, found[1].masks[0].after.clone()), (Act::Undo, None));
        assert_eq!(found[1].masks[1].after.as_ref().unwrap().provenance(), Provenance::Grown);
    }
}
