//! Residual that predictions of some shapes are known to leave: ridge regression on the pictures' principal components.

use nalgebra::DMatrix;

use super::Pixels;
use crate::blur::gaussian;
use crate::grid::Grid;
use crate::linear::eigen_symmetric;
use crate::postprocess::Response;

/// Most components.
const COMPONENTS: usize = 30;
/// Weight of no answer, in variances of the first component.
const RIDGE: f64 = 0.03;
/// Deviation of the blur of what is missing, pixels: the grain of single pictures is not learnt.
const SMOOTH_PX: f64 = 1.5;
/// Fewest pairs at which it is tried.
const FEWEST: usize = 4;

/// The answers that pictures (meters, row by row) call for, by what each misses. `None` with too few pairs, or where all
/// pictures are alike.
pub(super) fn response(pictures: &[Pixels], missing: &[Grid<f64>]) -> Option<Response> {
    let n = pictures.len();
    let [width, height] = missing.first()?.size();
    if n < FEWEST {
        return None;
    }
    let center: Pixels = (0..width * height).map(|i| pictures.iter().map(|p| p[i]).sum::<f64>() / n as f64).collect();
    let rest: Vec<Pixels> = pictures.iter().map(|p| p.iter().zip(&center).map(|(v, c)| v - c).collect()).collect();
    // Components of many pixels and few pictures: from the products of the pictures.
    let products = DMatrix::from_fn(n, n, |i, j| if j <= i { dot(&rest[i], &rest[j]) } else { 0.0 });
    let products = DMatrix::from_fn(n, n, |i, j| products[(i.max(j), i.min(j))]);
    let (values, vectors) = eigen_symmetric(products)?;
    let largest = values[n - 1];
    let few = (0..n).rev().take(COMPONENTS.min(n - 1)).filter(|&k| values[k] > 1e-9 * largest && largest > 0.0);
    let smooth: Vec<Grid<f64>> = missing.iter().map(|m| gaussian(m, SMOOTH_PX)).collect();
    let (mut basis, mut answers) = (Vec::new(), Vec::new());
    for k in few {
        // In these components the pictures are uncorrelated, so that each has its answer by itself.
        let length = values[k].sqrt();
        let weights: Vec<f64> = (0..n).map(|i| vectors[(i, k)]).collect();
        basis.push(summed(width, height, &weights, |i, pixel| rest[i][pixel] / length));
        let scale = length / (values[k] + RIDGE * largest);
        answers.push(summed(width, height, &weights, |i, pixel| smooth[i].as_slice()[pixel] * scale));
    }
    (!basis.is_empty()).then(|| Response {
        center: Grid::from_fn(width, height, |x, y| center[y * width + x] as f32),
        basis,
        answers,
    })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn summed(width: usize, height: usize, weights: &[f64], of: impl Fn(usize, usize) -> f64) -> Grid<f32> {
    Grid::from_fn(width, height, |x, y| {
        weights.iter().enumerate().map(|(i, w)| w * of(i, y * width + x)).sum::<f64>() as f32
    })
}
