//! Labels that could not be written where they belong: they are kept in another folder, in the same files, and taken in from
//! there when the data set is opened again.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::journal::{Line, same};
use super::stored::{Signed, store_error, stored_review};
use super::{Change, Labels, Operation, PairLabels, note};
use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::io::error::FileError;
use crate::io::masks::MaskStore;
use crate::io::{atomic, files, names};
use touch2touch_core::units::counted;

/// The file in such a folder that says what the labels are of.
const MANIFEST: &str = "recovered.json";
const FORMAT: &str = "touch2touch-recovered";
const VERSION: u32 = 1;

/// Labels of a pair that are not on the disk.
#[derive(Clone, Debug, PartialEq)]
pub struct Unsaved {
    /// The pair.
    pub name: String,
    /// All that is said of it.
    pub labels: PairLabels,
    /// Act that was last.
    pub deed: Operation,
}

/// Outcome of taking in labels from a folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recovered {
    /// The pairs.
    pub pairs: Vec<String>,
    /// Labels that were left in their folder, and why.
    pub failed: Vec<TaskError>,
}

impl Recovered {
    /// It in a line; `None` where nothing was taken in.
    pub fn text(&self) -> Option<String> {
        let first = self.pairs.first()?;
        let n = self.pairs.len();
        let pairs = if n == 1 { first.clone() } else { format!("{}, {first} the first", counted(n, "pair")) };
        Some(format!("Labels that could not be saved before were taken in: {pairs}"))
    }
}

#[derive(Serialize, Deserialize)]
struct Manifest {
    format: String,
    version: u32,
    /// The data set's folder; `None` for a built-in one.
    root: Option<PathBuf>,
    /// Identity of that folder, whatever its path.
    identity: Option<String>,
    title: String,
    pairs: Vec<Pair>,
}

#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
struct Pair {
    name: String,
}

impl Manifest {
    fn of(dataset: &Dataset) -> Self {
        Self {
            format: FORMAT.into(),
            version: VERSION,
            root: dataset.root.clone(),
            identity: dataset.location.as_ref().map(|location| location.identity()),
            title: dataset.title.clone(),
            pairs: Vec::new(),
        }
    }

    /// `None` where there is none, or none that can be understood.
    fn read(folder: &Path) -> Option<Self> {
        let manifest: Self = serde_json::from_slice(&files::read(&folder.join(MANIFEST), files::SMALL).ok()?).ok()?;
        (manifest.format == FORMAT && manifest.version == VERSION).then_some(manifest)
    }

    fn is_of(&self, dataset: &Dataset) -> bool {
        let own = Self::of(dataset);
        match (&self.root, &own.root) {
            (None, None) => self.title == own.title,
            (Some(_), Some(_)) => self.root == own.root || self.identity == own.identity,
            _ => false,
        }
    }
}

/// The folder for a data set's labels among those that wait.
fn folder_of(waiting: &Path, dataset: &Dataset) -> PathBuf {
    let mut name = names::label(&dataset.title);
    if let Some(location) = &dataset.location {
        name = format!("{name}-{}", location.identity());
    }
    waiting.join(name)
}

impl Labels {
    /// Keeps labels that could not be written among those that `waiting` holds, until [`recover`] finds them there; their
    /// folder.
    ///
    /// # Errors
    /// If they cannot be written there either.
    pub fn keep_waiting(&self, dataset: &Dataset, unsaved: &[Unsaved], waiting: &Path) -> Result<PathBuf, TaskError> {
        let folder = folder_of(waiting, dataset);
        self.keep_in(dataset, unsaved, &folder)?;
        Ok(folder)
    }

    /// Writes labels that could not be written where they belong into a folder, as the same files: each pair's masks, its review
    /// state, and in its journal what they were before, so that [`take_in`] can tell what is new in them.
    ///
    /// # Errors
    /// If they cannot be written there either.
    pub fn keep_in(&self, dataset: &Dataset, unsaved: &[Unsaved], folder: &Path) -> Result<(), TaskError> {
        const WHAT: &str = "Keep the labels elsewhere";
        let fail = |err: FileError| store_error(WHAT, &err);
        let all = MaskStore::in_folder(folder.to_owned()).of_rig(dataset.rig.clone());
        let _held = all.hold().map_err(fail)?;
        let mut manifest = Manifest::read(folder).unwrap_or_else(|| Manifest::of(dataset));
        for Unsaved { name, labels, deed } in unsaved {
            let by = Signed::now(deed);
            for (place, hand) in &labels.masks {
                by.write_mask(&all, name, place, Some(hand)).map_err(fail)?;
            }
            all.save_review(name, &stored_review(labels)).map_err(fail)?;
            let line = Line::new(deed, &Change::between(&self.known(name), labels), &dataset.rig, by.person, by.unix_s);
            all.append_journal(name, &line).map_err(fail)?;
            manifest.pairs.push(Pair { name: name.clone() });
        }
        manifest.pairs.sort();
        manifest.pairs.dedup();
        // Last: without it nothing is taken in, and with it all of it is there.
        let file = folder.join(MANIFEST);
        atomic::write_json(&file, "cannot write the list of them", &manifest).map_err(fail)
    }
}

