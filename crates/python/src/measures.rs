//! Measures of images under the lab's conventions.

use numpy::{PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use touch2touch_core::evaluation::PEAK_M;
use touch2touch_core::metrics::{self, SsimRange};

use crate::arrays::image_of;
use crate::process::refused;

/// Peak signal-to-noise ratio of two images (height, width), float32, decibels; infinite for equal ones. Pixels that are not
/// finite in either are left out. `peak`: 0.0225 m, the lab's, unless named.
#[pyfunction]
#[pyo3(signature = (prediction, truth, *, peak=None))]
pub(crate) fn psnr(
    prediction: PyReadonlyArray2<'_, f32>,
    truth: PyReadonlyArray2<'_, f32>,
    peak: Option<f64>,
) -> PyResult<f64> {
    let (prediction, truth) = (image_of(&prediction, "prediction")?, image_of(&truth, "truth")?);
    let found = metrics::psnr(&prediction, &truth, peak.unwrap_or(PEAK_M)).map_err(refused)?;
    Ok(found.unwrap_or(f64::INFINITY))
}

/// Structural similarity of two images (height, width), float32, as the lab has it: 11 x 11 Gaussian window, zero padding,
/// the mean of the whole map. `data_range`: the prediction's own range unless named.
#[pyfunction]
#[pyo3(signature = (prediction, truth, *, data_range=None))]
pub(crate) fn ssim(
    prediction: PyReadonlyArray2<'_, f32>,
    truth: PyReadonlyArray2<'_, f32>,
    data_range: Option<f64>,
) -> PyResult<f64> {
    let (prediction, truth) = (image_of(&prediction, "prediction")?, image_of(&truth, "truth")?);
    let range = data_range.map_or(SsimRange::OfPrediction, SsimRange::Explicit);
    metrics::ssim(&prediction, &truth, range).map_err(refused)
}

/// Fréchet distance of two sets of features (N, D), float32: pytorch-fid's on the same features. With few vectors it is
/// biased upwards.
#[pyfunction]
pub(crate) fn frechet(a: PyReadonlyArray2<'_, f32>, b: PyReadonlyArray2<'_, f32>) -> PyResult<f64> {
    if a.shape()[1] != b.shape()[1] {
        return Err(refused(format!("the sets have {} and {} features", a.shape()[1], b.shape()[1])));
    }
    let rows = |array: &PyReadonlyArray2<'_, f32>| -> Vec<Vec<f32>> {
        array.as_array().rows().into_iter().map(|row| row.to_vec()).collect()
    };
    let (a, b) = (rows(&a), rows(&b));
    let (a, b): (Vec<&[f32]>, Vec<&[f32]>) =
        (a.iter().map(Vec::as_slice).collect(), b.iter().map(Vec::as_slice).collect());
    metrics::frechet_distance(&a, &b)
        .ok_or_else(|| refused("a set has fewer than two vectors, or one that is not finite"))
}
