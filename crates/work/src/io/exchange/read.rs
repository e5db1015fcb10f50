//! Finding masks on the disk, in whichever form they lie there: [`list`].

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::coco::{self, ANNOTATIONS};
use super::found::{IGNORE_NPY, IGNORE_PNG, IMPRINT_NPY, Listed, Listing, MASK_NPY, ReadError, Stored};
use super::{Format, IGNORED, Manifest, PARTS};

/// The masks of a folder, of an export or of one of its parts, or of one file; in the form named, else in the one that lies
/// there. No pixels are read, except those that COCO's annotations hold.
///
/// # Errors
/// If the form cannot be told, or a file of annotations cannot be read.
pub fn list(path: &Path, format: Option<Format>) -> Result<Listing, ReadError> {
    if !path.exists() {
        return Err(ReadError::new(path, "there is no such file or folder", "name the folder of an export, or a file"));
    }
    let manifest = path.ancestors().take(4).find_map(Manifest::read);
    let known = manifest.as_ref().map(|manifest| manifest.masks);
    let format = match format.or(known) {
        Some(format) => format,
        None => recognized(path)?,
    };
    let mut listing = Listing { format, ..Listing::default() };
    if format == Format::Coco {
        let files = if path.is_file() { vec![path.to_owned()] } else { annotations(path) };
        if files.is_empty() {
            let what = format!("there is no {ANNOTATIONS}/*.json");
            return Err(ReadError::new(path, what, "name the file of the annotations itself"));
        }
        for file in files {
            coco::read(&file, &mut listing)?;
        }
    } else {
        for file in files_of(path, format) {
            listing.masks.extend(listed(&file, format));
        }
    }
    if let Some(stems) = manifest.map(|manifest| manifest.stems) {
        for listed in &mut listing.masks {
            listed.of = listed.of.take().or_else(|| stems.get(&listed.stem).cloned());
        }
    }
    apart(&mut listing);
    if listing.masks.is_empty() && listing.refused.is_empty() {
        let what = format!("there are no masks in the form \"{}\"", format.key());
        return Err(ReadError::new(path, what, "name the folder of an export, or another form"));
    }
    Ok(listing)
}

/// Leaves out masks whose names others have as well: nobody can say which one is meant.
fn apart(listing: &mut Listing) {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    listing.masks.iter().for_each(|listed| *counts.entry(listed.stem.clone()).or_default() += 1);
    let (kept, twice) = std::mem::take(&mut listing.masks).into_iter().partition(|listed| counts[&listed.stem] == 1);
    listing.masks = kept;
    let twice: Vec<Listed> = twice;
    listing.refused.extend(twice.into_iter().map(|listed| {
        let what = format!("{} masks have the name {}", counts[&listed.stem], listed.stem);
        ReadError::new(&listed.file, what, "take the others away")
    }));
}

/// The folder and its parts.
fn bases(path: &Path) -> Vec<PathBuf> {
    std::iter::once(path.to_owned()).chain(PARTS.iter().map(|part| path.join(part))).collect()
}

/// The files of a folder with an ending, by name.
fn with_ending(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    // What is no ordinary file is refused when it is read, and not passed over.
    let is_meant = |path: &PathBuf| !path.is_dir() && path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_meant).collect();
    files.sort();
    files
}

fn annotations(path: &Path) -> Vec<PathBuf> {
    let folder = if path.ends_with(ANNOTATIONS) { path.to_owned() } else { path.join(ANNOTATIONS) };
    with_ending(&folder, "json")
}

fn mask_folders(path: &Path) -> Vec<PathBuf> {
    let found: Vec<PathBuf> =
        bases(path).into_iter().map(|base| base.join("masks")).filter(|folder| folder.is_dir()).collect();
    // An export may be called so as well.
    if found.is_empty() && path.ends_with("masks") { vec![path.to_owned()] } else { found }
}

/// All files in which masks of a form lie, those of ignored pixels and imprints among them.
fn files_of(path: &Path, format: Format) -> Vec<PathBuf> {
    if path.is_file() {
        return vec![path.to_owned()];
    }
    let (folders, ending) = match format {
        Format::Unet => (mask_folders(path), "png"),
        Format::Npy => (bases(path), "npy"),
        Format::Png => (bases(path), "png"),
        Format::Coco => (Vec::new(), "json"),
    };
    folders.iter().flat_map(|folder| with_ending(folder, ending)).collect()
}

/// The mask of a file; `None` for one that holds something else.
fn listed(file: &Path, format: Format) -> Option<Listed> {
    let name = file.file_name()?.to_string_lossy().into_owned();
    let beside = |path: PathBuf| std::fs::symlink_metadata(&path).is_ok_and(|found| !found.is_dir()).then_some(path);
    let (stem, stored) = match format {
        Format::Npy => {
            if name.ends_with(IGNORE_NPY) || name.ends_with(IMPRINT_NPY) {
                return None;
            }
            let stem = name.strip_suffix(MASK_NPY).unwrap_or(&name[..name.len() - ".npy".len()]);
            (stem.to_owned(), Stored::Arrays(beside(file.with_file_name(format!("{stem}{IGNORE_NPY}")))))
        }
        _ if name.ends_with(IGNORE_PNG) => return None,
        _ => {
            let stem = file.file_stem()?.to_string_lossy().into_owned();
            let ignored = match format {
                Format::Unet => file.parent()?.with_file_name(IGNORED).join(&name),
                _ => file.with_file_name(format!("{stem}{IGNORE_PNG}")),
            };
            (stem, Stored::Pictures(beside(ignored)))
        }
    };
    Some(Listed { stem, file: file.to_owned(), of: None, stored })
}

/// The form that lies in a place.
fn recognized(path: &Path) -> Result<Format, ReadError> {
    const NAME: &str = "name the form: unet, npy, coco or png";
    if path.is_file() {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        return match ending.as_str() {
            "json" => Ok(Format::Coco),
            "npy" => Ok(Format::Npy),
            "png" if path.parent().is_some_and(|folder| folder.ends_with("masks")) => Ok(Format::Unet),
            "png" => Ok(Format::Png),
            _ => Err(ReadError::new(path, "this is no file of masks", "name a .png, a .npy or COCO's .json")),
        };
    }
    let found: Vec<Format> = [
        (Format::Coco, !annotations(path).is_empty()),
        (Format::Npy, !files_of(path, Format::Npy).is_empty()),
        (Format::Unet, !files_of(path, Format::Unet).is_empty()),
    ]
    .into_iter()
    .filter_map(|(format, there)| there.then_some(format))
    .collect();
    match found.as_slice() {
        [only] => Ok(*only),
        // Images lie beside annotations and in folders of their own: pictures are masks only where nothing else is.
        [] if !files_of(path, Format::Png).is_empty() => Ok(Format::Png),
        [] => Err(ReadError::new(path, "there are no masks here", "name the folder of an export, or a file of masks")),
        several => {
            let keys: Vec<&str> = several.iter().map(|format| format.key()).collect();
            Err(ReadError::new(path, format!("masks in several forms lie here: {}", keys.join(", ")), NAME))
        }
    }
}
