//! [`Format`]: the forms.

use std::path::Path;

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

use super::Content;
use crate::io::error::FileError;
use crate::io::images;
use touch2touch_core::grid::{Grid, Mask};

/// End of the name of the picture of ignored pixels beside a mask.
pub(super) const IGNORE_PNG: &str = ".ignore.png";

/// A form of masks that other programs read and write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, EnumIter, EnumString, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Format {
    /// Images and masks as the lab's UNet training reads them.
    #[default]
    Unet,
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
            Self::Png => "Masks alone as 8-bit pictures by part, 0 and 255; ignored pixels as pictures of their own",
        }
    }
}

/// Writes a mask alone into the folder of its part, as a picture, and its ignored pixels where there are any.
pub(super) fn write_masks(part: &Path, stem: &str, content: &Content) -> Result<(), FileError> {
    images::write_gray8(&part.join(format!("{stem}.png")), &gray(&content.mask))?;
    if let Some(ignored) = &content.ignored {
        images::write_gray8(&part.join(format!("{stem}{IGNORE_PNG}")), &gray(ignored))?;
    }
    Ok(())
}

/// A mask as the values 0 and 255.
pub(super) fn gray(mask: &Mask) -> Grid<u8> {
    mask.map(|&v| if v { 255 } else { 0 })
}
