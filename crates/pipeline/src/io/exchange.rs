//! Masks in the forms that other programs read and write ([`Format`]): [`export`] writes them, [`list`] finds them again.
//!
//! Every export has parts (`train`, `val`, `test`) and a file [`MANIFEST`] that lists what was written. Names of files are
//! stems (`split.rs`), from which pair and finger can be told again.
//!
//! | form | image | mask | ignored pixels |
//! | --- | --- | --- | --- |
//! | [`Format::Unet`] | `PART/imgs/STEM.png` | `PART/masks/STEM.png`, 0 and 255 | `PART/ignore/STEM.png`, 255 = ignored |
//! | [`Format::Png`] | | `PART/STEM.png`, 0 and 255 | `PART/STEM.ignore.png` |
//!
//! Images are 8-bit gray: `(imprint + 0.0116) / 0.0341 * 255`, cut to whole numbers, limited to 0..255. A file of ignored
//! pixels is there only where some are. All are in the raw orientation of the data set.

mod format;
mod found;
mod read;
mod split;
mod unet;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::digest::sha256;
use super::files;
use super::images::PictureError;
use super::masks::MaskStore;
use super::staging::{self, Staging};
use touch2touch_core::dataset::Problem;
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::rig::{PadId, Rig};

pub use format::Format;
pub use found::Listed;
pub(crate) use found::ReadError;
pub use read::list;
pub(crate) use split::Stems;
pub use unet::check_folder;

/// The imprint that becomes 0, meters.
pub(crate) const IMAGE_LO_M: f64 = -0.0116;
/// The imprint that becomes 255, meters.
pub(crate) const IMAGE_HI_M: f64 = 0.0225;
/// Names of the parts, in the order of [`ExportReport::counts`].
pub const PARTS: [&str; 3] = ["train", "val", "test"];
/// The folder of the pixels of which masks say nothing.
pub const IGNORED: &str = "ignore";
/// The file that marks a folder as a previous export and lists what it wrote.
pub const MANIFEST: &str = "touch2touch_export.json";

/// Why nothing was exported. The folder is then as it was.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The disk refuses.
    #[error("cannot {what} ({}): {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Failed action, as in "cannot make the folder".
        what: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A picture cannot be written or read again.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The folder holds something else.
    #[error("the folder is not empty and not a previous export: it holds {found} ({})", folder.display())]
    NotOurs {
        /// The folder.
        folder: PathBuf,
        /// The first foreign entry.
        found: String,
    },
    /// Somebody stopped it.
    #[error("the export was stopped")]
    Stopped,
    /// Nothing to export.
    #[error("there is no mask to export")]
    Nothing,
    /// A mask whose size is not the imprint's.
    #[error("the mask of {stem} has {mask:?} pixels, its imprint {imprint:?}")]
    Size {
        /// The stem.
        stem: String,
        /// The mask's size.
        mask: [usize; 2],
        /// The imprint's size.
        imprint: [usize; 2],
    },
    /// Imprints or masks that could not be fetched.
    #[error("nothing was exported: {}", listed(failures))]
    Sources {
        /// Pair and finger, and why; all of them.
        failures: Vec<(String, String)>,
    },
    /// The written folder is not one that the loader accepts, or not the one that was meant.
    #[error("the written folder failed its check: {}", first(problems))]
    Check {
        /// All mismatches.
        problems: Vec<Problem>,
    },
}

fn first(problems: &[Problem]) -> String {
    problems.first().map_or_else(String::new, |p| format!("{} ({})", p.what, p.file.display()))
}

/// One failure as it is, several one below the other.
fn listed(failures: &[(String, String)]) -> String {
    /// A data set of nothing but damaged files still gives a page.
    const MOST: usize = 40;
    let mut lines: Vec<String> = failures.iter().take(MOST).map(|(name, why)| format!("{name}: {why}")).collect();
    if let [only] = lines.as_slice() {
        return only.clone();
    }
    if failures.len() > MOST {
        lines.push(format!("and {} more", failures.len() - MOST));
    }
    format!("{} masks or imprints cannot be read\n- {}", failures.len(), lines.join("\n- "))
}

/// One mask to export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportEntry {
    /// The pair's name; both fingers of a pair land in the same part.
    pub pair: String,
    /// The tool, where known: the loader filters by it as a part of the stem.
    pub tool: Option<String>,
    /// The finger.
    pub finger: PadId,
    /// True where its data set keeps it for tests of a model that was never trained on it.
    pub held_out: bool,
}

/// In which form, and how to divide.
#[derive(Clone, Debug, PartialEq)]
pub struct ExportConfig {
    /// The form.
    pub format: Format,
    /// Decides which pair lands where; the same seed and pairs give the same parts.
    pub seed: u64,
    /// True where all pairs of a tool go to the same part; else each pair goes by itself.
    pub by_tool: bool,
    /// True where held-out pairs are divided like the rest; else they go to test.
    pub held_out_in_train: bool,
    /// The names of the pads.
    pub rig: Arc<Rig>,
}

