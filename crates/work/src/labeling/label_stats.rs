//! Progress of the labeling of a data set, and the work that it took: [`label_stats`].

use std::collections::BTreeMap;

use serde::Serialize;
use strum::IntoEnumIterator as _;

use super::labels::{Act, Labels, Record, Review, working_seconds};
use super::repeats::{Repeater, Repeats, repeats};
use crate::error::TaskError;
use crate::io::dataset::Dataset;
use touch2touch_core::dataset::Index;
use touch2touch_core::label::Provenance;

/// Number of pairs in each review state.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts(BTreeMap<&'static str, usize>);

impl Counts {
    /// Pairs in a state.
    pub fn of(&self, review: Review) -> usize {
        self.0.get(review.stored()).copied().unwrap_or(0)
    }

    /// Pairs in all.
    pub fn total(&self) -> usize {
        self.0.values().sum()
    }

    fn add(&mut self, review: Review) {
        *self.0.entry(review.stored()).or_default() += 1;
    }
}

/// Progress of the pairs of one tool.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ToolProgress {
    /// The tool; `None` for pairs without one.
    pub tool: Option<String>,
    /// Number of its pairs in each review state.
    pub pairs: Counts,
}

/// Progress of the pairs of each tool, by the tools' names.
pub fn progress(index: &Index, reviews: &BTreeMap<String, Review>) -> Vec<ToolProgress> {
    let mut tools: BTreeMap<Option<&String>, Counts> = BTreeMap::new();
    for entry in &index.pairs {
        let review = reviews.get(&entry.name).copied().unwrap_or_default();
        tools.entry(entry.tool.as_ref()).or_default().add(review);
    }
    tools.into_iter().map(|(tool, pairs)| ToolProgress { tool: tool.cloned(), pairs }).collect()
}

/// The work on the masks of one pair.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PairWork {
    /// The pair's name.
    pub pair: String,
    /// Tool of the pair.
    pub tool: Option<String>,
    /// Who did the last of it.
    pub person: String,
    /// Time from the first deed to the last, without pauses longer than a minute.
    pub seconds: u64,
    /// Masks drawn by hand that there are at the end.
    pub masks: usize,
    /// Changes of masks, without those that were taken back or done again.
    pub edits: usize,
    /// Number of times that something was taken back.
    pub undone: usize,
    /// Changes by what was done, e.g. `brush stroke`.
    pub deeds: BTreeMap<String, usize>,
    /// Sources of the masks at the end, each with its number.
    pub sources: BTreeMap<&'static str, usize>,
}

/// Source of a mask, without its numbers.
fn source_of(base: &Provenance) -> &'static str {
    /// Words of older journals, each with the source that it means.
    const TOLD: [(&str, &str); 6] = [
        ("Threshold", "threshold"),
        ("Top", "top percent"),
        ("CAD", "CAD distance"),
        ("UNet", "UNet"),
        ("Simulator", "simulator truth"),
        ("the ", "copy"),
    ];
    match base {
        Provenance::Nothing => "nothing",
        Provenance::Threshold { .. } => "threshold",
        Provenance::TopPercent { .. } => "top percent",
        Provenance::Cad { .. } => "CAD distance",
        Provenance::Model { .. } => "UNet",
        Provenance::Truth => "simulator truth",
        Provenance::Copied { .. } => "copy",
        Provenance::Grown => "grown",
        Provenance::Imported { .. } => "imported",
        Provenance::Accepted { was, .. } => source_of(was),
        Provenance::Told { text } => {
            TOLD.iter().find(|(begins, _)| text.starts_with(begins)).map_or("other", |(_, source)| source)
        }
        _ => "other",
    }
}

