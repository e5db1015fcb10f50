//! Masks alone, as pictures: `PART/STEM.png`, and `PART/STEM.ignore.png` where pixels are ignored.

use super::format::{Place, Writer, gray};
use super::{Content, ExportError, ExportReport, PARTS};
use crate::io::images;

/// Writes them.
pub(super) struct Pictures;

impl Writer for Pictures {
    fn add(&mut self, to: &Place<'_>, content: &Content, _: &mut ExportReport) -> Result<(), ExportError> {
        let file = |end: &str| to.root.join(PARTS[to.part]).join(format!("{}{end}", to.stem));
        images::write_gray8(&file(".png"), &gray(&content.mask))?;
        if let Some(ignored) = &content.ignored {
            images::write_gray8(&file(super::found::IGNORE_PNG), &gray(ignored))?;
        }
        Ok(())
    }
}
