//! Masks that lie in a form of other programs, taken over as labels: [`plan_import`] says what would change,
//! [`import_masks`] changes it. The studio and `touch2touch masks import` both end here.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use crate::error::{Remark, TaskError};
use crate::io::catch_panic::catch_panic;
use crate::io::dataset::Dataset;
use crate::io::error::FileError;
use crate::io::exchange::{self, ExportEntry, Format, Listed, Stems};
use crate::job::JobCx;
use crate::labels::{DrawnMask, Labels, MaskPlace, Operation, PairLabels};
use crate::steps::imprint::measured;
use touch2touch_core::dataset::{PairId, Split};
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::label::Provenance;
use touch2touch_core::rig::PadId;
use touch2touch_core::units::counted;

/// Name of the task in errors.
const WHAT: &str = "Import masks";

/// Source and form of an import.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportSetup {
    /// A folder, of an export or of one of its parts, or a file.
    pub from: PathBuf,
    /// Form of the masks; `None` = the one that lies there.
    pub format: Option<Format>,
    /// True where masks painted by hand are replaced as well, also of pairs that somebody judged.
    pub over_drawn: bool,
    /// Who asked; else whom the system says.
    pub person: Option<String>,
}

/// Changes of an import, made or only planned. Masks are of measured imprints.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Import {
    /// From where.
    pub from: PathBuf,
    /// In which form.
    pub format: Format,
    /// Masks where there was none.
    pub new: usize,
    /// Masks of which pixels change.
    pub replaced: usize,
    /// Masks that are so already.
    pub same: usize,
    /// Masks of which pixels painted by hand stay, although the file says otherwise; some of them change elsewhere.
    pub kept: usize,
    /// Masks of pairs marked "done", "flagged" or "skip", which stay as they are.
    pub judged: usize,
    /// Pairs whose labels change, by name.
    pub changed: Vec<String>,
    /// Masks whose names are of no pair and finger, and why.
    pub unmatched: Vec<Remark>,
    /// Masks that cannot be taken, and why.
    pub refused: Vec<Remark>,
    /// True where all that was found was looked at and belonged somewhere.
    pub complete: bool,
    /// True where it was told to stop early.
    pub stopped: bool,
    /// Folder of the labels; empty where there is none.
    pub labels: PathBuf,
}

impl Import {
    /// Masks that change.
    pub fn total(&self) -> usize {
        self.new + self.replaced
    }

    /// Numbers of masks that change and that do not, a line each.
    pub fn lines(&self) -> Vec<String> {
        let counts = [
            (self.new, "new"),
            (self.replaced, "of which pixels change"),
            (self.same, "equal to the stored ones"),
            (self.kept, "of which pixels stay because they were painted by hand"),
            (self.judged, "that stay because their pairs are marked \"done\", \"flagged\" or \"skip\""),
            (self.unmatched.len(), "of no pair and finger of this data set"),
            (self.refused.len(), "that cannot be taken"),
        ];
        let mut lines: Vec<String> =
            counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{} {what}", counted(*n, "mask"))).collect();
        if lines.is_empty() {
            lines.push("no masks".into());
        }
        for (what, list) in [("no pair", &self.unmatched), ("cannot be taken", &self.refused)] {
            lines.extend(list.first().map(|first| format!("{what}, the first: {}: {}", first.name, first.why)));
        }
        lines
    }

    /// Summary in words.
    pub fn text(&self) -> String {
        let stopped = if self.stopped { "; stopped early" } else { "" };
        format!("Imported from {}: {}{stopped}", self.from.display(), self.lines().join("; "))
    }
}

/// Changes that an import would make. Reads all that the import reads, and writes nothing.
///
/// # Errors
/// As [`import_masks`].
pub fn plan_import(dataset: &Dataset, setup: &ImportSetup, cx: &JobCx) -> Result<Import, TaskError> {
    go(dataset, setup, false, cx)
}