impl PairWork {
    /// Work that a journal tells of.
    pub fn of(pair: &str, tool: Option<&String>, records: &[Record]) -> Self {
        let mut work = Self { pair: pair.to_owned(), tool: tool.cloned(), ..Self::default() };
        let mut bases: BTreeMap<(String, String), Provenance> = BTreeMap::new();
        for record in records {
            work.person.clone_from(&record.person);
            for mask in &record.masks {
                let place = (mask.finger.clone(), mask.of.to_string());
                match &mask.after {
                    Some(after) => drop(bases.insert(place, after.provenance())),
                    None => drop(bases.remove(&place)),
                }
            }
            match record.act {
                Act::Do if !record.masks.is_empty() => {
                    work.edits += 1;
                    *work.deeds.entry(record.name.clone()).or_default() += 1;
                }
                Act::Undo => work.undone += 1,
                Act::Do | Act::Redo => {}
            }
        }
        work.seconds = working_seconds(records);
        work.masks = bases.len();
        for base in bases.values() {
            *work.sources.entry(source_of(base)).or_default() += 1;
        }
        work
    }
}

/// Work on masks from one source. A pair whose masks are from several counts to each by its share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Effort {
    /// Masks.
    pub masks: usize,
    /// Changes of them.
    pub edits: f64,
    /// Time.
    pub seconds: f64,
}

impl Effort {
    /// Time for a mask, seconds; `None` without any.
    pub fn seconds_per_mask(self) -> Option<f64> {
        (self.masks > 0).then(|| self.seconds / self.masks as f64)
    }

    /// Changes of a mask; `None` without any.
    pub fn edits_per_mask(self) -> Option<f64> {
        (self.masks > 0).then(|| self.edits / self.masks as f64)
    }

    fn add(&mut self, work: &PairWork, masks: usize) {
        let share = masks as f64 / work.masks as f64;
        self.masks += masks;
        self.edits += share * work.edits as f64;
        self.seconds += share * work.seconds as f64;
    }
}

/// Progress of the labeling, and the work that it took.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LabelStats {
    /// The pairs of each tool by review state.
    pub tools: Vec<ToolProgress>,
    /// All pairs by review state.
    pub all: Counts,
    /// Work on all masks.
    pub effort: Effort,
    /// By what the masks were made from.
    pub sources: BTreeMap<&'static str, Effort>,
    /// Changes by what was done.
    pub deeds: BTreeMap<String, usize>,
    /// The work on each pair that has a journal, in the order of the data set.
    pub pairs: Vec<PairWork>,
    /// Agreement with oneself on pairs drawn a second time.
    pub repeats: Repeats,
    /// Journals and masks that cannot be read, and why.
    pub problems: Vec<String>,
}

impl LabelStats {
    /// Of review states alone.
    pub fn of_reviews(index: &Index, reviews: &BTreeMap<String, Review>) -> Self {
        let tools = progress(index, reviews);
        let mut all = Counts::default();
        for review in Review::iter() {
            let count = tools.iter().map(|tool| tool.pairs.of(review)).sum();
            if count > 0 {
                all.0.insert(review.stored(), count);
            }
        }
        Self { tools, all, ..Self::default() }
    }

    fn add(&mut self, work: PairWork) {
        for (deed, count) in &work.deeds {
            *self.deeds.entry(deed.clone()).or_default() += count;
        }
        if work.masks > 0 {
            self.effort.add(&work, work.masks);
            for (source, masks) in &work.sources {
                self.sources.entry(source).or_default().add(&work, *masks);
            }
        }
        self.pairs.push(work);
    }
}

