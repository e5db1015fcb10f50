//! Masks as training folders for a mask UNet: [`export_masks`]. The button and `touch2touch masks export` both end here.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::error::TaskError;
use super::job::JobCx;
use super::labels::{Labels, PairLabels, Review};
use crate::domain::dataset::PairId;
use crate::domain::grid::Mask;
use crate::domain::rig::{PadId, Rig};
use crate::domain::sample::Sample;
use crate::io::dataset::Dataset;
use crate::io::export_unet::{self, ExportConfig, ExportEntry, ExportReport, LoadFailure};

/// What it is called in errors.
const WHAT: &str = "Export masks";

/// The masks drawn by hand: those on the disk, and over them what was changed since.
#[derive(Clone, Copy, Debug)]
pub struct HandMasks<'a> {
    /// What is stored.
    pub labels: &'a Labels,
    /// What is newer, by pair name.
    pub changed: &'a BTreeMap<String, PairLabels>,
}

impl HandMasks<'_> {
    /// The pairs and fingers that have one.
    fn all(&self, rig: &Rig) -> BTreeSet<(String, PadId)> {
        let mut all: BTreeSet<(String, PadId)> = self.labels.masks().into_iter().collect();
        for (pair, labels) in self.changed {
            for finger in rig.pads() {
                let key = (pair.clone(), finger);
                match labels.masks[finger] {
                    Some(_) => all.insert(key),
                    None => all.remove(&key),
                };
            }
        }
        all
    }

    /// The mask of one finger, if it has one.
    fn get(&self, pair: &str, finger: PadId) -> Result<Option<Mask>, TaskError> {
        let labels = match self.changed.get(pair) {
            Some(labels) => labels.clone(),
            None => self.labels.load(pair)?,
        };
        Ok(labels.masks[finger].as_ref().map(|hand| (*hand.mask).clone()))
    }

    /// The review states that are not "todo", by pair name.
    fn reviews(&self) -> BTreeMap<String, Review> {
        let (mut reviews, _) = self.labels.reviews();
        reviews.extend(self.changed.iter().map(|(pair, labels)| (pair.clone(), labels.review)));
        reviews
    }
}

/// Which pairs are exported, and how they are divided.
#[derive(Clone, Debug, Default)]
pub struct ExportSetup {
    /// Only these pairs; `None` takes all.
    pub pairs: Option<Vec<PairId>>,
    /// How they are divided.
    pub split: ExportConfig,
}

/// What was exported.
#[derive(Clone, Debug)]
pub struct Exported {
    /// The files.
    pub report: ExportReport,
    /// Masks drawn by hand among them.
    pub by_hand: usize,
    /// Pairs left out because their review state is "skip".
    pub skipped: usize,
}

/// Makes the mask of a finger that has none by hand.
pub type Automatic<'a> = &'a mut dyn FnMut(&Sample, PadId, Option<&str>) -> Result<Mask, TaskError>;

/// Writes images and masks of the pairs of a data set, and reads them back by the loader's rules. Pairs marked *skip* are
/// left out. Without `automatic`, only masks drawn by hand are written.
///
/// # Errors
/// If there is none, one cannot be read or made, or not all could be written and read back; the folder is then as it
/// was.
pub fn export_masks(
    dataset: &Dataset,
    masks: &HandMasks<'_>,
    setup: &ExportSetup,
    folder: &Path,
    mut automatic: Option<Automatic<'_>>,
    cx: &JobCx,
) -> Result<Exported, TaskError> {
    let (by_hand, reviews) = (masks.all(&dataset.rig), masks.reviews());
    let all = || (0..dataset.index.pairs.len() as u32).map(PairId).collect::<Vec<_>>();
    let (mut entries, mut ids, mut skipped) = (Vec::new(), Vec::new(), 0);
    for id in setup.pairs.clone().unwrap_or_else(all) {
        let Some(entry) = dataset.index.get(id) else { continue };
        let wanted: Vec<PadId> = dataset
            .rig
            .pads()
            .filter(|finger| automatic.is_some() || by_hand.contains(&(entry.name.clone(), *finger)))
            .collect();
        if !wanted.is_empty() && reviews.get(&entry.name) == Some(&Review::Skip) {
            skipped += 1;
            continue;
        }
        for finger in wanted {
            entries.push(ExportEntry { pair: entry.name.clone(), tool: entry.tool.clone(), finger });
            ids.push(id);
        }
    }
    if entries.is_empty() {
        let left_out = if skipped > 0 { format!("; {skipped} pairs are marked \"skip\"") } else { String::new() };
        let place = masks.labels.folder().map_or(String::new(), |f| format!(" (they would lie in {})", f.display()));
        return Err(TaskError::new(WHAT, format!("no mask was corrected by hand yet{place}{left_out}"))
            .with_hint("Correct masks in the studio, or export automatic ones as well (--pairs all)."));
    }
    if !by_hand.is_empty() {
        // A mask that was changed since is taken from memory, and the file may be anything.
        let stored = entries
            .iter()
            .filter(|e| by_hand.contains(&(e.pair.clone(), e.finger)) && !masks.changed.contains_key(&e.pair));
        let store = masks.labels.store(WHAT)?;
        export_unet::check_stored(store, stored).map_err(|err| TaskError::from_error(WHAT, &err))?;
    }
    let total = entries.len() as u64;
    let split = ExportConfig { rig: dataset.rig.clone(), ..setup.split.clone() };
    let mut done = Exported { report: ExportReport::default(), by_hand: 0, skipped };
    done.report = export_unet::export(folder, &entries, &split, |at| {
        let entry = &entries[at];
        cx.check(WHAT).map_err(|_| LoadFailure::Stop)?;
        cx.progress(at as u64, total, format!("{}, {}", entry.pair, dataset.rig.pad_key(entry.finger)));
        let sample = dataset.load(ids[at])?;
        let bubble = sample.pad(entry.finger).and_then(|touch| touch.depth());
        let imprint = bubble.ok_or_else(|| TaskError::new(WHAT, "the finger has no imprint"))?.imprint.clone();
        let drawn = match by_hand.contains(&(entry.pair.clone(), entry.finger)) {
            true => masks.get(&entry.pair, entry.finger)?,
            false => None,
        };
        let mask = match (drawn, automatic.as_mut()) {
            (Some(mask), _) => {
                done.by_hand += 1;
                mask
            }
            (None, Some(automatic)) => automatic(&sample, entry.finger, entry.tool.as_deref())?,
            (None, None) => return Err(TaskError::new(WHAT, "its mask disappeared").into()),
        };
        Ok((imprint, mask))
    })
    .map_err(|err| {
        if cx.cancel.is_cancelled() { TaskError::cancelled(WHAT) } else { TaskError::from_error(WHAT, &err) }
    })?;
    Ok(done)
}
