//! [`Format`]: the forms, and what a writer of one does.

use std::path::Path;

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

use super::{Content, ExportError, ExportReport, PARTS};
use crate::io::images;
use touch2touch_core::dataset::Problem;
use touch2touch_core::grid::{Grid, Mask};

/// A form of masks that other programs read and write.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    EnumIter,
    EnumString,
    IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Format {
    /// Images and masks as the lab's UNet training reads them.
    #[default]
    Unet,
    /// Numpy arrays: imprints in meters, masks, ignored pixels.
    Npy,
    /// COCO: annotations with run lengths, and images.
    Coco,
    /// Masks alone, as pictures.
    Png,
}

impl Format {
    /// The name on the command line and in files.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unet => "UNet folder",
            Self::Npy => "NPY",
            Self::Coco => "COCO",
            Self::Png => "PNG",
        }
    }

    /// Description in a sentence.
    pub fn text(self) -> &'static str {
        match self {
            Self::Unet => {
                "{train,val,test}/{imgs,masks} of 8-bit pictures, as the lab's UNet training reads them; ignored pixels \
                 beside them"
            }
            Self::Npy => {
                "Numpy arrays by part: imprints as float32 in meters, masks and ignored pixels as uint8, 0 and 255"
            }
            Self::Coco => {
                "An annotations file for each part with run lengths as pycocotools reads them, and 8-bit images; ignored \
                 pixels are a category of their own with iscrowd 1"
            }
            Self::Png => "Masks alone as 8-bit pictures by part, 0 and 255; ignored pixels as pictures of their own",
        }
    }
}

/// Place of a mask in an export.
pub(super) struct Place<'a> {
    /// The folder of the export.
    pub(super) root: &'a Path,
    /// An index into [`PARTS`].
    pub(super) part: usize,
    pub(super) stem: &'a str,
    pub(super) pair: &'a str,
    pub(super) finger: &'a str,
}

/// Writes masks in one form.
pub(super) trait Writer {
    /// Folders that are there even where nothing lies in them, relative to the export's.
    fn folders(&self) -> Vec<String> {
        PARTS.map(str::to_owned).to_vec()
    }

    /// Writes one mask; `content.ignored` is there only where pixels are ignored.
    fn add(&mut self, to: &Place<'_>, content: &Content, report: &mut ExportReport) -> Result<(), ExportError>;

    /// Writes what is said about all of them.
    fn finish(&mut self, _root: &Path) -> Result<(), ExportError> {
        Ok(())
    }
}

/// Writes an image, which must read back the same.
pub(super) fn write_image(file: &Path, picture: &Grid<u8>) -> Result<(), ExportError> {
    images::write_gray8(file, picture)?;
    if images::read_gray8(file)? == *picture { Ok(()) } else { Err(differs(file)) }
}

/// That a file reads back differently.
pub(super) fn differs(file: &Path) -> ExportError {
    let (what, hint) = ("the file reads back differently".into(), "check the disk".into());
    ExportError::Check { problems: vec![Problem { file: file.to_owned(), what, hint }] }
}

/// A mask as the values 0 and 255.
pub(super) fn gray(mask: &Mask) -> Grid<u8> {
    mask.map(|&v| if v { 255 } else { 0 })
}
