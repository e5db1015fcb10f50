//! Pictures as PNG.

use numpy::{PyReadonlyArray3, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::picture::colored;
use touch2touch_pipeline::io::images::png_bytes;

use crate::process::refused;

/// The color range of imprints, meters.
const RANGE: Range = Range { lo: 0.0, hi: 0.018 };

/// A color picture, (height, width, 3) bytes, as the bytes of a PNG file.
#[pyfunction]
pub(crate) fn png<'py>(py: Python<'py>, picture: PyReadonlyArray3<'py, u8>) -> PyResult<Bound<'py, PyBytes>> {
    let &[height, width, 3] = picture.shape() else {
        return Err(refused(format!("a picture must be (height, width, 3), not {:?}", picture.shape())));
    };
    let pixels = picture.as_array().iter().copied().collect::<Vec<u8>>();
    let pixels = pixels.as_chunks::<3>().0.to_vec();
    let picture = Grid::from_vec(width, height, pixels).map_err(|err| refused(err.to_string()))?;
    encoded(py, &picture)
}

/// Imprints as PNG files, in the colors of the studio.
pub(crate) fn imprints<'a, 'py>(
    py: Python<'py>,
    imprints: impl Iterator<Item = &'a DepthMap>,
) -> PyResult<Vec<Bound<'py, PyBytes>>> {
    imprints.map(|imprint| encoded(py, &colored(imprint, ColorMap::Viridis, RANGE))).collect()
}

fn encoded<'py>(py: Python<'py>, picture: &Grid<[u8; 3]>) -> PyResult<Bound<'py, PyBytes>> {
    let png = png_bytes(picture).map_err(|err| refused(err.to_string()))?;
    Ok(PyBytes::new(py, &png))
}