/// Takes masks over. What a person painted stays and so do judged pairs, unless `over_drawn`; review states stay in any case.
/// Each pair's change is a line of its journal, which undo takes back. Stops early when told to.
///
/// # Errors
/// If there are no masks, their form cannot be told, labels cannot be stored, or it was told to stop before the first.
pub fn import_masks(dataset: &Dataset, setup: &ImportSetup, cx: &JobCx) -> Result<Import, TaskError> {
    go(dataset, setup, true, cx)
}

fn go(dataset: &Dataset, setup: &ImportSetup, write: bool, cx: &JobCx) -> Result<Import, TaskError> {
    let fail = |err: FileError| TaskError::from_error(WHAT, &err).with_hint(err.hint);
    let listing = exchange::list(&setup.from, setup.format).map_err(fail)?;
    let labels = Labels::of(dataset);
    let folder = match labels.folder() {
        Err(err) if write => return Err(err),
        folder => folder.map(std::path::Path::to_owned).unwrap_or_default(),
    };
    let mut found = Import { from: setup.from.clone(), format: listing.format, labels: folder, ..Import::default() };
    let name = |file: &std::path::Path| file.strip_prefix(&setup.from).unwrap_or(file).display().to_string();
    found.refused = listing.refused.iter().map(|err| Remark { name: name(&err.file), why: err.what.clone() }).collect();
    let pairs = matched(dataset, &listing.masks, &mut found.unmatched);
    let total = pairs.len() as u64;
    for (done, (pair, masks)) in pairs.into_iter().enumerate() {
        if cx.cancel.is_cancelled() {
            found.stopped = true;
            break;
        }
        let Some(entry) = dataset.index.get(pair) else { continue };
        cx.progress(done as u64, total, &entry.name);
        let job = ImportRun { dataset, labels: &labels, setup, write };
        let one = catch_panic(|| job.one(pair, &entry.name, &masks, &mut found));
        if let Err(err) = one.unwrap_or_else(|message| Err(TaskError::panicked(WHAT, &message))) {
            found.refused.push(Remark { name: entry.name.clone(), why: err.why });
        }
    }
    if found.stopped && found.total() == 0 {
        cx.check(WHAT)?;
    }
    let looked_at = found.total() + found.same + found.kept + found.judged;
    found.complete = !found.stopped && looked_at > 0 && found.unmatched.is_empty() && found.refused.is_empty();
    Ok(found)
}

/// The masks by pair and finger.
fn matched<'a>(
    dataset: &Dataset,
    masks: &'a [Listed],
    unmatched: &mut Vec<Remark>,
) -> BTreeMap<PairId, BTreeMap<PadId, &'a Listed>> {
    let ids = || (0u32..).map(PairId).zip(&dataset.index.pairs);
    let entries: Vec<(PairId, ExportEntry)> = ids()
        .flat_map(|(id, entry)| {
            dataset.rig.pads().map(move |finger| {
                let (pair, tool, held_out) = (entry.name.clone(), entry.tool.clone(), entry.split == Split::Test);
                (id, ExportEntry { pair, tool, finger, held_out })
            })
        })
        .collect();
    let by_name: BTreeMap<(&str, String), usize> = (0..)
        .zip(&entries)
        .map(|(at, (_, entry))| ((&*entry.pair, dataset.rig.pad_key(entry.finger).into_owned()), at))
        .collect();
    let plain: Vec<ExportEntry> = entries.iter().map(|(_, entry)| entry.clone()).collect();
    let stems = Stems::of(&plain, &dataset.rig);
    let mut out: BTreeMap<PairId, BTreeMap<PadId, &Listed>> = BTreeMap::new();
    for listed in masks {
        let said = listed.of.as_ref().and_then(|(pair, finger)| by_name.get(&(&**pair, finger.clone())));
        let mut refuse = |why: String| unmatched.push(Remark { name: listed.stem.clone(), why });
        let at = match (said, stems.find(&listed.stem)) {
            (Some(at), _) | (None, [at]) => *at,
            (None, []) => {
                let of = listed.of.as_ref().map(|(pair, finger)| format!("{pair}, {finger} finger, is not in it"));
                refuse(of.unwrap_or_else(|| "no pair and finger has this name in an export".into()));
                continue;
            }
            (None, several) => {
                let pairs: Vec<&str> = several.iter().map(|at| &*entries[*at].1.pair).collect();
                refuse(format!("it may be of {}: import the whole folder of the export", pairs.join(" or ")));
                continue;
            }
        };
        let (id, entry) = &entries[at];
        if out.entry(*id).or_default().insert(entry.finger, listed).is_some() {
            refuse("another mask is of the same pair and finger, and only the last one is taken".into());
        }
    }
    out
}

