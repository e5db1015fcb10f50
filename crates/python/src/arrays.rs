//! Grids, points and transforms as numpy's arrays, and back.

use std::borrow::Cow;

use glam::{DAffine3, DMat4, DVec3};
use numpy::{Element, PyArray1, PyArrayDyn, PyArrayMethods as _, PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use touch2touch_core::grid::{Grid, RgbGrid};

use crate::process::refused;

/// An array of any shape.
pub(crate) type Array<'py, T> = Bound<'py, PyArrayDyn<T>>;

/// An array of this shape from its values, row by row.
///
/// # Errors
/// If there are not as many values as the shape has.
pub(crate) fn array<'py, T: Element>(py: Python<'py>, values: Vec<T>, shape: &[usize]) -> PyResult<Array<'py, T>> {
    PyArray1::from_vec(py, values).reshape(shape)
}

/// Images of all pads as (pads, height, width); a pad without one is filled with `missing`. `None` where no pad has one.
///
/// # Errors
/// If they differ in size.
pub(crate) fn stack<'py, 'g, T: Element + Copy + 'g>(
    py: Python<'py>,
    images: impl Iterator<Item = Option<&'g Grid<T>>>,
    missing: T,
) -> PyResult<Option<Array<'py, T>>> {
    stacked(py, images, Grid::as_slice, &[], missing)
}

/// Color images likewise as (pads, height, width, 3).
///
/// # Errors
/// As [`stack`].
pub(crate) fn stack_rgb<'py, 'g>(
    py: Python<'py>,
    images: impl Iterator<Item = Option<&'g RgbGrid>>,
) -> PyResult<Option<Array<'py, f32>>> {
    stacked(py, images, |image| image.as_slice().as_flattened(), &[3], f32::NAN)
}

fn stacked<'py, 'g, P: 'g, T: Element + Copy + 'g>(
    py: Python<'py>,
    images: impl Iterator<Item = Option<&'g Grid<P>>>,
    values: impl Fn(&'g Grid<P>) -> &'g [T],
    channels: &[usize],
    missing: T,
) -> PyResult<Option<Array<'py, T>>> {
    let images: Vec<Option<&Grid<P>>> = images.collect();
    let mut sizes = images.iter().flatten().map(|image| image.size());
    let Some(size) = sizes.next() else { return Ok(None) };
    if let Some(other) = sizes.find(|other| *other != size) {
        return Err(refused(format!("the pads' images differ in size: {size:?} and {other:?}")));
    }
    let each = size.iter().chain(channels).product();
    let flat =
        images.iter().flat_map(|image| image.map_or_else(|| vec![missing; each], |image| values(image).to_vec()));
    array(py, flat.collect(), &[&[images.len(), size[1], size[0]][..], channels].concat()).map(Some)
}

/// Points as (N, 3).
///
/// # Errors
/// None in practice.
pub(crate) fn points<'py>(py: Python<'py>, points: &[DVec3]) -> PyResult<Array<'py, f64>> {
    array(py, points.iter().flat_map(|p| p.to_array()).collect(), &[points.len(), 3])
}

/// Points of an array (N, 3): the array itself where it lies row by row, else a copy.
///
/// # Errors
/// If it has another shape.
pub(crate) fn points_of<'a>(array: &'a PyReadonlyArray2<'_, f64>, what: &str) -> PyResult<Cow<'a, [DVec3]>> {
    let shape = array.shape();
    if shape[1] != 3 {
        return Err(refused(format!("{what} must be an array of N x 3 coordinates, not {} x {}", shape[0], shape[1])));
    }
    // A slice of an array in Fortran's order runs down its columns.
    Ok(match array.as_slice() {
        Ok(values) if array.is_c_contiguous() => Cow::Borrowed(bytemuck::cast_slice(values)),
        _ => array.as_array().rows().into_iter().map(|row| DVec3::new(row[0], row[1], row[2])).collect(),
    })
}

/// The 4 x 4 numbers of a transform, which maps columns, row by row.
pub(crate) fn rows(transform: &DAffine3) -> [f64; 16] {
    DMat4::from(*transform).transpose().to_cols_array()
}

/// A transform as 4 x 4: its [`rows`].
///
/// # Errors
/// None in practice.
pub(crate) fn transform<'py>(py: Python<'py>, transform: &DAffine3) -> PyResult<Array<'py, f64>> {
    array(py, rows(transform).to_vec(), &[4, 4])
}

/// An image of an array (height, width).
///
/// # Errors
/// If it is empty.
pub(crate) fn image_of<T: Element + Copy>(image: &PyReadonlyArray2<'_, T>, what: &str) -> PyResult<Grid<T>> {
    let [height, width] = [image.shape()[0], image.shape()[1]];
    let values = match image.as_slice() {
        Ok(values) if image.is_c_contiguous() => values.to_vec(),
        _ => image.as_array().iter().copied().collect(),
    };
    Grid::from_vec(width, height, values).map_err(|err| refused(format!("{what}: {err}")))
}