impl Default for ExportConfig {
    fn default() -> Self {
        Self { format: Format::default(), seed: 0, by_tool: false, held_out_in_train: false, rig: Rig::lab() }
    }
}

/// Counts of an export.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ExportReport {
    /// Masks in train, val and test.
    pub counts: [usize; 3],
    /// Pixels below or above the range of the image; they were limited to it. None where there is no image.
    pub out_of_range_px: usize,
    /// Pixels without measurement; in images they are an imprint of 0.
    pub unmeasured_px: usize,
}

#[derive(Serialize, Deserialize)]
struct Manifest {
    format: String,
    version: u32,
    /// The form of the masks.
    masks: Format,
    seed: u64,
    /// Relative path to the SHA-256 of the file.
    files: BTreeMap<String, String>,
    /// Stem to pair and finger: the loader allows few characters in a stem, so that a name cannot be read from it.
    #[serde(default)]
    stems: BTreeMap<String, (String, String)>,
}

const FORMAT: &str = "touch2touch-unet-export";

impl Manifest {
    /// Manifest of a folder; `None` if it is no export.
    fn read(folder: &Path) -> Option<Self> {
        let bytes = files::read(&folder.join(MANIFEST), files::SMALL).ok()?;
        serde_json::from_slice(&bytes).ok().filter(|manifest: &Self| manifest.format == FORMAT)
    }
}

/// Reads every stored mask of `entries`, before anything is computed for the others.
///
/// # Errors
/// [`ExportError::Sources`] with all that cannot be read.
pub(crate) fn check_stored<'a>(
    store: &MaskStore,
    entries: impl IntoIterator<Item = &'a ExportEntry>,
) -> Result<(), ExportError> {
    let failure = |entry: &ExportEntry| {
        let err = store.load(&entry.pair, entry.finger).err()?;
        Some((place(entry, store.rig()), format!("{err}; {}", err.hint())))
    };
    let failures: Vec<_> = entries.into_iter().filter_map(failure).collect();
    if failures.is_empty() { Ok(()) } else { Err(ExportError::Sources { failures }) }
}

fn place(entry: &ExportEntry, rig: &Rig) -> String {
    format!("{}, {} finger", entry.pair, rig.pad_key(entry.finger))
}

/// Why an imprint or a mask was not fetched.
#[derive(Debug)]
pub enum LoadFailure {
    /// It cannot be read or made, in words; the others are still looked at.
    Bad(String),
    /// Somebody stopped the export.
    Stop,
}

impl<E: std::fmt::Display> From<E> for LoadFailure {
    fn from(err: E) -> Self {
        Self::Bad(err.to_string())
    }
}

/// Pixels that are written of one entry; all pictures are of one size.
#[derive(Clone, Debug, PartialEq)]
pub struct Content {
    /// Meters, raw orientation.
    pub imprint: DepthMap,
    /// The contact.
    pub mask: Mask,
    /// Pixels of which the mask says nothing; `None` = it speaks of all.
    pub ignored: Option<Mask>,
}

/// Number of `entries` that go to each of [`PARTS`].
pub fn counts(entries: &[ExportEntry], config: &ExportConfig) -> [usize; 3] {
    let mut counts = [0; 3];
    split::parts(entries, config).into_iter().for_each(|part| counts[part] += 1);
    counts
}

