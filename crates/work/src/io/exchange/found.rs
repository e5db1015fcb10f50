//! Masks that lie on the disk: what is known of one before its pixels are read, and [`Listed::read`], which reads them.

use std::path::{Path, PathBuf};

use super::Format;
use crate::io::{images, npz};
use touch2touch_core::grid::{Grid, Mask};
use touch2touch_core::label::mask_of_coco_runs;

pub(super) const IMPRINT_NPY: &str = ".imprint.npy";
pub(super) const MASK_NPY: &str = ".mask.npy";
pub(super) const IGNORE_NPY: &str = ".ignore.npy";
pub(super) const IGNORE_PNG: &str = ".ignore.png";

/// Why masks cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} ({})", file.display())]
pub struct ReadError {
    /// The file or folder.
    pub file: PathBuf,
    /// Fault of the file.
    pub what: String,
    /// Advice for the user.
    pub hint: &'static str,
}

impl ReadError {
    pub(super) fn new(file: &Path, what: impl Into<String>, hint: &'static str) -> Self {
        Self { file: file.to_owned(), what: what.into(), hint }
    }
}

/// The masks of an image as COCO's run lengths.
#[derive(Clone, Debug)]
pub(super) struct Coded {
    /// Columns and rows.
    pub(super) size: [usize; 2],
    pub(super) contact: Vec<Vec<u32>>,
    pub(super) ignored: Vec<Vec<u32>>,
}

impl Coded {
    /// Contact and ignored pixels.
    fn masks(&self) -> Result<(Mask, Option<Mask>), String> {
        let [width, height] = self.size;
        let mut masks = [&self.contact, &self.ignored].map(|parts| {
            parts.iter().map(|runs| mask_of_coco_runs(width, height, runs)).reduce(|one, other| {
                let (mut one, other) = (one?, other?);
                one.as_mut_slice().iter_mut().zip(other.as_slice()).for_each(|(a, b)| *a |= b);
                Ok(one)
            })
        });
        let ignored = masks[1].take().transpose().map_err(|err| err.to_string())?;
        let none = || mask_of_coco_runs(width, height, &[u32::try_from(width.saturating_mul(height)).unwrap_or(0)]);
        Ok((masks[0].take().unwrap_or_else(none).map_err(|err| err.to_string())?, ignored))
    }
}

/// Place of a mask's pixels.
#[derive(Clone, Debug)]
pub(super) enum Stored {
    /// In pictures: mask and ignored pixels.
    Pictures(Option<PathBuf>),
    /// In arrays: mask and ignored pixels.
    Arrays(Option<PathBuf>),
    /// In what was read already.
    Coded(Coded),
}

/// A mask that was found.
#[derive(Clone, Debug)]
pub struct Listed {
    /// Name of the mask, without folder and ending.
    pub stem: String,
    /// The file.
    pub file: PathBuf,
    /// Pair and finger, where the export says them.
    pub of: Option<(String, String)>,
    pub(super) stored: Stored,
}

impl Listed {
    /// Contact, and the pixels of which it says nothing; `None` where no file names any.
    ///
    /// # Errors
    /// If a file cannot be read, or has other values than those of a mask.
    pub fn read(&self) -> Result<(Mask, Option<Mask>), ReadError> {
        let hint = "write the annotations again";
        match &self.stored {
            Stored::Pictures(ignored) => Ok((picture(&self.file)?, ignored.as_deref().map(picture).transpose()?)),
            Stored::Arrays(ignored) => Ok((array(&self.file)?, ignored.as_deref().map(array).transpose()?)),
            Stored::Coded(coded) => {
                coded.masks().map_err(|why| ReadError::new(&self.file, format!("{}: {why}", self.stem), hint))
            }
        }
    }
}

/// The masks of a folder or file.
#[derive(Clone, Debug, Default)]
pub struct Listing {
    /// Their form.
    pub format: Format,
    /// The masks.
    pub masks: Vec<Listed>,
    /// Files that look like a mask and cannot be taken.
    pub refused: Vec<ReadError>,
}

const VALUES: &str = "save the mask with the values 0 and 255, or 0 and 1";

/// The mask of values; 0 and 255, or 0 and 1.
fn mask_of(file: &Path, size: [usize; 2], values: impl Iterator<Item = f32> + Clone) -> Result<Mask, ReadError> {
    if let Some(value) = values.clone().find(|v| ![0.0, 1.0, 255.0].contains(v)) {
        return Err(ReadError::new(file, format!("the mask has the value {value}"), VALUES));
    }
    if values.clone().any(|v| v == 1.0) && values.clone().any(|v| v == 255.0) {
        return Err(ReadError::new(file, "the mask has the values 1 and 255", VALUES));
    }
    let bits = values.map(|v| v != 0.0).collect();
    Grid::from_vec(size[0], size[1], bits).map_err(|err| ReadError::new(file, err.to_string(), VALUES))
}

fn picture(file: &Path) -> Result<Mask, ReadError> {
    let levels = images::read_mask(file).map_err(|err| ReadError::new(file, unplaced(&err, file), err.hint()))?;
    // 65,535 is to 16 bits what 255 is to 8.
    let level = |&v: &u16| if v == u16::MAX { 255.0 } else { f32::from(v) };
    mask_of(file, levels.size(), levels.as_slice().iter().map(level))
}

fn array(file: &Path) -> Result<Mask, ReadError> {
    let array = npz::read_npy(file)
        .map_err(|err| ReadError::new(file, unplaced(&err, file), "save the mask again with numpy.save"))?;
    let &[height, width] = array.shape.as_slice() else {
        let what = format!("the mask has the shape {:?}, and not (height, width)", array.shape);
        return Err(ReadError::new(file, what, "save each mask as an array of its own"));
    };
    mask_of(file, [width, height], array.into_f32().into_iter())
}

/// Message of an error without its file, which is said once.
fn unplaced(err: &impl std::fmt::Display, file: &Path) -> String {
    err.to_string().replace(&format!(" ({})", file.display()), "")
}
