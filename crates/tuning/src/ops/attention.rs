//! [`attention`]: multi-head attention of queries on keys and values.

use super::math::{exp, sum};
use super::product::{Into, Matrix, product};
use crate::tape::Tensor;

#[derive(Clone, Copy)]
struct Sizes {
    batch: usize,
    heads: usize,
    /// Rows of queries, and of keys and values.
    tokens: usize,
    sources: usize,
    dim: usize,
}

impl Sizes {
    fn per_head(self) -> usize {
        self.dim / self.heads
    }

    fn scale(self) -> f32 {
        1.0 / (self.per_head() as f32).sqrt()
    }

    fn read(self) -> usize {
        self.tokens * self.sources
    }

    /// One head of queries, results or their slopes.
    fn of_tokens(self, all: &[f32], item: usize, head: usize) -> Matrix<'_> {
        let start = item * self.tokens * self.dim + head * self.per_head();
        Matrix::within(&all[start..], self.tokens, self.per_head(), self.dim)
    }

    /// One head of keys (which = 0) or values (1).
    fn of_sources(self, both: &[f32], item: usize, head: usize, which: usize) -> Matrix<'_> {
        let start = item * self.sources * 2 * self.dim + which * self.dim + head * self.per_head();
        Matrix::within(&both[start..], self.sources, self.per_head(), 2 * self.dim)
    }

    fn heads(self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.batch).flat_map(move |item| (0..self.heads).map(move |head| (item, head)))
    }
}

/// Reads values by the likeness of queries `[n, tokens, dim]` and keys; keys and values are `[n, sources, 2 · dim]`, keys
/// first. The result is `[n, tokens, dim]`.
pub(crate) fn attention(queries: &Tensor, both: &Tensor, heads: usize) -> Tensor {
    let [batch, tokens, dim] = queries.dims();
    let [_, sources, _] = both.dims();
    let sizes = Sizes { batch, heads, tokens, sources, dim };
    let mut weights = vec![0.0; batch * heads * sizes.read()];
    let mut values = vec![0.0; queries.values().len()];
    let mut one = vec![0.0; tokens * sizes.per_head()];
    for ((item, head), weights) in sizes.heads().zip(weights.chunks_exact_mut(sizes.read())) {
        let keys = sizes.of_sources(both.values(), item, head, 0);
        product(weights, Into::New, sizes.of_tokens(queries.values(), item, head), keys.transposed());
        weights.chunks_exact_mut(sources).for_each(|row| softmax(row, sizes.scale()));
        let read = sizes.of_sources(both.values(), item, head, 1);
        product(&mut one, Into::New, Matrix::new(weights, tokens, sources), read);
        scatter(&one, &mut values[item * tokens * dim + head * sizes.per_head()..], sizes.per_head(), dim);
    }
    let (of_queries, of_both) = (queries.shared(), both.shared());
    Tensor::made([queries, both], queries.shape(), values, move |slope, [to_queries, to_both], slopes| {
        let input_slopes = backward(sizes, &slope, &weights, &of_queries, &of_both);
        slopes.add(to_queries, || input_slopes.queries);
        slopes.add(to_both, || input_slopes.both);
    })
}

struct InputSlopes {
    queries: Vec<f32>,
    both: Vec<f32>,
}

fn backward(sizes: Sizes, slope: &[f32], weights: &[f32], queries: &[f32], both: &[f32]) -> InputSlopes {
    let Sizes { tokens, sources, dim, .. } = sizes;
    let per_head = sizes.per_head();
    let mut input_slopes = InputSlopes { queries: vec![0.0; queries.len()], both: vec![0.0; both.len()] };
    let mut along = vec![0.0; sizes.read()];
    let mut one = vec![0.0; tokens.max(sources) * per_head];
    for ((item, head), weights) in sizes.heads().zip(weights.chunks_exact(sizes.read())) {
        let of_source = item * sources * 2 * dim + head * per_head;
        let result = sizes.of_tokens(slope, item, head);
        let read = Matrix::new(weights, tokens, sources);
        product(&mut one, Into::New, read.transposed(), result);
        scatter(&one[..sources * per_head], &mut input_slopes.both[of_source + dim..], per_head, 2 * dim);

        product(&mut along, Into::New, result, sizes.of_sources(both, item, head, 1).transposed());
        for (along, weights) in along.chunks_exact_mut(sources).zip(weights.chunks_exact(sources)) {
            let mean = sum(sources, |i| along[i] * weights[i]);
            let both = along.iter_mut().zip(weights);
            both.for_each(|(along, weight)| *along = (*along - mean) * weight * sizes.scale());
        }
        let likeness = Matrix::new(&along, tokens, sources);
        product(&mut one, Into::New, likeness, sizes.of_sources(both, item, head, 0));
        let to = &mut input_slopes.queries[item * tokens * dim + head * per_head..];
        scatter(&one[..tokens * per_head], to, per_head, dim);
        product(&mut one, Into::New, likeness.transposed(), sizes.of_tokens(queries, item, head));
        scatter(&one[..sources * per_head], &mut input_slopes.both[of_source..], per_head, 2 * dim);
    }
    input_slopes
}

/// Rows of a head to their places among the other heads.
fn scatter(rows: &[f32], to: &mut [f32], width: usize, stride: usize) {
    for (row, to) in rows.chunks_exact(width).zip(to.chunks_mut(stride)) {
        to[..width].copy_from_slice(row);
    }
}

/// `softmax(scale · row)` in place.
fn softmax(row: &mut [f32], scale: f32) {
    let largest = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    row.iter_mut().for_each(|value| *value = exp((*value - largest) * scale));
    let total = sum(row.len(), |i| row[i]);
    row.iter_mut().for_each(|value| *value /= total);
}