/// Writes `entries` to `folder`; `load(i)` gives the content of `entries[i]`.
///
/// Everything is written and checked in a new folder beside `folder` and put in its place only when it is right; a
/// previous export there is replaced. Same entries, config and content: same bytes.
///
/// # Errors
/// [`ExportError`]; then `folder` is as it was.
pub fn export(
    folder: &Path,
    entries: &[ExportEntry],
    config: &ExportConfig,
    mut load: impl FnMut(usize) -> Result<Content, LoadFailure>,
) -> Result<ExportReport, ExportError> {
    if entries.is_empty() {
        return Err(ExportError::Nothing);
    }
    let folder = std::path::absolute(folder).map_err(|s| io(folder, "find the folder", s))?;
    refuse_foreign(&folder)?;
    let parts = split::parts(entries, config);
    let stems = split::stems(entries, &config.rig);
    let parent = folder.parent().unwrap_or(&folder).to_owned();
    std::fs::create_dir_all(&parent).map_err(|s| io(&parent, "make the folder", s))?;
    staging::sweep(&parent);
    let staging = Staging::new(&folder).map_err(|s| io(&parent, "make a folder in", s))?;
    let root = staging.new_content();
    for folder in PARTS.map(|part| root.join(part)) {
        match config.format {
            Format::Unet => ["imgs", "masks"].iter().try_for_each(|kind| make_folder(&folder.join(kind)))?,
            Format::Png => make_folder(&folder)?,
        }
    }
    let mut report = ExportReport::default();
    let source = |entry: &ExportEntry| (entry.pair.clone(), config.rig.pad_key(entry.finger).into_owned());
    let mut manifest = Manifest {
        format: FORMAT.into(),
        version: 1,
        masks: config.format,
        seed: config.seed,
        files: BTreeMap::new(),
        stems: stems.iter().cloned().zip(entries.iter().map(source)).collect(),
    };
    let mut written = BTreeMap::new();
    let mut failures = Vec::new();
    for (i, (stem, &part)) in stems.iter().zip(&parts).enumerate() {
        let mut content = match load(i) {
            Ok(content) => content,
            Err(LoadFailure::Bad(reason)) => {
                failures.push((place(&entries[i], &config.rig), reason));
                continue;
            }
            Err(LoadFailure::Stop) => return Err(ExportError::Stopped),
        };
        // What follows only looks for what else is wrong.
        if !failures.is_empty() {
            continue;
        }
        let size = content.imprint.size();
        for mask in std::iter::once(&content.mask).chain(&content.ignored) {
            if mask.size() != size {
                return Err(ExportError::Size { stem: stem.clone(), mask: mask.size(), imprint: size });
            }
        }
        content.ignored = content.ignored.filter(|ignored| ignored.as_slice().contains(&true));
        report.counts[part] += 1;
        let to = root.join(PARTS[part]);
        match config.format {
            Format::Unet => unet::write(&to, stem, &content, &mut report),
            Format::Png => format::write_masks(&to, stem, &content),
        }
        .map_err(|err| meant(err, &root, &folder))?;
        written.insert(stem.clone(), digest(&content.mask, content.ignored.as_ref()));
    }
    if !failures.is_empty() {
        return Err(ExportError::Sources { failures });
    }
    let problems = check_written(&root, config.format, written);
    if !problems.is_empty() {
        return Err(meant(ExportError::Check { problems }, &root, &folder));
    }
    let mut files = Vec::new();
    find(&root, &root, &mut files).map_err(|s| io(&root, "list the folder", s))?;
    for relative in files {
        let path = root.join(&relative);
        let bytes = files::read(&path, files::MODEL).map_err(|s| io(&path, "read", s))?;
        manifest.files.insert(relative, sha256(&bytes));
    }
    let path = root.join(MANIFEST);
    let text = serde_json::to_vec_pretty(&manifest).map_err(|err| io(&path, "write", err.into()))?;
    super::atomic::write_bytes(&path, &text).map_err(|s| io(&path, "write", s))?;
    // Once more, in case something appeared while the masks were computed.
    refuse_foreign(&folder)?;
    staging.put(&folder).map_err(|source| io(&folder, "put the export to", source))?;
    Ok(report)
}

fn io(path: &Path, what: &'static str, source: std::io::Error) -> ExportError {
    ExportError::Io { path: path.to_owned(), what, source }
}

fn make_folder(path: &Path) -> Result<(), ExportError> {
    std::fs::create_dir_all(path).map_err(|source| io(path, "make the folder", source))
}

/// A failed check that names files where they would have come to lie, in `folder`, instead of where they were made.
fn meant(err: ExportError, root: &Path, folder: &Path) -> ExportError {
    let ExportError::Check { problems } = err else { return err };
    let moved = |file: PathBuf| file.strip_prefix(root).map(|f| folder.join(f)).unwrap_or(file);
    let problems = problems.into_iter().map(|p| Problem { file: moved(p.file), ..p }).collect();
    ExportError::Check { problems }
}

/// SHA-256 of a mask's size and pixels with its ignored pixels, which tells it from all others.
fn digest(mask: &Mask, ignored: Option<&Mask>) -> String {
    let [width, height] = mask.size();
    let bits = |mask: &Mask| mask.as_slice().iter().map(|&v| u8::from(v)).collect::<Vec<_>>();
    let ignored = ignored.map(bits).unwrap_or_default();
    sha256(&[&width.to_le_bytes()[..], &height.to_le_bytes(), &bits(mask), &ignored].concat())
}

