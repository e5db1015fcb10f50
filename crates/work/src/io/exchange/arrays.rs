//! Numpy arrays: `PART/STEM.imprint.npy`, `PART/STEM.mask.npy`, and `PART/STEM.ignore.npy` where pixels are ignored.

use std::path::Path;

use super::format::{Place, Writer, differs, gray};
use super::found::{IGNORE_NPY, IMPRINT_NPY, MASK_NPY};
use super::{Content, ExportError, ExportReport, PARTS, io};
use crate::io::{atomic, npz};

/// Text that lies beside the arrays, because an array says neither what it is nor in which unit.
const ABOUT: &str = "\
Contact masks as numpy arrays, in the parts train, val and test. One name (STEM) for each pair and finger;
touch2touch_export.json says which.

STEM.imprint.npy  float32, (height, width): the imprint in meters, NaN where nothing was measured
STEM.mask.npy     uint8, (height, width): 255 in contact, 0 free of it
STEM.ignore.npy   uint8, (height, width): 255 where the mask says nothing, 0 elsewhere; missing where it speaks of all

Rows run down, columns to the right, in the raw orientation of the data set.
";
/// The file with [`ABOUT`].
const README: &str = "README.txt";

/// Writes them.
pub(super) struct Arrays;

impl Writer for Arrays {
    fn add(&mut self, to: &Place<'_>, content: &Content, report: &mut ExportReport) -> Result<(), ExportError> {
        let file = |end: &str| to.root.join(PARTS[to.part]).join(format!("{}{end}", to.stem));
        report.unmeasured_px += content.imprint.as_slice().iter().filter(|v| !v.is_finite()).count();
        let imprint = file(IMPRINT_NPY);
        npz::write_npy(&imprint, &content.imprint)?;
        let same = |(a, b): (f32, &f32)| a.to_bits() == b.to_bits();
        if !npz::read_npy(&imprint)?.into_f32().into_iter().zip(content.imprint.as_slice()).all(same) {
            return Err(differs(&imprint));
        }
        npz::write_npy_gray(&file(MASK_NPY), &gray(&content.mask))?;
        if let Some(ignored) = &content.ignored {
            npz::write_npy_gray(&file(IGNORE_NPY), &gray(ignored))?;
        }
        Ok(())
    }

    fn finish(&mut self, root: &Path) -> Result<(), ExportError> {
        let file = root.join(README);
        atomic::write_bytes(&file, ABOUT.as_bytes()).map_err(|source| io(&file, "write", source))
    }
}
