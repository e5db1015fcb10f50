//! Finding masks on the disk, in whichever form they lie there: [`list`].

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::format::IGNORE_PNG;
use super::found::{Listed, Listing};
use super::{Format, IGNORED, Manifest, PARTS};
use crate::io::error::FileError;

/// The masks of a folder, of an export or of one of its parts, or of one file; in the form named, else in the one that lies
/// there. No pixels are read.
///
/// # Errors
/// If the form cannot be told.
pub fn list(path: &Path, format: Option<Format>) -> Result<Listing, FileError> {
    if !path.exists() {
        return Err(FileError::new(path, "there is no such file or folder", "name the folder of an export, or a file"));
    }
    let manifest = path.ancestors().take(4).find_map(Manifest::read);
    let known = manifest.as_ref().map(|manifest| manifest.masks);
    let format = match format.or(known) {
        Some(format) => format,
        None => recognized(path)?,
    };
    let mut listing = Listing { format, ..Listing::default() };
    let stems = manifest.map(|manifest| manifest.stems).unwrap_or_default();
    listing.masks.extend(files_of(path, format).iter().filter_map(|file| listed(file, format, &stems)));
    apart(&mut listing);
    if listing.masks.is_empty() && listing.refused.is_empty() {
        let what = format!("there are no masks in the form \"{}\"", format.key());
        return Err(FileError::new(path, what, "name the folder of an export, or another form"));
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
        FileError::new(&listed.file, what, "take the others away")
    }));
}

/// The folder and its parts.
fn bases(path: &Path) -> Vec<PathBuf> {
    std::iter::once(path.to_owned()).chain(PARTS.iter().map(|part| path.join(part))).collect()
}

/// The PNG files of a folder, by name.
fn pictures(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    // What is no ordinary file is refused when it is read, and not passed over.
    let is_meant = |path: &PathBuf| !path.is_dir() && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_meant).collect();
    files.sort();
    files
}

fn mask_folders(path: &Path) -> Vec<PathBuf> {
    let found: Vec<PathBuf> =
        bases(path).into_iter().map(|base| base.join("masks")).filter(|folder| folder.is_dir()).collect();
    // An export may be called so as well.
    if found.is_empty() && path.ends_with("masks") { vec![path.to_owned()] } else { found }
}

/// All files in which masks of a form lie, those of ignored pixels among them.
fn files_of(path: &Path, format: Format) -> Vec<PathBuf> {
    if path.is_file() {
        return vec![path.to_owned()];
    }
    let folders = match format {
        Format::Unet => mask_folders(path),
        Format::Png => bases(path),
    };
    folders.iter().flat_map(|folder| pictures(folder)).collect()
}

/// The mask of a file, of what `stems` say of its name; `None` for one that holds something else.
fn listed(file: &Path, format: Format, stems: &BTreeMap<String, (String, String)>) -> Option<Listed> {
    let name = file.file_name()?.to_string_lossy().into_owned();
    if name.ends_with(IGNORE_PNG) {
        return None;
    }
    let stem = file.file_stem()?.to_string_lossy().into_owned();
    let beside = match format {
        Format::Unet => file.parent()?.with_file_name(IGNORED).join(&name),
        Format::Png => file.with_file_name(format!("{stem}{IGNORE_PNG}")),
    };
    let ignored = std::fs::symlink_metadata(&beside).is_ok_and(|found| !found.is_dir()).then_some(beside);
    Some(Listed { of: stems.get(&stem).cloned(), stem, file: file.to_owned(), ignored })
}

/// The form that lies in a place.
fn recognized(path: &Path) -> Result<Format, FileError> {
    if path.is_file() {
        return match path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
            true if path.parent().is_some_and(|folder| folder.ends_with("masks")) => Ok(Format::Unet),
            true => Ok(Format::Png),
            false => Err(FileError::new(path, "this is not a mask file", "name a .png")),
        };
    }
    // Images lie in folders of their own: pictures are masks only where nothing else is.
    let there = [Format::Unet, Format::Png].into_iter().find(|format| !files_of(path, *format).is_empty());
    there.ok_or_else(|| {
        FileError::new(path, "there are no masks here", "name the folder of an export, or a file of masks")
    })
}
