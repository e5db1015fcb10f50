//! Corrected masks on disk: saved after every stroke, never half, never replaced by something empty.
//!
//! One folder per data set, beside it (`touch2touch_masks`) if that can be written, else in the user's data folder.
//! Per pair and finger one JSON file with the run-length coded mask of the measured imprint, and one with those of
//! predictions; per pair one with the review state and accepted poses, and one append-only journal of what was done.
//! Files are written beside their place, flushed and renamed, so a
//! crash costs at most the stroke that was being saved.
//!
//! A file that cannot be understood blocks its pair: it is reported, and nothing overwrites it.

mod journal;

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::dataset::Dataset;
use super::dataset_location::DatasetLocation;
use super::digest::sha256;
use super::error::FileError;
use super::predicted_id::PredictedId;
use super::{atomic, files, folders, names};
use touch2touch_core::dataset::Problem;
use touch2touch_core::grid::Mask;
use touch2touch_core::label::{Marks, PackedMask};
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::rig::{PadId, Rig};

/// Name of the folder beside a data set.
pub const FOLDER: &str = "touch2touch_masks";
const FORMAT: &str = "touch2touch-mask";
const REVIEW_FORMAT: &str = "touch2touch-review";
/// Masks, which say where each pixel comes from.
const MASK_VERSION: u32 = 2;
/// Reviews; those that say less were written as versions from 1 on, and are read alike.
const REVIEW_VERSION: u32 = 4;
const MASK_SUFFIX: &str = ".mask.json";
const PREDICTED_SUFFIX: &str = ".predicted.json";
const PREDICTED_FORMAT: &str = "touch2touch-predicted-masks";
const REVIEW_SUFFIX: &str = ".review.json";

/// A stored mask with where it came from.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredMask {
    /// The contact, raw bubble orientation, as large as the imprint.
    pub mask: Mask,
    /// Origin of each pixel, and the ignored pixels.
    pub marks: Marks,
    /// Who saved it.
    pub person: String,
    /// When, seconds since 1970 (UTC); see [`now_unix_s`].
    pub saved_unix_s: u64,
}

/// A value for each imprint of a pair that has one, as files hold it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound(deserialize = "T: serde::de::DeserializeOwned"))]
pub struct ByImprint<T> {
    /// Value of the measured imprint, and value of a prediction by no known generator.
    #[serde(default = "neither")]
    pub accepted: [Option<T>; 2],
    /// Values of predictions, by the prediction.
    #[serde(default = "BTreeMap::new", skip_serializing_if = "BTreeMap::is_empty")]
    pub accepted_predicted: BTreeMap<PredictedId, T>,
}

fn neither<T>() -> [Option<T>; 2] {
    [None, None]
}

impl<T> Default for ByImprint<T> {
    fn default() -> Self {
        Self { accepted: neither(), accepted_predicted: BTreeMap::new() }
    }
}

impl<T> ByImprint<T> {
    /// All values.
    pub fn values(&self) -> impl Iterator<Item = &T> {
        self.accepted.iter().flatten().chain(self.accepted_predicted.values())
    }
}

/// Review of a pair: its state, accepted poses and note.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StoredReview {
    /// The review state by its stored name (e.g. `done`).
    pub review: String,
    /// Accepted `grasp_from_object`.
    #[serde(flatten)]
    pub accepted: ByImprint<AcceptedPose>,
    /// Note that a person wrote about the pair; empty for none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
}

/// Seconds since 1970, for [`StoredMask::saved_unix_s`]; 0 if the clock is set before that.
pub(crate) fn now_unix_s() -> u64 {
    std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |d| d.as_secs())
}

/// The user's name as the system knows it, for [`StoredMask::person`].
pub fn person() -> Option<String> {
    ["USER", "LOGNAME", "USERNAME"].iter().find_map(|v| std::env::var(v).ok()).filter(|name| !name.is_empty())
}

/// The file of one mask.
#[derive(Serialize, Deserialize)]
struct MaskFile {
    format: String,
    version: u32,
    pair: String,
    finger: String,
    person: String,
    saved_unix_s: u64,
    /// Pixels in contact: checked against the runs.
    contact_px: usize,
    #[serde(flatten)]
    mask: PackedMask,
}

