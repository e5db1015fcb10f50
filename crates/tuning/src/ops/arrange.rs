//! Values in other places: [`beside`], [`channels`], [`doubled`], [`repeated`], [`swapped`].

use std::ops::Range;

use super::arithmetic::summed;
use crate::tape::Tensor;

/// The pictures `[n, a, …]` and `[n, b, …]` as `[n, a + b, …]`.
pub fn beside(a: &Tensor, b: &Tensor) -> Tensor {
    let batch = a.shape()[0];
    let [of_a, of_b] = [a, b].map(|t| t.values().len() / batch);
    let items = a.values().chunks_exact(of_a).zip(b.values().chunks_exact(of_b));
    let values = items.flat_map(|(a, b)| a.iter().chain(b).copied()).collect();
    let mut shape = a.shape().to_vec();
    shape[1] += b.shape()[1];
    Tensor::made([a, b], &shape, values, move |slope, [to_a, to_b], slopes| {
        let items = slope.chunks_exact(of_a + of_b);
        slopes.add(to_a, || items.clone().flat_map(|item| &item[..of_a]).copied().collect());
        slopes.add(to_b, || items.flat_map(|item| &item[of_a..]).copied().collect());
    })
}

/// Some channels of pictures `[n, c, …]`.
pub fn channels(x: &Tensor, range: Range<usize>) -> Tensor {
    let mut shape = x.shape().to_vec();
    let pixels: usize = shape[2..].iter().product();
    let item = shape[1] * pixels;
    let kept = range.start * pixels..range.end * pixels;
    shape[1] = range.len();
    let values = x.values().chunks_exact(item).flat_map(|item| item[kept.clone()].iter().copied()).collect();
    Tensor::made([x], &shape, values, move |slope, [to_x], slopes| {
        slopes.add(to_x, || {
            let mut whole = vec![0.0; slope.len() / kept.len() * item];
            for (to, from) in whole.chunks_exact_mut(item).zip(slope.chunks_exact(kept.len())) {
                to[kept.clone()].copy_from_slice(from);
            }
            whole
        });
    })
}

/// Pictures `[n, c, h, w]` at twice their size, each pixel repeated.
pub fn doubled(x: &Tensor) -> Tensor {
    let [n, c, h, w] = x.dims();
    let mut values = Vec::with_capacity(4 * x.values().len());
    for row in x.values().chunks_exact(w) {
        let first = values.len();
        values.extend(row.iter().flat_map(|&value| [value, value]));
        values.extend_from_within(first..);
    }
    Tensor::made([x], &[n, c, 2 * h, 2 * w], values, move |slope, [to_x], slopes| {
        let pair = |pair: &[f32]| pair[0] + pair[1];
        let rows = slope.chunks_exact(4 * w).flat_map(|rows| {
            let (upper, lower) = rows.split_at(2 * w);
            upper.chunks_exact(2).zip(lower.chunks_exact(2)).map(|(upper, lower)| pair(upper) + pair(lower))
        });
        slopes.add(to_x, || rows.collect());
    })
}

/// `[1, …]` as `[n, …]`.
pub fn repeated(x: &Tensor, n: usize) -> Tensor {
    let mut shape = x.shape().to_vec();
    shape[0] = n;
    let length = x.values().len();
    Tensor::made([x], &shape, x.values().repeat(n), move |slope, [to_x], slopes| {
        slopes.add(to_x, || summed(&slope, length));
    })
}

/// `[n, a, b]` as `[n, b, a]`.
pub fn swapped(x: &Tensor) -> Tensor {
    let [n, a, b] = x.dims();
    Tensor::made([x], &[n, b, a], transposed(x.values(), a, b), move |slope, [to_x], slopes| {
        slopes.add(to_x, || transposed(&slope, b, a));
    })
}

fn transposed(values: &[f32], rows: usize, columns: usize) -> Vec<f32> {
    let items = values.chunks_exact(rows * columns);
    items.flat_map(|item| (0..rows * columns).map(move |i| item[i % rows * columns + i / rows])).collect()
}