/// Reads the journals of a data set. `reviews` are the states in force, which may be newer than the files; the
/// repeats are those of `repeater`.
pub fn label_stats(
    dataset: &Dataset,
    labels: &Labels,
    reviews: &BTreeMap<String, Review>,
    repeater: Repeater<'_>,
) -> LabelStats {
    let mut stats = LabelStats::of_reviews(&dataset.index, reviews);
    let mut journals: BTreeMap<String, Vec<Record>> = BTreeMap::new();
    let why = |what: &str, err: &TaskError| format!("{what}: {}", err.why);
    // Without a place for labels there are none.
    for entry in dataset.index.pairs.iter().filter(|_| labels.folder().is_ok()) {
        stats.problems.extend(labels.journal_problem(&entry.name).map(|err| why(&entry.name, &err)));
        match labels.records(&entry.name) {
            Ok(records) if records.is_empty() => {}
            Ok(records) => {
                stats.add(PairWork::of(&entry.name, entry.tool.as_ref(), &records));
                journals.insert(entry.name.clone(), records);
            }
            // It is among the problems already.
            Err(_) => {}
        }
    }
    match repeats(dataset, labels, reviews, &journals, repeater) {
        Ok(found) => stats.repeats = found,
        Err(err) => stats.problems.push(why("repeats", &err)),
    }
    stats
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::MaskRecord;
    use touch2touch_core::dataset::{PairEntry, Split};

    fn deed(unix_s: u64, act: Act, name: &str, masks: &[(&str, Option<&str>)]) -> Record {
        let mask = |(finger, base): &(&str, Option<&str>)| MaskRecord {
            finger: (*finger).into(),
            of: "measured".into(),
            after: base.map(|base| Provenance::told(base).into()),
        };
        Record {
            unix_s,
            act,
            name: name.into(),
            person: "Anna".into(),
            masks: masks.iter().map(mask).collect(),
            review: None,
        }
    }

    #[test]
    fn work_is_counted_without_its_pauses() {
        let unet = Some("UNet a");
        let records = [
            deed(100, Act::Do, "automatic mask taken over", &[("right", unet)]),
            deed(110, Act::Do, "brush stroke", &[("right", unet)]),
            deed(115, Act::Undo, "brush stroke", &[("right", unet)]),
            // Lunch.
            deed(4000, Act::Do, "brush stroke", &[("left", Some("Threshold 5.00 mm"))]),
            deed(4060, Act::Do, "brush stroke", &[("left", Some(""))]),
            // The clock was set back.
            deed(3000, Act::Do, "review state", &[]),
        ];
        let work = PairWork::of("a", None, &records);
        assert_eq!((work.seconds, work.masks, work.edits, work.undone), (15 + 60, 2, 4, 1));
        assert_eq!(work.deeds, BTreeMap::from([("automatic mask taken over".into(), 1), ("brush stroke".into(), 3)]));
        assert_eq!(work.sources, BTreeMap::from([("UNet", 1), ("nothing", 1)]));
        assert_eq!(PairWork::of("b", None, &[]).seconds, 0);
        // What was removed is no mask.
        let removed = [&records[..1], &[deed(120, Act::Do, "correction removed", &[("right", None)])]].concat();
        assert_eq!(PairWork::of("a", None, &removed).masks, 0);
        let mut stats = LabelStats::default();
        stats.add(work);
        assert_eq!(stats.effort.seconds_per_mask(), Some(37.5));
        assert_eq!((stats.sources["UNet"].masks, stats.sources["UNet"].edits), (1, 2.0));
        assert_eq!(LabelStats::default().effort.seconds_per_mask(), None);
    }

    #[test]
    fn pairs_are_counted_by_tool_and_state() {
        let entry = |name: &str, tool: Option<&str>| PairEntry {
            name: name.into(),
            tool: tool.map(str::to_owned),
            split: Split::None,
            number: 0,
        };
        let index = Index { pairs: vec![entry("a", Some("rod")), entry("b", Some("rod")), entry("c", None)] };
        let reviews = BTreeMap::from([("a".to_owned(), Review::Done), ("elsewhere".to_owned(), Review::Done)]);
        let stats = LabelStats::of_reviews(&index, &reviews);
        assert_eq!((stats.all.of(Review::Done), stats.all.of(Review::Todo), stats.all.total()), (1, 2, 3));
        let rod = stats.tools.iter().find(|tool| tool.tool.as_deref() == Some("rod")).unwrap();
        assert_eq!((rod.pairs.of(Review::Done), rod.pairs.of(Review::Todo)), (1, 1));
        assert_eq!(LabelStats::of_reviews(&Index::default(), &reviews).all.total(), 0);
    }
}