/// The masks of one finger that were drawn on predictions, each with the prediction that it belongs to.
#[derive(Default, Serialize, Deserialize)]
struct PredictedFile {
    format: String,
    version: u32,
    pair: String,
    finger: String,
    masks: Vec<PredictedMask>,
}

#[derive(Serialize, Deserialize)]
struct PredictedMask {
    of: PredictedId,
    person: String,
    saved_unix_s: u64,
    #[serde(flatten)]
    mask: PackedMask,
}

#[derive(Serialize, Deserialize)]
struct ReviewFile {
    format: String,
    version: u32,
    pair: String,
    #[serde(flatten)]
    review: StoredReview,
}

/// The labels of one data set. Cheap to clone; may be used from any thread, one writer at a time.
#[derive(Clone, Debug)]
pub struct MaskStore {
    /// Folder that files are written to; it is also read first.
    folder: PathBuf,
    /// A folder that is only read: labels beside a data set that cannot be written.
    also_read: Option<PathBuf>,
    /// The names of the pads.
    rig: Arc<Rig>,
    /// The data set's folder, without which nothing is written: a path where another one lies, or none, is not the place.
    location: Option<DatasetLocation>,
}

impl MaskStore {
    /// Finds the store of a data set. Nothing is created before the first save.
    ///
    /// # Errors
    /// [`FileError`] if neither the data set's folder nor the user's data folder can be written.
    pub fn for_dataset(dataset: &Dataset) -> Result<Self, FileError> {
        let key = match &dataset.root {
            Some(root) => {
                // The path is part of the name: data sets often share their last folder's name.
                let name = root.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                format!("{}-{}", names::label(&name), &sha256(root.as_os_str().as_encoded_bytes())[..12])
            }
            None => names::label(&dataset.title),
        };
        let user = folders::data().map(|folder| folder.join("masks").join(key));
        let (rig, location) = (dataset.rig.clone(), dataset.location.clone());
        // What lies at its path now says nothing about it.
        if let Some(gone) = location.as_ref().filter(|location| location.check().is_err()) {
            return Ok(Self { folder: gone.root().join(FOLDER), also_read: None, rig, location });
        }
        Ok(Self { rig, location, ..Self::choose(dataset.root.as_deref(), user)? })
    }

    /// [`MaskStore::for_dataset`] with the two places given, for the lab's rig.
    ///
    /// # Errors
    /// As there.
    pub fn choose(dataset_root: Option<&Path>, user_folder: Option<PathBuf>) -> Result<Self, FileError> {
        let is_writable = |folder: &Path| atomic::probe(folder).is_ok();
        let beside = dataset_root.map(|root| root.join(FOLDER));
        if let (Some(beside), Some(root)) = (&beside, dataset_root)
            && is_writable(if beside.is_dir() { beside } else { root })
        {
            // Labels made while the data set was read-only stay visible.
            let also_read = user_folder.filter(|folder| folder.is_dir());
            return Ok(Self { folder: beside.clone(), also_read, rig: Rig::lab(), location: None });
        }
        let mut tried: Vec<String> = beside.iter().map(|p| p.display().to_string()).collect();
        if let Some(user) = user_folder {
            let there = user.ancestors().find(|folder| folder.is_dir());
            if there.is_some_and(is_writable) {
                let also_read = beside.filter(|folder| folder.is_dir());
                return Ok(Self { folder: user, also_read, rig: Rig::lab(), location: None });
            }
            tried.push(user.display().to_string());
        }
        let hint = "make one of these folders writable, or set XDG_DATA_HOME to one that is";
        Err(FileError::new("", format!("no folder for masks can be written; tried {}", tried.join(", ")), hint))
    }

    /// A store in a given folder, for the lab's rig.
    pub fn in_folder(folder: PathBuf) -> Self {
        Self { folder, also_read: None, rig: Rig::lab(), location: None }
    }