/// Reads what was written by the rules of its loader: each of `written` (stem to [`digest`]) must be there and the same, and
/// nothing else.
fn check_written(root: &Path, format: Format, mut written: BTreeMap<String, String>) -> Vec<Problem> {
    let problem = |file: &Path, what: String| Problem {
        file: file.to_owned(),
        what,
        hint: "check the disk, and export again".into(),
    };
    let mut problems = if format == Format::Unet { check_folder(root).problems } else { Vec::new() };
    let listing = match list(root, Some(format)) {
        Ok(listing) => listing,
        Err(err) => return vec![problem(&err.file, err.what)],
    };
    problems.extend(listing.refused.iter().map(|err| problem(&err.file, err.what.clone())));
    for listed in &listing.masks {
        let expected = written.remove(&listed.stem);
        match listed.read() {
            Err(err) => problems.push(problem(&err.file, err.what)),
            Ok((mask, ignored)) if expected != Some(digest(&mask, ignored.as_ref())) => {
                problems.push(problem(&listed.file, format!("the mask of {} reads back differently", listed.stem)));
            }
            Ok(_) => {}
        }
    }
    problems.extend(written.into_keys().map(|stem| problem(root, format!("the mask of {stem} is not there"))));
    problems
}

/// An existing folder must be empty, or hold exactly what its manifest says.
fn refuse_foreign(folder: &Path) -> Result<(), ExportError> {
    let mut files = Vec::new();
    match find(folder, folder, &mut files) {
        Ok(()) => {}
        Err(err) if err.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(source) => return Err(io(folder, "list the folder", source)),
    }
    let known = Manifest::read(folder).map(|manifest| manifest.files).unwrap_or_default();
    let is_manifest = |file: &str| file == MANIFEST && !known.is_empty();
    match files.into_iter().find(|file| !known.contains_key(file) && !is_manifest(file)) {
        Some(found) => Err(ExportError::NotOurs { folder: folder.to_owned(), found }),
        None => Ok(()),
    }
}

/// All files below `folder`, relative to `root`, with `/`. Links are files: they are never followed.
fn find(root: &Path, folder: &Path, out: &mut Vec<String>) -> std::io::Result<()> {
    let mut entries: Vec<_> = std::fs::read_dir(folder)?.collect::<Result<_, _>>()?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        if entry.file_type()?.is_dir() {
            find(root, &path, out)?;
        } else {
            let relative = path.strip_prefix(root).unwrap_or(&path);
            let parts: Vec<String> = relative.iter().map(|p| p.to_string_lossy().into_owned()).collect();
            out.push(parts.join("/"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use strum::IntoEnumIterator as _;

    use super::*;
    use touch2touch_core::rig::lab;

    /// Another mask, a mask that is gone, and one that nobody wrote are told with their files.
    #[test]
    fn what_is_not_what_was_written_is_found_in_every_form() {
        let dir = tempfile::tempdir().unwrap();
        let entries: Vec<ExportEntry> = (0..3)
            .map(|i| ExportEntry { pair: format!("data_{i}"), tool: None, finger: lab::RIGHT, held_out: false })
            .collect();
        let mask = |i: usize| Mask::from_fn(9, 7, |x, y| x > i && y > 2);
        let content = |i: usize| Content {
            imprint: DepthMap::filled(9, 7, 0.003),
            mask: mask(i),
            ignored: (i == 1).then(|| Mask::from_fn(9, 7, |x, _| x == 0)),
        };
        for format in Format::iter() {
            let folder = dir.path().join(format.key());
            let config = ExportConfig { format, ..ExportConfig::default() };
            export(&folder, &entries, &config, |i| Ok(content(i))).unwrap();
            let stems = split::stems(&entries, &config.rig);
            let written = |i: usize| (stems[i].clone(), digest(&mask(i), content(i).ignored.as_ref()));
            let check = |which: &[usize]| check_written(&folder, format, which.iter().map(|&i| written(i)).collect());
            assert_eq!(check(&[0, 1, 2]), [], "{format:?}");
            assert!(check(&[0, 1])[0].what.contains("reads back differently"), "nobody wrote the third");
            let extra = BTreeMap::from([0, 1, 2].map(written)).into_iter().chain([("gone".to_owned(), String::new())]);
            let gone = check_written(&folder, format, extra.collect());
            assert!(gone.len() == 1 && gone[0].what.contains("the mask of gone is not there"), "{gone:?}");
            let (other, stem) = (format::gray(&mask(5)), &stems[2]);
            let name = match format {
                Format::Unet => format!("masks/{stem}.png"),
                Format::Png => format!("{stem}.png"),
            };
            let file = PARTS.map(|part| folder.join(part).join(&name)).into_iter().find(|file| file.is_file()).unwrap();
            crate::io::images::write_gray8(&file, &other).unwrap();
            let found = check(&[0, 1, 2]);
            assert!(found.len() == 1 && found[0].file == file, "{format:?}: {found:?}");
            let err = meant(ExportError::Check { problems: found }, &folder, Path::new("/there"));
            let name = file.file_name().unwrap().to_str().unwrap();
            assert!(err.to_string().contains("/there/") && err.to_string().contains(name), "{err}");
        }
    }
}