/// Takes in what waits for a data set in the folders of `waiting`, and removes those that were taken in whole.
pub fn recover(dataset: &Dataset, labels: &Labels, waiting: &Path) -> Recovered {
    let mut all = Recovered::default();
    let mut folders: Vec<PathBuf> =
        std::fs::read_dir(waiting).map_or_else(|_| Vec::new(), |list| list.flatten().map(|e| e.path()).collect());
    folders.sort();
    for folder in folders {
        if !Manifest::read(&folder).is_some_and(|manifest| manifest.is_of(dataset)) {
            continue;
        }
        match take_in(dataset, labels, &folder) {
            Ok(mut found) => {
                if found.failed.is_empty()
                    && let Err(err) = std::fs::remove_dir_all(&folder)
                {
                    log::warn!("{}: {err}", folder.display());
                }
                all.pairs.append(&mut found.pairs);
                all.failed.append(&mut found.failed);
            }
            Err(err) => all.failed.push(err),
        }
    }
    all
}

/// Takes in labels that were kept in a folder. Masks that somebody else changed meanwhile are merged by pixel; undo takes it
/// back.
///
/// # Errors
/// If the folder holds no such labels.
pub fn take_in(dataset: &Dataset, labels: &Labels, folder: &Path) -> Result<Recovered, TaskError> {
    let what = format!("Take in the labels of {}", folder.display());
    let manifest = Manifest::read(folder).ok_or_else(|| {
        TaskError::new(&what, format!("there is no {MANIFEST} that can be understood"))
            .with_hint("Name a folder that the studio saved labels to when it could not write them beside the data.")
    })?;
    let all = MaskStore::in_folder(folder.to_owned()).of_rig(dataset.rig.clone());
    let mut found = Recovered::default();
    for Pair { name } in &manifest.pairs {
        let one = || {
            if !dataset.index.pairs.iter().any(|entry| entry.name == *name) {
                return Err(TaskError::new(&what, format!("{name} is not a pair of this data set")));
            }
            take_in_pair(labels, &all, name)
        };
        match one() {
            Ok(()) => found.pairs.push(name.clone()),
            Err(err) => {
                let hint = format!("They wait in {}; the next opening tries again.", folder.display());
                found.failed.push(TaskError { hint: Some(hint), ..err });
            }
        }
    }
    Ok(found)
}

fn take_in_pair(labels: &Labels, kept: &MaskStore, name: &str) -> Result<(), TaskError> {
    let what = format!("Take in the labels of {name}");
    let bytes = kept.journal(name).map_err(|err| store_error(&what, &err))?;
    let (mut all, mut person) = (labels.load(name)?, None);
    for line in bytes.split(|&b| b == b'\n').filter(|line| !line.is_empty()) {
        let read =
            serde_json::from_slice::<Line>(line).ok().and_then(|line| Some((line.person(), line.read(kept.rig())?)));
        let (by, (_, past)) = read.ok_or_else(|| {
            let file = kept.journal_file(name);
            TaskError::new(&what, format!("a line of their journal cannot be understood ({})", file.display()))
        })?;
        person = by;
        merge(&mut all, past.change);
    }
    labels.save(name, &all, &Operation { person, ..Operation::named("labels taken in") }).map(drop)
}

/// Makes a change whose labels may have changed meanwhile.
fn merge(now: &mut PairLabels, change: Change) {
    for (place, [before, after]) in change.masks {
        let theirs = now.masks.get(&place);
        let both = match (after, theirs) {
            (after, theirs) if same(theirs, before.as_ref()) => after,
            (Some(ours), Some(theirs)) => Some(ours.merged(before.as_ref(), theirs)),
            (Some(ours), None) => Some(ours),
            // Removed here, changed there.
            (None, theirs) => theirs.cloned(),
        };
        now.put(&place, both);
    }
    if let Some([before, after]) = change.review
        && (now.review == before || !now.review.is_judged())
    {
        now.review = after;
    }
    for (of, [before, after]) in change.accepted {
        if now.accepted.get(&of).copied() == before {
            now.accept(&of, after);
        }
    }
    if let Some([before, after]) = change.note
        && now.note != after
    {
        now.note =
            if now.note == before || now.note.is_empty() { after } else { note(&format!("{}; {after}", now.note)) };
    }
}