    /// Store in the same folder, for other sensors.
    #[must_use]
    pub(crate) fn of_rig(self, rig: Arc<Rig>) -> Self {
        Self { rig, ..self }
    }

    /// Folder that files are written to.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The sensors whose pads the masks are of.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    fn mask_name(&self, pair: &str, finger: PadId, suffix: &str) -> String {
        format!("{}.{}{suffix}", names::label(pair), self.rig.pad_key(finger))
    }

    /// The file of a mask, whether it exists or not.
    pub fn mask_file(&self, pair: &str, finger: PadId) -> PathBuf {
        self.folder.join(self.mask_name(pair, finger, MASK_SUFFIX))
    }

    /// Reads a mask; `None` if none was saved.
    ///
    /// # Errors
    /// [`FileError`]: then the pair must not be edited.
    pub fn load(&self, pair: &str, finger: PadId) -> Result<Option<StoredMask>, FileError> {
        let Some((file, bytes)) = self.find(&self.mask_name(pair, finger, MASK_SUFFIX))? else { return Ok(None) };
        parse_mask(&file, &bytes, pair, &self.rig.pad_key(finger)).map(Some)
    }

    /// Saves a mask; `None` removes the file (undo back to "never corrected").
    ///
    /// # Errors
    /// [`FileError`] if the file that is there cannot be understood: it is not overwritten.
    /// If the disk refuses, the previous file is unchanged.
    pub fn save(&self, pair: &str, finger: PadId, mask: Option<&StoredMask>) -> Result<(), FileError> {
        self.load(pair, finger)?;
        let file = self.mask_file(pair, finger);
        let Some(stored) = mask else {
            self.at_home()?;
            return match std::fs::remove_file(&file) {
                Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                    Err(refused(&file, "remove the mask", source))
                }
                _ => Ok(()),
            };
        };
        let content = MaskFile {
            format: FORMAT.into(),
            version: MASK_VERSION,
            pair: pair.into(),
            finger: self.rig.pad_key(finger).into(),
            person: stored.person.clone(),
            saved_unix_s: stored.saved_unix_s,
            contact_px: contact_px(&stored.mask),
            mask: PackedMask::pack(&stored.mask, &stored.marks),
        };
        self.write(&file, &content)
    }

    /// Reads the masks drawn on predictions of a finger, with what each prediction is.
    ///
    /// # Errors
    /// As [`MaskStore::load`].
    pub fn load_predicted(&self, pair: &str, finger: PadId) -> Result<Vec<(PredictedId, StoredMask)>, FileError> {
        let Some((file, bytes)) = self.find(&self.mask_name(pair, finger, PREDICTED_SUFFIX))? else {
            return Ok(Vec::new());
        };
        let damaged = |reason: String| damaged(&file, &reason);
        let content: PredictedFile = serde_json::from_slice(&bytes).map_err(|err| damaged(err.to_string()))?;
        check_format(&file, &content.format, PREDICTED_FORMAT, content.version, MASK_VERSION..=MASK_VERSION)?;
        if content.pair != pair || content.finger != self.rig.pad_key(finger) {
            return Err(damaged(format!("it belongs to the {} finger of {}", content.finger, content.pair)));
        }
        let stored = |PredictedMask { of, person, saved_unix_s, mask }| {
            let (mask, marks) = mask.unpack().map_err(|err| damaged(err.to_string()))?;
            Ok((of, StoredMask { mask, marks, person, saved_unix_s }))
        };
        content.masks.into_iter().map(stored).collect()
    }

    /// Saves the mask drawn on the prediction `of`, beside those of other predictions; `None` removes it.
    ///
    /// # Errors
    /// As [`MaskStore::save`].
    pub fn save_predicted(
        &self,
        pair: &str,
        finger: PadId,
        of: &PredictedId,
        mask: Option<&StoredMask>,
    ) -> Result<(), FileError> {
        let mut all = self.load_predicted(pair, finger)?;
        all.retain(|(other, _)| other != of);
        all.extend(mask.map(|mask| (of.clone(), mask.clone())));
        let file = self.folder.join(self.mask_name(pair, finger, PREDICTED_SUFFIX));
        if all.is_empty() && !file.exists() {
            return Ok(());
        }
        let one = |(of, stored): (PredictedId, StoredMask)| PredictedMask {
            of,
            mask: PackedMask::pack(&stored.mask, &stored.marks),
            person: stored.person,
            saved_unix_s: stored.saved_unix_s,
        };
        let content = PredictedFile {
            format: PREDICTED_FORMAT.into(),
            version: MASK_VERSION,
            pair: pair.into(),
            finger: self.rig.pad_key(finger).into(),
            masks: all.into_iter().map(one).collect(),
        };
        self.write(&file, &content)
    }

    /// Reads the review state and accepted poses; `None` if none were saved.
    ///
    /// # Errors
    /// As [`MaskStore::load`].
    pub fn load_review(&self, pair: &str) -> Result<Option<StoredReview>, FileError> {
        let Some((file, bytes)) = self.find(&review_name(pair))? else { return Ok(None) };
        let content = parse_review(&file, &bytes)?;
        if content.pair != pair {
            return Err(damaged(&file, &format!("it belongs to the pair {}", content.pair)));
        }
        Ok(Some(content.review))
    }

    /// Saves the review state and accepted poses.
    ///
    /// # Errors
    /// As [`MaskStore::save`].
    pub fn save_review(&self, pair: &str, review: &StoredReview) -> Result<(), FileError> {
        self.load_review(pair)?;
        let (format, version) = (REVIEW_FORMAT.into(), REVIEW_VERSION);
        let content = ReviewFile { format, version, pair: pair.into(), review: review.clone() };
        self.write(&self.folder.join(review_name(pair)), &content)
    }

    /// All review states, by pair name, and the files that cannot be understood (masks among them).
    pub fn reviews(&self) -> (Vec<(String, StoredReview)>, Vec<Problem>) {
        let mut reviews = Vec::new();
        let mut problems = Vec::new();
        for file in self.files_ending(REVIEW_SUFFIX) {
            match read(&file).and_then(|bytes| parse_review(&file, &bytes)) {
                Ok(content) => reviews.push((content.pair, content.review)),
                Err(err) => problems.push(err.to_problem()),
            }
        }
        reviews.sort_by(|a, b| a.0.cmp(&b.0));
        // The first one read is the one of the folder that is written.
        reviews.dedup_by(|later, first| later.0 == first.0);
        (reviews, problems)
    }

    /// All saved masks as pair name and finger, sorted; their content is not read.
    pub fn masks(&self) -> Vec<(String, PadId)> {
        let mut masks = Vec::new();
        for file in self.files_ending(MASK_SUFFIX) {
            let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            let stem = name.strip_suffix(MASK_SUFFIX).unwrap_or(&name);
            for finger in self.rig.pads() {
                if let Some(pair) = stem.strip_suffix(&*self.rig.pad_key(finger)).and_then(|s| s.strip_suffix('.')) {
                    // A name too long to be its own file name is in the file.
                    let pair = names::pair_of_label(pair).or_else(|| {
                        let content: MaskFile = serde_json::from_slice(&read(&file).ok()?).ok()?;
                        Some(content.pair)
                    });
                    masks.extend(pair.map(|pair| (pair, finger)));
                }
            }
        }
        masks.sort();
        masks.dedup();
        masks
    }

    /// Checks that the data set is still there.
    fn at_home(&self) -> Result<(), FileError> {
        self.location.as_ref().map_or(Ok(()), DatasetLocation::check)
    }

    /// Makes the folder where it is missing; never the data set's own.
    fn make_folder(&self, what: &'static str) -> Result<(), FileError> {
        self.at_home()?;
        std::fs::create_dir_all(&self.folder).map_err(|err| refused(&self.folder, what, err))
    }

    fn folders(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(self.folder.as_path()).chain(self.also_read.as_deref())
    }

    /// The first file of that name, with its content.
    fn find(&self, name: &str) -> Result<Option<(PathBuf, Vec<u8>)>, FileError> {
        for folder in self.folders() {
            let file = folder.join(name);
            match files::read(&file, files::SMALL) {
                Ok(bytes) => return Ok(Some((file, bytes))),
                Err(err) if err.kind() == std::io::ErrorKind::NotFound => {}
                // The folder's name is taken by a file: nothing was saved there.
                Err(err) if err.kind() == std::io::ErrorKind::NotADirectory => {}
                Err(err) => return Err(refused(&file, READ, err)),
            }
        }
        Ok(None)
    }

    fn files_ending(&self, suffix: &str) -> Vec<PathBuf> {
        let mut files = Vec::new();
        for folder in self.folders() {
            let Ok(entries) = std::fs::read_dir(folder) else { continue };
            let here = entries.flatten().map(|entry| entry.path()).filter(|path| {
                let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                name.ends_with(suffix) && !name.starts_with('.')
            });
            files.extend(here);
        }
        files
    }

    fn write(&self, file: &Path, content: &impl Serialize) -> Result<(), FileError> {
        let io = |err| refused(file, "save the labels", err);
        self.make_folder("save the labels")?;
        let mut bytes = serde_json::to_vec(content).map_err(|err| io(err.into()))?;
        bytes.push(b'\n');
        atomic::write_bytes(file, &bytes).map_err(io)
    }
}

