//! Gaussians of several widths of one image, the wide ones on coarser grids.

use crate::relax::Field;

/// Deviations, meters.
const SIGMAS_M: [f64; 6] = [0.7e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 8e-3];
/// Nodes of the fine grid from one node to the next of the grid that a width is kept on.
const STRIDES: [usize; 6] = [1, 1, 1, 2, 2, 4];

/// A band of lengths: positions in [`SIGMAS_M`] of the narrower and the wider Gaussian, whose difference it is.
pub(super) type Band = [usize; 2];
/// Bands, coarse to fine. A finer one is pixel noise on real cameras.
pub(super) const BANDS: [Band; 3] = [[2, 5], [1, 4], [0, 3]];

/// An image under Gaussians of all widths. Outside it is zero.
pub(super) struct Smooth {
    fields: [Field; SIGMAS_M.len()],
}

impl Smooth {
    /// Of an image on a grid of spacing `step_m`.
    pub(super) fn new(image: &Field, step_m: f64) -> Self {
        let mut before = 0.0;
        let mut stride = 1;
        let mut fields: [Field; SIGMAS_M.len()] = std::array::from_fn(|_| Field::filled(0, 0, 0.0));
        for i in 0..SIGMAS_M.len() {
            // Gaussians add up by their squares: each is made of the one before.
            let sigma = (SIGMAS_M[i].powi(2) - before).sqrt();
            before = SIGMAS_M[i].powi(2);
            let from = if i == 0 { image } else { &fields[i - 1] };
            fields[i] = if STRIDES[i] == stride {
                blurred(from, sigma / (step_m * stride as f64))
            } else {
                stride *= 2;
                blurred(&from.thinned(), sigma / (step_m * stride as f64))
            };
        }
        Self { fields }
    }

    /// The value under Gaussian number `sigma` at a node of the fine grid.
    #[inline]
    pub(super) fn at(&self, sigma: usize, column: usize, row: usize) -> f32 {
        let field = &self.fields[sigma];
        match STRIDES[sigma] {
            1 => field.values[row * field.columns + column],
            stride => interpolated(field, stride, column, row),
        }
    }
}

/// Bilinear between the nodes of a grid `stride` times as coarse.
#[inline]
fn interpolated(field: &Field, stride: usize, column: usize, row: usize) -> f32 {
    let along = |at: usize, last: usize| {
        let (low, rest) = (at / stride, at % stride);
        (low.min(last), (low + 1).min(last), rest as f32 / stride as f32)
    };
    let (left, right, fy) = along(column, field.columns - 1);
    let (above, below, fz) = along(row, field.rows - 1);
    let value = |row: usize, column: usize| field.values[row * field.columns + column];
    let top = value(above, left) + (value(above, right) - value(above, left)) * fy;
    let bottom = value(below, left) + (value(below, right) - value(below, left)) * fy;
    top + (bottom - top) * fz
}

/// The image under a Gaussian of this deviation, cells; zero outside.
fn blurred(image: &Field, sigma: f64) -> Field {
    let radius = ((3.0 * sigma).ceil() as usize).max(1);
    let half: Vec<f64> = (0..=radius).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
    let half: Vec<f32> = half.iter().map(|w| (w / sum) as f32).collect();
    let (columns, rows) = (image.columns, image.rows);
    let mut along_z = Field::filled(columns, rows, 0.0);
    for row in 0..rows {
        let out = &mut along_z.values[row * columns..][..columns];
        let first = row.saturating_sub(radius);
        let last = (row + radius).min(rows - 1);
        for other in first..=last {
            let weight = half[row.abs_diff(other)];
            let from = &image.values[other * columns..][..columns];
            for (out, value) in out.iter_mut().zip(from) {
                *out += weight * value;
            }
        }
    }
    let mut out = Field::filled(columns, rows, 0.0);
    let mut padded = vec![0f32; columns + 2 * radius];
    for (out, from) in out.values.chunks_exact_mut(columns).zip(along_z.values.chunks_exact(columns)) {
        padded[radius..radius + columns].copy_from_slice(from);
        for (out, value) in out.iter_mut().zip(from) {
            *out = half[0] * value;
        }
        for (i, weight) in half.iter().enumerate().skip(1) {
            let (left, right) = (&padded[radius - i..][..columns], &padded[radius + i..][..columns]);
            for ((out, left), right) in out.iter_mut().zip(left).zip(right) {
                *out += weight * (left + right);
            }
        }
    }
    out
}
