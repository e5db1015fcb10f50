//! [`conv2d`]: convolution as a matrix product over unrolled patches.
//!
//! Patches of a few output rows at a time are unrolled into a matrix that stays in the cache; the backward pass unrolls
//! them again. (As a convolution with the batch for channels, the weights' gradient takes as long for four pictures as
//! for eight.)

use super::math::sum;
use super::product::{Into, Matrix, product};
use crate::tape::Tensor;

/// Convolution (cross-correlation) of pictures `[n, c, h, w]` with square kernels `[filters, c, k, k]` and a bias per
/// filter, padded with zeros.
pub(crate) fn conv2d(input: &Tensor, weight: &Tensor, bias: &Tensor, stride: usize, padding: usize) -> Tensor {
    let g = Geometry::new(input.dims(), weight.dims(), stride, padding);
    let output = forward(input.values(), weight.values(), bias.values(), g);
    let shape = [g.batch, g.filters, g.out_height, g.out_width];
    let (of_input, of_weight) = (input.shared(), weight.shared());
    Tensor::made([input, weight, bias], &shape, output, move |slope, [to_input, to_weight, to_bias], slopes| {
        let wanted = [slopes.wants(to_input), slopes.wants(to_weight)];
        let input_slopes = InputSlopes::new(&slope, &of_input, &of_weight, g, wanted);
        slopes.add(to_input, || input_slopes.input);
        slopes.add(to_weight, || input_slopes.weight);
        slopes.add(to_bias, || {
            let mut sums = vec![0.0; g.filters];
            for (i, channel) in slope.chunks_exact(g.out_pixels()).enumerate() {
                sums[i % g.filters] += sum(channel.len(), |i| channel[i]);
            }
            sums
        });
    })
}

#[derive(Clone, Copy, Debug)]
struct Geometry {
    batch: usize,
    channels: usize,
    height: usize,
    width: usize,
    filters: usize,
    kernel: usize,
    stride: usize,
    padding: usize,
    out_height: usize,
    out_width: usize,
}

/// Most values of the matrix of patches: what a core's second cache holds.
const PATCHES: usize = 196_608;
/// Most columns of that matrix: more do not make the products faster.
const COLUMNS: usize = 1024;

impl Geometry {
    fn new(input: [usize; 4], weight: [usize; 4], stride: usize, padding: usize) -> Self {
        let ([batch, channels, height, width], [filters, _, kernel, _]) = (input, weight);
        let out = |size: usize| (size + 2 * padding - kernel) / stride + 1;
        let (out_height, out_width) = (out(height), out(width));
        Self { batch, channels, height, width, filters, kernel, stride, padding, out_height, out_width }
    }

    /// Values of a patch.
    fn patch(&self) -> usize {
        self.channels * self.kernel * self.kernel
    }

    /// Pixels of a channel of the output.
    fn out_pixels(&self) -> usize {
        self.out_height * self.out_width
    }

    /// Output rows that are taken at once, across the borders of pictures.
    fn tile_rows(&self) -> usize {
        let most = (COLUMNS / self.out_width).max(1);
        (PATCHES / self.patch() / self.out_width).clamp(1, most).min(self.batch * self.out_height)
    }

    fn tiles(self) -> impl Iterator<Item = Tile> {
        let (all, rows) = (self.batch * self.out_height, self.tile_rows());
        (0..all).step_by(rows).map(move |first| Tile { g: self, first, rows: rows.min(all - first) })
    }
}

/// Some rows of the output, counted through all pictures.
struct Tile {
    g: Geometry,
    first: usize,
    rows: usize,
}

/// One output row of one row of the matrix of patches.
struct Run {
    /// Index in the matrix where it begins.
    start: usize,
    /// The columns that see the picture, not its padding, and where in the input they begin.
    seen: Option<(std::ops::Range<usize>, usize)>,
}

impl Tile {
    /// Columns of the matrix of patches.
    fn columns(&self) -> usize {
        self.rows * self.g.out_width
    }

    fn for_each_run(&self, mut act: impl FnMut(Run)) {
        let g = self.g;
        for row in 0..g.patch() {
            let (channel, y, x) = (row / (g.kernel * g.kernel), row / g.kernel % g.kernel, row % g.kernel);
            // Columns o with 0 <= o * stride + x - padding < width.
            let low = g.padding.saturating_sub(x).div_ceil(g.stride).min(g.out_width);
            let high = (g.width + g.padding).saturating_sub(x).div_ceil(g.stride).min(g.out_width).max(low);
            for out in 0..self.rows {
                let (picture, out_y) = ((self.first + out) / g.out_height, (self.first + out) % g.out_height);
                let start = row * self.columns() + out * g.out_width;
                let in_y = (out_y * g.stride + y).checked_sub(g.padding).filter(|&y| y < g.height);
                let seen = in_y.filter(|_| low < high).map(|in_y| {
                    let line = ((picture * g.channels + channel) * g.height + in_y) * g.width;
                    (low..high, line + low * g.stride + x - g.padding)
                });
                act(Run { start, seen });
            }
        }
    }

