//! Masks for training, in a form of one's choice: [`plan`] says what goes where, [`export_masks`] writes it. The studio and
//! `touch2touch masks export` both end here.

pub mod import;
pub mod pair_files;

mod automatic;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Serialize;
use strum::EnumIter;

use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::io::exchange::{self, Content, ExportEntry, ExportReport};
pub use crate::io::exchange::{ExportChoice, Which};
use crate::job::JobCx;
use crate::labels::{DrawnMask, Labels, PairLabels, Review};
use touch2touch_core::dataset::{PairId, Split};
use touch2touch_core::rig::{PadId, Rig};
use touch2touch_core::units::counted;

pub use automatic::Automatic;

/// Name of the task in errors.
const WHAT: &str = "Export masks";

/// The masks drawn by hand on measured imprints: those on the disk, and over them what was changed since.
#[derive(Clone, Copy, Debug)]
pub struct DrawnMasks<'a> {
    /// Labels as they are stored.
    pub labels: &'a Labels,
    /// Labels that are newer, by pair name.
    pub changed: &'a BTreeMap<String, PairLabels>,
}

impl DrawnMasks<'_> {
    /// The pairs and fingers that have one.
    pub(crate) fn all(&self, rig: &Rig) -> BTreeSet<(String, PadId)> {
        let mut all: BTreeSet<(String, PadId)> = self.labels.masks().into_iter().collect();
        for (pair, labels) in self.changed {
            for finger in rig.pads() {
                let key = (pair.clone(), finger);
                match labels.measured(finger) {
                    Some(_) => all.insert(key),
                    None => all.remove(&key),
                };
            }
        }
        all
    }

    /// Labels of a pair, the newer ones where there are any.
    pub(crate) fn of_pair(&self, pair: &str) -> Result<PairLabels, TaskError> {
        self.changed.get(pair).map_or_else(|| self.labels.load(pair), |labels| Ok(labels.clone()))
    }

    /// The mask of one finger, if it has one.
    fn get(&self, pair: &str, finger: PadId) -> Result<Option<DrawnMask>, TaskError> {
        Ok(self.of_pair(pair)?.measured(finger).cloned())
    }

    /// The review states that are not "todo", by pair name.
    pub(crate) fn reviews(&self) -> BTreeMap<String, Review> {
        let mut reviews = self.labels.reviews().states;
        reviews.extend(self.changed.iter().map(|(pair, labels)| (pair.clone(), labels.review)));
        reviews
    }
}

/// Pairs and choices of an export.
#[derive(Clone, Debug, Default)]
pub struct ExportSetup {
    /// Only these pairs; `None` takes all.
    pub pairs: Option<Vec<PairId>>,
    /// Choice among them, and their division.
    pub choice: ExportChoice,
}

/// Why a pair does not go along.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum LeftOut {
    /// The mask was begun and is not marked *done*.
    NotDone,
    /// It is marked *done* and no mask was drawn.
    NotDrawn,
    /// It is marked *flagged*.
    Flagged,
    /// It is marked *skip*.
    Skip,
    /// A mask was to come from the CAD model, and there is none.
    NoCad,
}

impl LeftOut {
    /// In words, after a number of pairs.
    pub fn text(self) -> &'static str {
        match self {
            Self::NotDone => "begun and not marked \"done\"",
            Self::NotDrawn => "marked \"done\" without a mask drawn (take the automatic one over first)",
            Self::Flagged => "marked \"flagged\"",
            Self::Skip => "marked \"skip\"",
            Self::NoCad => "of a tool without a CAD model",
        }
    }
}

/// Division of an export, before anything is written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Plan {
    /// Masks in train, val and test.
    pub counts: [usize; 3],
    /// Masks drawn by hand among them.
    pub by_hand: usize,
    /// Pairs that go to test because the data set keeps them for tests.
    pub held_out: usize,
    /// Pairs that do not go along.
    pub left_out: BTreeMap<LeftOut, usize>,
    entries: Vec<ExportEntry>,
    ids: Vec<PairId>,
    drawn: BTreeSet<(String, PadId)>,
}

