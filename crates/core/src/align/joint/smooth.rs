//! Gaussians of several widths of one image, the wide ones on coarser grids.

use crate::align::lanes::LANES;
use crate::relax::Field;

/// Deviations, meters.
const SIGMAS_M: [f64; 5] = [0.7e-3, 1e-3, 1.5e-3, 3e-3, 8e-3];
/// Nodes of the fine grid from one node to the next of the grid that a width is kept on.
const STRIDES: [usize; 5] = [1, 1, 1, 2, 4];

/// A band of lengths: positions in [`SIGMAS_M`] of the narrower and the wider Gaussian, whose difference it is.
pub(super) type Band = [usize; 2];
/// Bands: the one that starts are told apart by, the one that decides, and the one in which the answer is made precise. A finer
/// one is pixel noise.
pub(super) const BANDS: [Band; 3] = [[2, 4], [1, 3], [0, 2]];
/// Positions of the last two.
pub(super) const DECIDING: usize = 1;
pub(super) const FINEST: usize = 2;

/// Values on a grid, `C` for each node side by side, row by row. Rows are padded with zeros to whole steps of lanes.
pub(super) struct Layer<const C: usize> {
    pub(super) columns: usize,
    rows: usize,
    stride: usize,
    values: Vec<f32>,
}

impl Layer<1> {
    pub(super) fn of(field: &Field) -> Self {
        let mut layer = Self::zero(field.columns, field.rows);
        for (row, from) in field.values.chunks_exact(field.columns).enumerate() {
            layer.row_mut(row).as_flattened_mut().copy_from_slice(from);
        }
        layer
    }
}

impl<const C: usize> Layer<C> {
    pub(super) fn zero(columns: usize, rows: usize) -> Self {
        let stride = (columns * C).next_multiple_of(LANES);
        Self { columns, rows, stride, values: vec![0.0; stride * rows] }
    }

    pub(super) fn row_mut(&mut self, row: usize) -> &mut [[f32; C]] {
        &mut self.values[row * self.stride..].as_chunks_mut().0[..self.columns]
    }

    #[inline]
    fn at(&self, column: usize, row: usize) -> [f32; C] {
        let at = row * self.stride + column * C;
        std::array::from_fn(|i| self.values[at + i])
    }

    /// Every second node.
    fn thinned(&self) -> Self {
        let mut out = Self::zero(self.columns.div_ceil(2), self.rows.div_ceil(2));
        for row in 0..out.rows {
            let from = self.values[2 * row * self.stride..].as_chunks::<C>().0.iter().step_by(2);
            out.row_mut(row).iter_mut().zip(from).for_each(|(out, from)| *out = *from);
        }
        out
    }

    /// Bilinear between the nodes of this grid, which is `STRIDE` times as coarse as the one of the node that is asked.
    #[inline]
    fn between<const STRIDE: usize>(&self, column: usize, row: usize) -> [f32; C] {
        let along = |at: usize, last: usize| {
            let (low, rest) = (at / STRIDE, at % STRIDE);
            (low.min(last), (low + 1).min(last), rest as f32 / STRIDE as f32)
        };
        let (left, right, fy) = along(column, self.columns - 1);
        let (above, below, fz) = along(row, self.rows - 1);
        let mix = |a: [f32; C], b: [f32; C], f: f32| std::array::from_fn(|i| a[i] + (b[i] - a[i]) * f);
        let top = mix(self.at(left, above), self.at(right, above), fy);
        let bottom = mix(self.at(left, below), self.at(right, below), fy);
        mix(top, bottom, fz)
    }

    /// The values under a Gaussian of this deviation, cells; zero outside.
    fn blurred(&self, sigma: f64) -> Self {
        let radius = ((2.5 * sigma).ceil() as usize).max(1);
        let half: Vec<f64> = (0..=radius).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
        let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
        let half: Vec<f32> = half.iter().map(|w| (w / sum) as f32).collect();
        let mut out = Self::zero(self.columns, self.rows);
        let margin = radius * C;
        let mut line = vec![0f32; self.stride + 2 * margin];
        for row in 0..self.rows {
            let nearest = row.saturating_sub(radius)..(row + radius + 1).min(self.rows);
            for at in (0..self.stride).step_by(LANES) {
                let mut sum = [0f32; LANES];
                for other in nearest.clone() {
                    add(&mut sum, half[row.abs_diff(other)], &self.values[other * self.stride + at..]);
                }
                line[margin + at..][..LANES].copy_from_slice(&sum);
            }
            let to = &mut out.values[row * self.stride..][..self.stride];
            for (step, to) in to.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
                let from = &line[step * LANES..][..2 * margin + LANES];
                let mut sum = [0f32; LANES];
                for i in 0..=2 * radius {
                    add(&mut sum, half[i.abs_diff(radius)], &from[i * C..]);
                }
                *to = sum;
            }
            to[self.columns * C..].fill(0.0);
        }
        out
    }
}

/// Adds `weight` times the first of some values.
#[inline(always)]
fn add(to: &mut [f32; LANES], weight: f32, from: &[f32]) {
    let from = &from[..LANES];
    for l in 0..LANES {
        to[l] += weight * from[l];
    }
}

/// An image under Gaussians of all widths. Outside it is zero.
pub(super) struct Smooth<const C: usize> {
    layers: [Layer<C>; SIGMAS_M.len()],
}

impl<const C: usize> Smooth<C> {
    /// Of an image on a grid of spacing `step_m` that is smooth already: under a kernel of the variance `before_m2`.
    pub(super) fn new(image: &Layer<C>, step_m: f64, before_m2: f64) -> Self {
        let mut before = before_m2;
        let mut stride = 1;
        let mut layers: [Layer<C>; SIGMAS_M.len()] = std::array::from_fn(|_| Layer::zero(0, 0));
        for i in 0..SIGMAS_M.len() {
            // Gaussians add up by their squares: each is made of the one before.
            let sigma = (SIGMAS_M[i].powi(2) - before).sqrt();
            before = SIGMAS_M[i].powi(2);
            let from = if i == 0 { image } else { &layers[i - 1] };
            layers[i] = if STRIDES[i] == stride {
                from.blurred(sigma / (step_m * stride as f64))
            } else {
                stride *= 2;
                from.thinned().blurred(sigma / (step_m * stride as f64))
            };
        }
        Self { layers }
    }

    /// The values under Gaussian number `sigma` at a node of the fine grid.
    #[inline]
    pub(super) fn at(&self, sigma: usize, column: usize, row: usize) -> [f32; C] {
        let layer = &self.layers[sigma];
        match STRIDES[sigma] {
            1 => layer.at(column, row),
            2 => layer.between::<2>(column, row),
            _ => layer.between::<4>(column, row),
        }
    }
}
