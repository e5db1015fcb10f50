//! [`group_norm`]: group normalization, scale and shift per channel, and SiLU, in one operator; [`layer_norm`] of tokens.
//!
//! As separate operators each would keep a copy of the picture for its backward pass; together they keep only the input.

use std::sync::Arc;

use super::math::{sigmoid, sum};
use crate::tape::Tensor;

/// Groups of channels that are normalized together, in every network here.
pub(crate) const GROUPS: usize = 8;
const EPSILON: f32 = 1e-5;

/// Activation that follows the normalization.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Activation {
    /// Nothing.
    None,
    /// `x · sigmoid(x)`.
    Silu,
}

/// Normalizes pictures `[n, c, h, w]` in [`GROUPS`] groups of channels, scales and shifts each channel, and activates.
pub(crate) fn group_norm(input: &Tensor, scale: &Tensor, shift: &Tensor, then: Activation) -> Tensor {
    let [_, channels, height, width] = input.dims();
    normalized(input, scale, shift, Layout { channels, groups: GROUPS, pixels: height * width }, then)
}

/// Normalizes each token of `[n, tokens, dim]`, scales and shifts each of its values.
pub(crate) fn layer_norm(input: &Tensor, scale: &Tensor, shift: &Tensor) -> Tensor {
    let [.., dim] = input.dims::<3>();
    normalized(input, scale, shift, Layout { channels: dim, groups: 1, pixels: 1 }, Activation::None)
}

fn normalized(input: &Tensor, scale: &Tensor, shift: &Tensor, layout: Layout, then: Activation) -> Tensor {
    let (output, moments) = forward(input.values(), scale.values(), shift.values(), layout, then);
    let saved = Saved { input: input.shared(), scale: scale.shared(), shift: shift.shared(), moments, layout, then };
    Tensor::made([input, scale, shift], input.shape(), output, move |slope, [to_input, to_scale, to_shift], slopes| {
        let input_slopes = InputSlopes::new(slope, &saved);
        slopes.add(to_input, || input_slopes.input);
        slopes.add(to_scale, || input_slopes.scale);
        slopes.add(to_shift, || input_slopes.shift);
    })
}

#[derive(Clone, Copy, Debug)]
struct Layout {
    channels: usize,
    groups: usize,
    pixels: usize,
}

impl Layout {
    /// Values that are normalized together.
    fn block(self) -> usize {
        self.channels / self.groups * self.pixels
    }

    /// The channel of the `k`-th channel of the `block`-th block.
    fn channel(self, block: usize, k: usize) -> usize {
        block % self.groups * (self.channels / self.groups) + k
    }
}

/// Mean and inverse standard deviation of a block.
#[derive(Clone, Copy, Debug)]
struct Moments {
    mean: f32,
    inverse: f32,
}

impl Moments {
    fn of(block: &[f32]) -> Self {
        let count = block.len() as f32;
        let mean = sum(block.len(), |i| block[i]) / count;
        let variance = sum(block.len(), |i| (block[i] - mean) * (block[i] - mean)) / count;
        Self { mean, inverse: 1.0 / (variance + EPSILON).sqrt() }
    }

    /// Factor and offset of a channel's values.
    fn line(self, scale: f32, shift: f32) -> (f32, f32) {
        let factor = self.inverse * scale;
        (factor, shift - self.mean * factor)
    }
}

fn forward(input: &[f32], scale: &[f32], shift: &[f32], layout: Layout, then: Activation) -> (Vec<f32>, Vec<Moments>) {
    let mut output = Vec::with_capacity(input.len());
    let mut moments = Vec::new();
    for (i, block) in input.chunks_exact(layout.block()).enumerate() {
        let of_block = Moments::of(block);
        for (k, values) in block.chunks_exact(layout.pixels).enumerate() {
            let channel = layout.channel(i, k);
            let (factor, offset) = of_block.line(scale[channel], shift[channel]);
            let line = values.iter().map(|x| x * factor + offset);
            match then {
                Activation::None => output.extend(line),
                Activation::Silu => output.extend(line.map(|u| u * sigmoid(u))),
            }
        }
        moments.push(of_block);
    }
    (output, moments)
}

struct Saved {
    input: Arc<Vec<f32>>,
    scale: Arc<Vec<f32>>,
    shift: Arc<Vec<f32>>,
    moments: Vec<Moments>,
    layout: Layout,
    then: Activation,
}

/// Slopes of the loss along the three inputs.
struct InputSlopes {
    input: Vec<f32>,
    scale: Vec<f32>,
    shift: Vec<f32>,
}

impl InputSlopes {
    fn new(slope: Vec<f32>, saved: &Saved) -> Self {
        let Saved { layout, then, moments, .. } = saved;
        let (block, zeros) = (layout.block(), vec![0.0; layout.channels]);
        let mut input_slopes = Self { input: slope, scale: zeros.clone(), shift: zeros };
        let (scale, shift) = (&saved.scale, &saved.shift);
        let blocks = saved.input.chunks_exact(block).zip(input_slopes.input.chunks_exact_mut(block));
        for (i, ((values, slopes_in), &Moments { mean, inverse })) in blocks.zip(moments).enumerate() {
            // The block's mean slope, and its mean slope along the normalized values, both scaled: what mean and
            // deviation take back.
            let (mut along_mean, mut along_deviation) = (0.0, 0.0);
            let channels = values.chunks_exact(layout.pixels).zip(slopes_in.chunks_exact_mut(layout.pixels));
            for (k, (values, du)) in channels.enumerate() {
                let channel = layout.channel(i, k);
                let (scale, shift) = (scale[channel], shift[channel]);
                if *then == Activation::Silu {
                    let (factor, offset) = Moments { mean, inverse }.line(scale, shift);
                    for (x, du) in values.iter().zip(du.iter_mut()) {
                        let u = x * factor + offset;
                        let s = sigmoid(u);
                        *du *= s * (1.0 + u * (1.0 - s));
                    }
                }
                let of_shift = sum(du.len(), |i| du[i]);
                let of_scale = sum(du.len(), |i| du[i] * (values[i] - mean)) * inverse;
                input_slopes.shift[channel] += of_shift;
                input_slopes.scale[channel] += of_scale;
                along_mean += of_shift * scale;
                along_deviation += of_scale * scale;
            }
            let (along_mean, along_deviation) = (along_mean / block as f32, along_deviation / block as f32);
            let channels = values.chunks_exact(layout.pixels).zip(slopes_in.chunks_exact_mut(layout.pixels));
            for (k, (values, du)) in channels.enumerate() {
                let scale = scale[layout.channel(i, k)];
                for (x, du) in values.iter().zip(du) {
                    *du = inverse * (*du * scale - along_mean - (x - mean) * inverse * along_deviation);
                }
            }
        }
        input_slopes
    }
}