impl Plan {
    /// All masks.
    pub fn total(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Counts that go to each part, and reasons for those that do not, a line each.
    pub fn lines(&self) -> Vec<String> {
        let [train, val, test] = self.counts;
        let by_hand =
            if self.by_hand < self.total() { format!(", {} drawn by hand", self.by_hand) } else { String::new() };
        let held_out = match self.held_out {
            0 => String::new(),
            n => format!(" ({} reserved for tests)", counted(n, "pair")),
        };
        let mut lines = vec![
            format!("{}{by_hand}", counted(self.total(), "mask")),
            format!("{train} training, {val} validation, {test} test{held_out}"),
        ];
        lines.extend(self.left_out.iter().map(|(why, n)| format!("left out: {} {}", counted(*n, "pair"), why.text())));
        lines
    }
}

/// Division of the masks among the parts. Reads the review states and the names of the masks, no pixels.
///
/// # Errors
/// If the masks cannot be divided.
pub fn plan(dataset: &Dataset, masks: &DrawnMasks<'_>, setup: &ExportSetup) -> Result<Plan, TaskError> {
    let choice = setup.choice;
    let (drawn, reviews) = (masks.all(&dataset.rig), masks.reviews());
    let all = || (0..dataset.index.pairs.len() as u32).map(PairId).collect::<Vec<_>>();
    let mut plan = Plan::default();
    for id in setup.pairs.clone().unwrap_or_else(all) {
        let Some(entry) = dataset.index.get(id) else { continue };
        let by_hand = |finger: &PadId| drawn.contains(&(entry.name.clone(), *finger));
        let review = reviews.get(&entry.name).copied().unwrap_or_default();
        let is_drawn = dataset.rig.pads().any(|finger| by_hand(&finger));
        let left_out = match (review, choice.which) {
            (Review::Skip, _) => Some(LeftOut::Skip),
            (Review::Flagged, _) => Some(LeftOut::Flagged),
            (Review::Done, Which::Done | Which::Begun) if !is_drawn => Some(LeftOut::NotDrawn),
            (Review::Todo | Review::InProgress, Which::Done) if is_drawn => Some(LeftOut::NotDone),
            _ => None,
        };
        if let Some(why) = left_out {
            *plan.left_out.entry(why).or_default() += 1;
            continue;
        }
        let held_out = entry.split == Split::Test;
        let wanted: Vec<PadId> = dataset.rig.pads().filter(|f| choice.which == Which::All || by_hand(f)).collect();
        plan.held_out += usize::from(held_out && !choice.test_in_train && !wanted.is_empty());
        for finger in wanted {
            plan.by_hand += usize::from(by_hand(&finger));
            let (pair, tool) = (entry.name.clone(), entry.tool.clone());
            plan.entries.push(ExportEntry { pair, tool, finger, held_out });
            plan.ids.push(id);
        }
    }
    plan.counts = exchange::counts(&plan.entries, &choice);
    plan.drawn = drawn;
    Ok(plan)
}

/// Writes masks as [`plan`] says, and reads them back by the rules of their form. Without `automatic`, only masks
/// drawn by hand can be written.
///
/// # Errors
/// If there is none, one cannot be read or made, or not all could be written and read back; the folder is then as it
/// was.
pub fn export_masks(
    dataset: &Dataset,
    masks: &DrawnMasks<'_>,
    setup: &ExportSetup,
    folder: &Path,
    mut automatic: Option<Automatic<'_>>,
    cx: &JobCx,
) -> Result<(Plan, ExportReport), TaskError> {
    let plan = plan(dataset, masks, setup)?;
    let (entries, drawn) = (&plan.entries, &plan.drawn);
    if entries.is_empty() {
        let left_out: Vec<String> =
            plan.left_out.iter().map(|(why, n)| format!("; {} {}", counted(*n, "pair"), why.text())).collect();
        let place = masks.labels.folder().map_or(String::new(), |f| format!(" (they would lie in {})", f.display()));
        return Err(TaskError::new(WHAT, format!("there is no mask to export{place}{}", left_out.concat())).with_hint(
            "Correct masks in the studio and mark their pairs \"done\", or export those in progress (--pairs begun) or \
             automatic ones as well (--pairs all).",
        ));
    }
    if !drawn.is_empty() {
        // A mask that was changed since is taken from memory, and the file may be anything.
        let stored = entries
            .iter()
            .filter(|e| drawn.contains(&(e.pair.clone(), e.finger)) && !masks.changed.contains_key(&e.pair));
        let store = masks.labels.store(WHAT)?;
        exchange::check_stored(store, stored).map_err(|err| TaskError::from_error(WHAT, &err))?;
    }
    let total = entries.len() as u64;
    let report = exchange::export(folder, entries, &setup.choice, &dataset.rig, |at| {
        let entry = &entries[at];
        cx.check(WHAT)?;
        cx.progress(at as u64, total, format!("{}, {}", entry.pair, dataset.rig.pad_key(entry.finger)));
        let sample = dataset.load(plan.ids[at])?;
        let bubble = sample.pad(entry.finger).and_then(|touch| touch.depth());
        let imprint = bubble.ok_or_else(|| TaskError::new(WHAT, "the finger has no imprint"))?.imprint.clone();
        let by_hand = match drawn.contains(&(entry.pair.clone(), entry.finger)) {
            true => masks.get(&entry.pair, entry.finger)?,
            false => None,
        };
        let (mask, ignored) = match (by_hand, automatic.as_mut()) {
            (Some(hand), _) => ((*hand.mask).clone(), hand.unsaid(setup.choice.manual_checked)),
            (None, Some(automatic)) => {
                let mask = automatic.mask(plan.ids[at], &sample, entry.finger, entry.tool.as_deref())?;
                let unsaid = setup.choice.manual_checked.then(|| mask.map(|_| true));
                (mask, unsaid)
            }
            (None, None) => return Err(TaskError::new(WHAT, "its mask disappeared").into()),
        };
        Ok(Content { imprint, mask, ignored })
    })
    .map_err(|err| {
        if cx.cancel.is_cancelled() { TaskError::cancelled(WHAT) } else { TaskError::from_error(WHAT, &err) }
    })?;
    Ok((plan, report))
}
