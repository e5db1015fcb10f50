//! Masks that lie on the disk: what is known of one before its pixels are read, and [`Listed::read`], which reads them.

use std::path::{Path, PathBuf};

use super::Format;
use crate::io::images;
use touch2touch_core::grid::Mask;

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
    pub fn read(&self) -> Result<(Mask, Option<Mask>), ReadError> {
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
    pub refused: Vec<ReadError>,
}

const VALUES: &str = "save the mask with the values 0 and 255, or 0 and 1";

/// The mask of a picture; 0 and 255, or 0 and 1.
fn picture(file: &Path) -> Result<Mask, ReadError> {
    let fail = |err: &images::PictureError| {
        // The file is said once.
        let what = err.to_string().replace(&format!(" ({})", file.display()), "");
        ReadError::new(file, what, err.hint())
    };
    // 65,535 is to 16 bits what 255 is to 8.
    let level = |&v: &u16| if v == u16::MAX { 255 } else { v };
    let levels = images::read_mask(file).map_err(|err| fail(&err))?.map(level);
    if let Some(value) = levels.as_slice().iter().find(|v| ![0, 1, 255].contains(*v)) {
        return Err(ReadError::new(file, format!("the mask has the value {value}"), VALUES));
    }
    if levels.as_slice().contains(&1) && levels.as_slice().contains(&255) {
        return Err(ReadError::new(file, "the mask has the values 1 and 255", VALUES));
    }
    Ok(levels.map(|v| *v != 0))
}