/// Settings of an import that are the same for all pairs.
#[derive(Clone, Copy)]
struct ImportRun<'a> {
    dataset: &'a Dataset,
    labels: &'a Labels,
    setup: &'a ImportSetup,
    write: bool,
}

impl ImportRun<'_> {
    fn one(
        self,
        pair: PairId,
        name: &str,
        masks: &BTreeMap<PadId, &Listed>,
        found: &mut Import,
    ) -> Result<(), TaskError> {
        let mut stored = self.labels.load(name)?;
        let sample = self.dataset.load(pair).map_err(|err| TaskError::from_error(WHAT, &err))?;
        let imprints = measured(&sample);
        let judged = stored.review.is_judged() && !self.setup.over_drawn;
        // Counted only once the whole pair is saved.
        let (mut here, mut how) = (Import::default(), Vec::new());
        for (&pad, listed) in masks {
            match self.mask(pad, listed, imprints[pad].as_ref(), &mut stored, judged, &mut here) {
                Ok(changed) => how.extend(changed.then(|| listed.file.display().to_string())),
                Err(err) => found.refused.push(Remark { name: listed.stem.clone(), why: err.to_string() }),
            }
        }
        if !how.is_empty() {
            if self.write {
                let how = Some(serde_json::json!({ "files": how, "over_drawn": self.setup.over_drawn }));
                let deed = Operation { person: self.setup.person.clone(), how, ..Operation::named("import of masks") };
                self.labels.save(name, &stored, &deed)?;
            }
            found.changed.push(name.to_owned());
        }
        found.new += here.new;
        found.replaced += here.replaced;
        found.same += here.same;
        found.kept += here.kept;
        found.judged += here.judged;
        Ok(())
    }

    /// Puts a mask in its place; whether that changes anything.
    fn mask(
        self,
        pad: PadId,
        listed: &Listed,
        imprint: Option<&DepthMap>,
        stored: &mut PairLabels,
        judged: bool,
        counts: &mut Import,
    ) -> Result<bool, FileError> {
        let refuse = |what: String| FileError::new(&listed.file, what, "");
        let size = imprint.ok_or_else(|| refuse("the finger has no measured imprint".into()))?.size();
        let (mask, ignored) = listed.read()?;
        for one in std::iter::once(&mask).chain(&ignored) {
            if one.size() != size {
                let ([w, h], [width, height]) = (one.size(), size);
                return Err(refuse(format!("it has {w} x {h} pixels, the imprint {width} x {height}")));
            }
        }
        let by = Provenance::Imported {
            file: listed.file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
        };
        let place = MaskPlace::measured(pad);
        let old = stored.masks.get(&place);
        if let Some([w, h]) = old.map(|old| old.mask.size()).filter(|old| *old != size) {
            return Err(refuse(format!("the stored mask is of another imprint, {w} x {h} pixels, and stays as it is")));
        }
        let mut hand = match old {
            Some(old) => old.clone(),
            None => DrawnMask::new(Mask::filled(size[0], size[1], false), by.clone()),
        };
        let [changed, kept] = hand.take_over(&mask, ignored.as_ref(), by, !self.setup.over_drawn);
        match (old.is_some(), changed, kept) {
            (true, 0, 0) => counts.same += 1,
            _ if judged => counts.judged += 1,
            (false, ..) => counts.new += 1,
            (true, ..) => {
                counts.replaced += usize::from(changed > 0);
                counts.kept += usize::from(kept > 0);
            }
        }
        let changes = !judged && (old.is_none() || changed > 0);
        if changes {
            stored.put(&place, Some(hand));
        }
        Ok(changes)
    }
}
