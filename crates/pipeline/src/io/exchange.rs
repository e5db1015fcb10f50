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
use std::path::Path;

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

use super::digest::sha256;
use super::error::FileError;
use super::files;
use super::masks::MaskStore;
use super::staging::{self, Staging};
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::rig::{PadId, Rig};

pub use format::Format;
pub use found::Listed;
pub use read::list;
pub(crate) use split::Stems;

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

/// Pairs that go along, by their review state. Pairs marked *skip* or *flagged* never do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, EnumIter, EnumString, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Which {
    /// Pairs marked *done* that have a mask drawn by hand.
    #[default]
    Done,
    /// Pairs as above, and pairs whose mask was begun.
    Begun,
    /// All pairs; the masks that nobody drew are made (`--mask`).
    All,
}

impl Which {
    /// The name on the command line.
    pub fn key(self) -> &'static str {
        self.into()
    }
}

/// Choices that a person has for an export.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ExportChoice {
    /// Pairs, by review state.
    pub which: Which,
    /// True where pairs that the data set keeps for tests (`test_only`) are divided like the rest; else they go to
    /// test.
    pub test_in_train: bool,
    /// True where all pairs of a tool go to the same part.
    pub by_tool: bool,
    /// True where only pixels that a person painted count; all others are ignored.
    pub manual_checked: bool,
    /// Decides which pair lands in which part.
    pub seed: u64,
    /// In which form.
    pub format: Format,
}

/// Counts of an export.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ExportReport {
    /// Masks in train, val and test.
    #[serde(skip)]
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
/// [`FileError`] with all that cannot be read.
pub(crate) fn check_stored<'a>(
    store: &MaskStore,
    entries: impl IntoIterator<Item = &'a ExportEntry>,
) -> Result<(), FileError> {
    let failure = |entry: &ExportEntry| {
        let err = store.load(&entry.pair, entry.finger).err()?;
        Some((place(entry, store.rig()), format!("{err}; {}", err.hint)))
    };
    let failures: Vec<_> = entries.into_iter().filter_map(failure).collect();
    if failures.is_empty() { Ok(()) } else { Err(sources(&failures)) }
}