const READ: &str = "read the stored labels";

pub(super) fn refused(file: &Path, what: &str, err: std::io::Error) -> FileError {
    let hint = "check the permissions and the free space of the disk";
    FileError { hint, ..FileError::io(file, &format!("cannot {what}"), err) }
}

/// The error of a file that cannot be understood: it is left as it is, and its pair must not be edited.
fn damaged(file: &Path, reason: &str) -> FileError {
    let what = format!("the stored labels cannot be read, so this pair cannot be edited: {reason}");
    FileError::new(file, what, "restore the file from a backup, or move it away to start this mask anew")
}

fn review_name(pair: &str) -> String {
    format!("{}{REVIEW_SUFFIX}", names::label(pair))
}

fn read(file: &Path) -> Result<Vec<u8>, FileError> {
    files::read(file, files::SMALL).map_err(|err| refused(file, READ, err))
}

fn parse_mask(file: &Path, bytes: &[u8], pair: &str, finger: &str) -> Result<StoredMask, FileError> {
    let damaged = |reason: String| damaged(file, &reason);
    let content: MaskFile = serde_json::from_slice(bytes).map_err(|err| damaged(err.to_string()))?;
    check_format(file, &content.format, FORMAT, content.version, MASK_VERSION..=MASK_VERSION)?;
    if content.pair != pair || content.finger != finger {
        return Err(damaged(format!("it belongs to the {} finger of {}", content.finger, content.pair)));
    }
    let (mask, marks) = content.mask.unpack().map_err(|err| damaged(err.to_string()))?;
    let contact = contact_px(&mask);
    if contact != content.contact_px {
        return Err(damaged(format!("it has {contact} pixels in contact and says {}", content.contact_px)));
    }
    Ok(StoredMask { mask, marks, person: content.person, saved_unix_s: content.saved_unix_s })
}

fn contact_px(mask: &Mask) -> usize {
    mask.as_slice().iter().filter(|&&v| v).count()
}

fn parse_review(file: &Path, bytes: &[u8]) -> Result<ReviewFile, FileError> {
    let content: ReviewFile = serde_json::from_slice(bytes).map_err(|err| damaged(file, &err.to_string()))?;
    check_format(file, &content.format, REVIEW_FORMAT, content.version, 1..=REVIEW_VERSION)?;
    if content.review.accepted.values().any(|a| !a.pose.is_finite()) {
        return Err(damaged(file, "an accepted pose is not a finite number"));
    }
    Ok(content)
}

fn check_format(
    file: &Path,
    format: &str,
    expected: &str,
    version: u32,
    known: RangeInclusive<u32>,
) -> Result<(), FileError> {
    if format == expected && known.contains(&version) {
        return Ok(());
    }
    let reason = format!("it is {format} version {version}, expected {expected} up to version {}", known.end());
    Err(damaged(file, &reason))
}
