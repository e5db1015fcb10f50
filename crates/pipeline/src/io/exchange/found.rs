//! Masks that lie on the disk: what is known of one before its pixels are read, and [`Listed::read`], which reads them.

use std::path::{Path, PathBuf};

use super::Format;
use crate::io::error::FileError;
use crate::io::images;
use touch2touch_core::grid::Mask;

/// A mask that was found.
#[derive(Clone, Debug)]
pub struct Listed {
    /// Name of the mask, without folder and ending.
    pub stem: String,
    /// The file.
    pub file: PathBuf,
    /// Pair and finger, where the export says them.
    pub of: Option<(String, String)>,
    /// Picture of the pixels of which it says nothing.
    pub(super) ignored: Option<PathBuf>,
}

impl Listed {
    /// Contact, and the pixels of which it says nothing; `None` where no file names any.
    ///
    /// # Errors
    /// If a file cannot be read, or has other values than those of a mask.
    pub fn read(&self) -> Result<(Mask, Option<Mask>), FileError> {
        Ok((picture(&self.file)?, self.ignored.as_deref().map(picture).transpose()?))
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
    pub refused: Vec<FileError>,
}

const VALUES: &str = "save the mask with the values 0 and 255, or 0 and 1";

/// The mask of a picture; 0 and 255, or 0 and 1.
fn picture(file: &Path) -> Result<Mask, FileError> {
    let level = |&v: &u16| if v == u16::MAX { 255 } else { v };
    let levels = images::read_mask(file)?.map(level);
    if let Some(value) = levels.as_slice().iter().find(|v| ![0, 1, 255].contains(*v)) {
        return Err(FileError::new(file, format!("the mask has the value {value}"), VALUES));
    }
    if levels.as_slice().contains(&1) && levels.as_slice().contains(&255) {
        return Err(FileError::new(file, "the mask has the values 1 and 255", VALUES));
    }
    Ok(levels.map(|v| *v != 0))
}
