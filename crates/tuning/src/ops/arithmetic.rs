//! Value by value: [`add`], [`add_each`], [`mul`], [`blend`], [`line`](fn@line), [`rescaled`], [`silu`].

use std::sync::Arc;

use super::math::sigmoid;
use crate::tape::Tensor;

fn zipped(a: &[f32], b: &[f32], of: impl Fn(f32, f32) -> f32) -> Vec<f32> {
    a.iter().zip(b).map(|(&a, &b)| of(a, b)).collect()
}

fn mapped(a: &[f32], of: impl Fn(f32) -> f32) -> Vec<f32> {
    a.iter().map(|&a| of(a)).collect()
}

/// `a + b`.
pub fn add(a: &Tensor, b: &Tensor) -> Tensor {
    assert_eq!(a.values().len(), b.values().len(), "{:?} + {:?}", a.shape(), b.shape());
    Tensor::made([a, b], a.shape(), zipped(a.values(), b.values(), |a, b| a + b), |slope, [to_a, to_b], slopes| {
        slopes.add(to_b, || slope.clone());
        slopes.add(to_a, || slope);
    })
}

/// `x + row` for each item of a batch `[n, …]`; the row is `[1, …]`.
pub(crate) fn add_each(x: &Tensor, row: &Tensor) -> Tensor {
    let length = row.values().len();
    let values = x.values().chunks_exact(length).flat_map(|item| zipped(item, row.values(), |a, b| a + b)).collect();
    Tensor::made([x, row], x.shape(), values, move |slope, [to_x, to_row], slopes| {
        slopes.add(to_row, || summed(&slope, length));
        slopes.add(to_x, || slope);
    })
}

/// Sum over the items of a batch.
pub(super) fn summed(batch: &[f32], length: usize) -> Vec<f32> {
    let mut sum = vec![0.0; length];
    for item in batch.chunks_exact(length) {
        sum.iter_mut().zip(item).for_each(|(sum, value)| *sum += value);
    }
    sum
}

/// `a · b`, value by value.
pub(crate) fn mul(a: &Tensor, b: &Tensor) -> Tensor {
    assert_eq!(a.values().len(), b.values().len(), "{:?} * {:?}", a.shape(), b.shape());
    let (of_a, of_b) = (a.shared(), b.shared());
    Tensor::made([a, b], a.shape(), zipped(a.values(), b.values(), |a, b| a * b), move |slope, [to_a, to_b], slopes| {
        slopes.add(to_a, || zipped(&slope, &of_b, |s, b| s * b));
        slopes.add(to_b, || zipped(&slope, &of_a, |s, a| s * a));
    })
}

/// `a · of_a + b · of_b` with fixed factors.
pub fn blend(a: &Tensor, of_a: f32, b: &Tensor, of_b: f32) -> Tensor {
    assert_eq!(a.values().len(), b.values().len(), "{:?} and {:?}", a.shape(), b.shape());
    let values = zipped(a.values(), b.values(), |a, b| a * of_a + b * of_b);
    Tensor::made([a, b], a.shape(), values, move |slope, [to_a, to_b], slopes| {
        slopes.add(to_a, || mapped(&slope, |s| s * of_a));
        slopes.add(to_b, || mapped(&slope, |s| s * of_b));
    })
}

/// `x · factor + offset` with fixed numbers.
pub fn line(x: &Tensor, factor: f32, offset: f32) -> Tensor {
    Tensor::made([x], x.shape(), mapped(x.values(), |x| x * factor + offset), move |slope, [to_x], slopes| {
        slopes.add(to_x, || mapped(&slope, |s| s * factor));
    })
}

/// `x · scale + shift` for each item of a batch, with fixed arrays of an item's size.
pub(crate) fn rescaled(x: &Tensor, scale: Arc<Vec<f32>>, shift: &[f32]) -> Tensor {
    let item = |item: &[f32]| zipped(&zipped(item, &scale, |x, s| x * s), shift, |x, s| x + s);
    let values = x.values().chunks_exact(shift.len()).flat_map(item).collect();
    Tensor::made([x], x.shape(), values, move |slope, [to_x], slopes| {
        let item = |item: &[f32]| zipped(item, &scale, |x, s| x * s);
        slopes.add(to_x, || slope.chunks_exact(scale.len()).flat_map(item).collect());
    })
}

/// `x · sigmoid(x)`.
pub(crate) fn silu(x: &Tensor) -> Tensor {
    let input = x.shared();
    Tensor::made([x], x.shape(), mapped(x.values(), |x| x * sigmoid(x)), move |slope, [to_x], slopes| {
        slopes.add(to_x, || {
            zipped(&slope, &input, |slope, x| {
                let s = sigmoid(x);
                slope * s * (1.0 + x * (1.0 - s))
            })
        });
    })
}