    fn unroll(&self, input: &[f32], patches: &mut [f32]) {
        let (width, stride) = (self.g.out_width, self.g.stride);
        self.for_each_run(|run| {
            let to = &mut patches[run.start..run.start + width];
            let Some((columns, from)) = run.seen else { return to.fill(0.0) };
            to[..columns.start].fill(0.0);
            to[columns.end..].fill(0.0);
            let to = &mut to[columns];
            if stride == 1 {
                to.copy_from_slice(&input[from..from + to.len()]);
            } else {
                to.iter_mut().zip(input[from..].iter().step_by(stride)).for_each(|(to, &from)| *to = from);
            }
        });
    }

    /// Adds patches to the pixels they were taken from.
    fn roll(&self, patches: &[f32], input: &mut [f32]) {
        let (width, stride) = (self.g.out_width, self.g.stride);
        self.for_each_run(|run| {
            let Some((columns, to)) = run.seen else { return };
            let from = &patches[run.start..run.start + width][columns];
            if stride == 1 {
                input[to..to + from.len()].iter_mut().zip(from).for_each(|(to, from)| *to += from);
            } else {
                input[to..].iter_mut().step_by(stride).zip(from).for_each(|(to, from)| *to += from);
            }
        });
    }

    /// The pieces of single pictures: first column in the tile, columns, and the first filter's place in the output.
    fn for_each_piece(&self, mut act: impl FnMut(usize, usize, usize)) {
        let g = self.g;
        let mut row = 0;
        while row < self.rows {
            let (picture, y) = ((self.first + row) / g.out_height, (self.first + row) % g.out_height);
            let rows = (g.out_height - y).min(self.rows - row);
            let place = picture * g.filters * g.out_pixels() + y * g.out_width;
            act(row * g.out_width, rows * g.out_width, place);
            row += rows;
        }
    }
}

fn forward(input: &[f32], weight: &[f32], bias: &[f32], g: Geometry) -> Vec<f32> {
    let mut output = vec![0.0; g.batch * g.filters * g.out_pixels()];
    let most = g.tile_rows() * g.out_width;
    let (mut patches, mut out) = (vec![0.0; g.patch() * most], vec![0.0; g.filters * most]);
    for tile in g.tiles() {
        let columns = tile.columns();
        tile.unroll(input, &mut patches);
        let (kernels, seen) = (Matrix::new(weight, g.filters, g.patch()), Matrix::new(&patches, g.patch(), columns));
        product(&mut out, Into::New, kernels, seen);
        tile.for_each_piece(|column, length, place| {
            for (filter, bias) in bias.iter().enumerate() {
                let to = &mut output[place + filter * g.out_pixels()..][..length];
                let from = &out[filter * columns + column..][..length];
                to.iter_mut().zip(from).for_each(|(to, from)| *to = from + bias);
            }
        });
    }
    output
}

/// Slopes of the loss along input and weights; empty where not asked for.
struct InputSlopes {
    input: Vec<f32>,
    weight: Vec<f32>,
}

impl InputSlopes {
    fn new(slope: &[f32], input: &[f32], weight: &[f32], g: Geometry, [of_input, of_weight]: [bool; 2]) -> Self {
        let zeros = |wanted: bool, like: &[f32]| vec![0.0; if wanted { like.len() } else { 0 }];
        let mut input_slopes = Self { input: zeros(of_input, input), weight: zeros(of_weight, weight) };
        let most = g.tile_rows() * g.out_width;
        let (mut patches, mut out) = (vec![0.0; g.patch() * most], vec![0.0; g.filters * most]);
        for tile in g.tiles() {
            let columns = tile.columns();
            tile.for_each_piece(|column, length, place| {
                for filter in 0..g.filters {
                    let from = &slope[place + filter * g.out_pixels()..][..length];
                    out[filter * columns + column..][..length].copy_from_slice(from);
                }
            });
            let along = Matrix::new(&out, g.filters, columns);
            if of_weight {
                tile.unroll(input, &mut patches);
                let seen = Matrix::new(&patches, g.patch(), columns);
                product(&mut input_slopes.weight, Into::Sum, along, seen.transposed());
            }
            if of_input {
                let kernels = Matrix::new(weight, g.filters, g.patch());
                product(&mut patches, Into::New, kernels.transposed(), along);
                tile.roll(&patches, &mut input_slopes.input);
            }
        }
        input_slopes
    }
}