fn place(entry: &ExportEntry, rig: &Rig) -> String {
    format!("{}, {} finger", entry.pair, rig.pad_key(entry.finger))
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
pub fn counts(entries: &[ExportEntry], choice: &ExportChoice) -> [usize; 3] {
    let mut counts = [0; 3];
    split::parts(entries, choice).into_iter().for_each(|part| counts[part] += 1);
    counts
}

/// Writes `entries` to `folder`; `load(i)` gives the content of `entries[i]`.
///
/// Everything is written and checked in a new folder beside `folder` and put in its place only when it is right; a
/// previous export there is replaced. Same entries, choices and content: same bytes.
///
/// # Errors
/// [`FileError`]; then `folder` is as it was.
pub fn export(
    folder: &Path,
    entries: &[ExportEntry],
    choice: &ExportChoice,
    rig: &Rig,
    mut load: impl FnMut(usize) -> anyhow::Result<Content>,
) -> Result<ExportReport, FileError> {
    if entries.is_empty() {
        return Err(FileError::new(folder, "there is no mask to export", ""));
    }
    let folder = std::path::absolute(folder).map_err(|s| io(folder, "find the folder", s))?;
    refuse_foreign(&folder)?;
    let parts = split::parts(entries, choice);
    let stems = split::stems(entries, rig);
    let parent = folder.parent().unwrap_or(&folder).to_owned();
    std::fs::create_dir_all(&parent).map_err(|s| io(&parent, "make the folder", s))?;
    staging::sweep(&parent);
    let staging = Staging::new(&folder).map_err(|s| io(&parent, "make a folder in", s))?;
    let root = staging.new_content();
    for folder in PARTS.map(|part| root.join(part)) {
        match choice.format {
            Format::Unet => ["imgs", "masks"].iter().try_for_each(|kind| make_folder(&folder.join(kind)))?,
            Format::Png => make_folder(&folder)?,
        }
    }
    let mut report = ExportReport::default();
    let source = |entry: &ExportEntry| (entry.pair.clone(), rig.pad_key(entry.finger).into_owned());
    let mut manifest = Manifest {
        format: FORMAT.into(),
        version: 1,
        masks: choice.format,
        seed: choice.seed,
        files: BTreeMap::new(),
        stems: stems.iter().cloned().zip(entries.iter().map(source)).collect(),
    };
    let mut written = BTreeMap::new();
    let mut failures = Vec::new();
    for (i, (stem, &part)) in stems.iter().zip(&parts).enumerate() {
        let mut content = match load(i) {
            Ok(content) => content,
            Err(err) => {
                failures.push((place(&entries[i], rig), err.to_string()));
                continue;
            }
        };
        // What follows only looks for what else is wrong.
        if !failures.is_empty() {
            continue;
        }
        let size = content.imprint.size();
        for mask in std::iter::once(&content.mask).chain(&content.ignored) {
            if mask.size() != size {
                let what = format!("the mask of {stem} has {:?} pixels, its imprint {size:?}", mask.size());
                return Err(FileError::new("", what, ""));
            }
        }
        content.ignored = content.ignored.filter(|ignored| ignored.as_slice().contains(&true));
        report.counts[part] += 1;
        let to = root.join(PARTS[part]);
        match choice.format {
            Format::Unet => unet::write(&to, stem, &content, &mut report),
            Format::Png => format::write_masks(&to, stem, &content),
        }?;
        written.insert(stem.clone(), digest(&content.mask, content.ignored.as_ref()));
    }
    if !failures.is_empty() {
        return Err(sources(&failures));
    }
    check_written(&root, choice.format, written).map_err(|err| meant(err, &root, &folder))?;
    let mut files = Vec::new();
    find(&root, &root, &mut files).map_err(|s| io(&root, "list the folder", s))?;
    for relative in files {
        let path = root.join(&relative);
        let bytes = files::read(&path, files::MODEL).map_err(|s| io(&path, "read", s))?;
        manifest.files.insert(relative, sha256(&bytes));
    }
    let path = root.join(MANIFEST);
    super::atomic::write_json(&path, "cannot write", &manifest)?;
    // Once more, in case something appeared while the masks were computed.
    refuse_foreign(&folder)?;
    staging.put(&folder).map_err(|source| io(&folder, "put the export to", source))?;
    Ok(report)
}

fn io(path: &Path, what: &str, err: std::io::Error) -> FileError {
    FileError::io(path, &format!("cannot {what}"), err)
}

fn sources(failures: &[(String, String)]) -> FileError {
    FileError::new("", format!("nothing was exported: {}", listed(failures)), "")
}

fn make_folder(path: &Path) -> Result<(), FileError> {
    std::fs::create_dir_all(path).map_err(|source| io(path, "make the folder", source))
}

/// A failed check that names its file where it would have come to lie, in `folder`, instead of where it was made.
fn meant(err: FileError, root: &Path, folder: &Path) -> FileError {
    let file = err.file.strip_prefix(root).map_or_else(|_| err.file.clone(), |file| folder.join(file));
    let what = format!("the written folder failed its check: {}", err.what);
    FileError { file, what, ..err }
}

/// SHA-256 of a mask's size and pixels with its ignored pixels, which tells it from all others.
fn digest(mask: &Mask, ignored: Option<&Mask>) -> String {
    let [width, height] = mask.size();
    let bits = |mask: &Mask| mask.as_slice().iter().map(|&v| u8::from(v)).collect::<Vec<_>>();
    let ignored = ignored.map(bits).unwrap_or_default();
    sha256(&[&width.to_le_bytes()[..], &height.to_le_bytes(), &bits(mask), &ignored].concat())
}

/// Reads what was written: each of `written` (stem to [`digest`]) must be there and the same, and nothing else.
fn check_written(root: &Path, format: Format, mut written: BTreeMap<String, String>) -> Result<(), FileError> {
    let fail = |file: &Path, what: String| FileError::new(file, what, "check the disk, and export again");
    let listing = list(root, Some(format))?;
    if let Some(refused) = listing.refused.into_iter().next() {
        return Err(refused);
    }
    for listed in &listing.masks {
        let expected = written.remove(&listed.stem);
        let (mask, ignored) = listed.read()?;
        if expected != Some(digest(&mask, ignored.as_ref())) {
            return Err(fail(&listed.file, format!("the mask of {} reads back differently", listed.stem)));
        }
    }
    written.into_keys().next().map_or(Ok(()), |stem| Err(fail(root, format!("the mask of {stem} is not there"))))
}

/// An existing folder must be empty, or hold exactly what its manifest says.
fn refuse_foreign(folder: &Path) -> Result<(), FileError> {
    let mut files = Vec::new();
    match find(folder, folder, &mut files) {
        Ok(()) => {}
        Err(err) if err.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(source) => return Err(io(folder, "list the folder", source)),
    }
    let known = Manifest::read(folder).map(|manifest| manifest.files).unwrap_or_default();
    let is_manifest = |file: &str| file == MANIFEST && !known.is_empty();
    match files.into_iter().find(|file| !known.contains_key(file) && !is_manifest(file)) {
        Some(found) => {
            let what = format!("the folder is not empty and not a previous export: it holds {found}");
            Err(FileError::new(folder, what, "choose another folder"))
        }
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
            let choice = ExportChoice { format, ..ExportChoice::default() };
            export(&folder, &entries, &choice, &Rig::lab(), |i| Ok(content(i))).unwrap();
            let stems = split::stems(&entries, &Rig::lab());
            let written = |i: usize| (stems[i].clone(), digest(&mask(i), content(i).ignored.as_ref()));
            let check = |which: &[usize]| check_written(&folder, format, which.iter().map(|&i| written(i)).collect());
            assert_eq!(check(&[0, 1, 2]), Ok(()), "{format:?}");
            assert!(check(&[0, 1]).unwrap_err().what.contains("reads back differently"), "nobody wrote the third");
            let extra = BTreeMap::from([0, 1, 2].map(written)).into_iter().chain([("gone".to_owned(), String::new())]);
            let gone = check_written(&folder, format, extra.collect()).unwrap_err();
            assert!(gone.what.contains("the mask of gone is not there"), "{gone:?}");
            let (other, stem) = (format::gray(&mask(5)), &stems[2]);
            let name = match format {
                Format::Unet => format!("masks/{stem}.png"),
                Format::Png => format!("{stem}.png"),
            };
            let file = PARTS.map(|part| folder.join(part).join(&name)).into_iter().find(|file| file.is_file()).unwrap();
            crate::io::images::write_gray8(&file, &other).unwrap();
            let found = check(&[0, 1, 2]).unwrap_err();
            assert_eq!(found.file, file, "{format:?}: {found:?}");
            let err = meant(found, &folder, Path::new("/there"));
            let name = file.file_name().unwrap().to_str().unwrap();
            assert!(err.to_string().contains("/there/") && err.to_string().contains(name), "{err}");
        }
    }
}
