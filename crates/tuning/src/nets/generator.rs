//! The latent-diffusion generator: [`encode`], [`denoise`], [`decode`], with the sizes of their layers ([`Sizes`]) and
//! the noise [`Schedule`].
//!
//! The networks are those of `training/models.py`; a file may have other widths than the shipped bundle.

use std::sync::Arc;

use super::layers::{HEADS, Layers};
use super::layout::Layout;
use crate::error::{Error, Result};
use crate::onnx::Onnx;
use crate::ops::{self, Activation, GROUPS};
use crate::params::{Leaves, Params};
use crate::tape::Tensor;

/// In front of the names of the condition encoder's weights.
pub(crate) const ENCODER: &str = "encoder/";
/// In front of the names of the denoiser's weights.
pub const DENOISER: &str = "denoiser/";
/// In front of the names of the decoder's weights.
pub(crate) const DECODER: &str = "decoder/";

/// Channels of the latent.
pub(crate) const LATENT: usize = 4;
/// Pixels of the picture per cell of the latent.
const CELL: usize = 8;
/// Pixels of the picture per token of the encoder.
const TOKEN: usize = 16;
/// Self-attention blocks of the encoder.
const DEPTH: usize = 3;
/// Colors of the input.
const COLORS: usize = 3;

/// The sizes by which files may differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Rows and columns of picture and imprint.
    pub side: usize,
    /// Widths of the encoder's trunk; the last is that of its tokens.
    pub trunk: [usize; 3],
    /// Channels of the condition.
    pub condition: usize,
    /// Widths of the denoiser's levels.
    pub levels: [usize; 3],
    /// Sinusoids of the step, and width of their embedding.
    pub time: [usize; 2],
    /// Widths of the decoder's levels.
    pub decoder: [usize; 4],
    /// Shape of the mean of the latents.
    pub(crate) mean: Vec<usize>,
    /// Shape of the deviation of the latents.
    pub(crate) deviation: Vec<usize>,
}

/// The three files of a bundle, decoded.
#[derive(Clone, Debug)]
pub struct Files {
    /// Makes the condition.
    pub encoder: Onnx,
    /// Removes noise.
    pub denoiser: Onnx,
    /// Draws the imprint.
    pub decoder: Onnx,
}

impl Files {
    /// Decodes the three files.
    ///
    /// # Errors
    /// If one is not an ONNX file.
    pub fn parse(encoder: &[u8], denoiser: &[u8], decoder: &[u8]) -> Result<Self> {
        let parse = |network, bytes: &[u8]| Onnx::parse(bytes.to_vec()).map_err(|why| Error::Onnx { network, why });
        Ok(Self {
            encoder: parse("condition encoder", encoder)?,
            denoiser: parse("denoiser", denoiser)?,
            decoder: parse("decoder", decoder)?,
        })
    }

    /// The weights of all three, under names with the network in front.
    ///
    /// # Errors
    /// If a network is of another architecture.
    pub fn read(&self) -> Result<(Sizes, Params)> {
        let sizes = Sizes::of(self)?;
        let mut params = Params::default();
        sizes.encoder_layout().read("condition encoder", ENCODER, &self.encoder, &mut params)?;
        sizes.denoiser_layout().read("denoiser", DENOISER, &self.denoiser, &mut params)?;
        sizes.decoder_layout().read("decoder", DECODER, &self.decoder, &mut params)?;
        Ok((sizes, params))
    }
}

impl Sizes {
    /// Reads the sizes off some weights; [`Layout::read`] then holds all weights against them.
    fn of(files: &Files) -> Result<Self> {
        let size = |network: &'static str, file: &Onnx, weight: &str, axis: usize| {
            let entry = file.weights().iter().find(|w| w.name() == weight);
            let missing = || Error::Missing { network, weight: weight.to_owned() };
            entry.and_then(|w| w.shape().get(axis).copied()).ok_or_else(missing)
        };
        let encoder = |weight, axis| size("condition encoder", &files.encoder, weight, axis);
        let denoiser = |weight, axis| size("denoiser", &files.denoiser, weight, axis);
        let decoder = |weight, axis| size("decoder", &files.decoder, weight, axis);
        let shape = |weight: &str| {
            let entry = files.decoder.weights().iter().find(|w| w.name() == weight);
            entry.map(|w| w.shape().to_vec()).unwrap_or_default()
        };
        let cells = encoder("query", 1)?;
        let sizes = Self {
            side: cells.isqrt() * CELL,
            trunk: [encoder("trunk.0.bias", 0)?, encoder("trunk.2.bias", 0)?, encoder("trunk.4.bias", 0)?],
            condition: encoder("out.bias", 0)?,
            levels: [denoiser("enter.bias", 0)?, denoiser("down1.bias", 0)?, denoiser("down2.bias", 0)?],
            time: [denoiser("time.0.weight", 1)?, denoiser("time.2.bias", 0)?],
            decoder: [
                decoder("decoder.0.bias", 0)?,
                decoder("decoder.3.bias", 0)?,
                decoder("decoder.7.bias", 0)?,
                decoder("decoder.12.bias", 0)?,
            ],
            mean: shape("mean"),
            deviation: shape("std"),
        };
        sizes.check()
    }

    /// Checks what shapes alone do not say: sizes that norms, heads and halvings divide.
    fn check(self) -> Result<Self> {
        let cells = (self.side / CELL).pow(2);
        let [.., dim] = self.trunk;
        let [.., bottom] = self.levels;
        let normed = [&self.trunk[..], &self.levels[..], &self.decoder[..3], &[self.condition]].concat();
        let refuse = |weight: &str, found: usize, expected: usize| {
            let (found, expected) = (vec![found], vec![expected]);
            Error::Shape { network: "generator", weight: weight.to_owned(), found, expected }
        };
        if self.side == 0 || !self.side.is_multiple_of(4 * CELL) || self.side > 1024 {
            return Err(refuse("query", cells, 256));
        }
        if let Some(&width) = normed.iter().find(|&&width| width == 0 || !width.is_multiple_of(GROUPS)) {
            return Err(refuse("the width of a normalized layer", width, width.next_multiple_of(GROUPS).max(GROUPS)));
        }
        if let Some(&width) = [dim, bottom].iter().find(|&&width| !width.is_multiple_of(HEADS)) {
            return Err(refuse("the width of an attention", width, width.next_multiple_of(HEADS)));
        }
        if self.time[0] == 0 || !self.time[0].is_multiple_of(2) {
            return Err(refuse("time.0.weight", self.time[0], 96));
        }
        let broadcasts = |shape: &[usize]| {
            let whole = [1, LATENT, self.side / CELL, self.side / CELL];
            shape.len() == 4 && shape.iter().zip(whole).all(|(&size, whole)| size == whole || size == 1)
        };
        for (weight, found) in [("mean", &self.mean), ("std", &self.deviation)] {
            if !broadcasts(found) {
                let (found, expected) = (found.clone(), vec![1, LATENT, self.side / CELL, self.side / CELL]);
                return Err(Error::Shape { network: "decoder", weight: weight.to_owned(), found, expected });
            }
        }
        Ok(self)
    }

    /// Rows and columns of the latent.
    pub fn cells(&self) -> usize {
        self.side / CELL
    }

    /// Values of a latent.
    pub fn latent(&self) -> usize {
        LATENT * self.cells().pow(2)
    }

    /// Values of an imprint, and of one color of a picture.
    pub fn pixels(&self) -> usize {
        self.side.pow(2)
    }

    /// Values of a picture.
    pub fn picture(&self) -> usize {
        COLORS * self.pixels()
    }

    pub(crate) fn encoder_layout(&self) -> Layout {
        let mut l = Layout::default();
        let [a, b, dim] = self.trunk;
        let tokens = (self.side / TOKEN).pow(2);
        l.weight("place", &[1, tokens, dim]);
        l.weight("query", &[1, self.cells().pow(2), dim]);
        l.conv("trunk.0", COLORS, a, 8);
        l.residual("trunk.1", a, a, None);
        l.conv("trunk.2", a, b, 3);
        l.residual("trunk.3", b, b, None);
        l.conv("trunk.4", b, dim, 3);
        l.residual("trunk.5", dim, dim, None);
        l.group_norm("trunk.6", dim);
        for i in 0..DEPTH {
            l.transformer(&format!("mix.{i}"), dim);
        }
        l.layer_norm("norm", dim);
        l.transformer("read", dim);
        l.linear("narrow", dim, self.condition);
        l.residual("refine", self.condition, self.condition, None);
        l.conv("out", self.condition, self.condition, 1);
        l
    }

    pub(crate) fn denoiser_layout(&self) -> Layout {
        let mut l = Layout::default();
        let ([a, b, c], [sinusoids, e]) = (self.levels, self.time);
        l.gemm("time.0", sinusoids, e);
        l.gemm("time.2", e, e);
        l.conv("enter", LATENT + self.condition, a, 3);
        l.residual("d1", a, a, Some(e));
        l.conv("down1", a, b, 3);
        l.residual("d2", b, b, Some(e));
        l.conv("down2", b, c, 3);
        l.residual("m1", c, c, Some(e));
        l.residual("m2", c, c, Some(e));
        l.transformer("mix", c);
        l.conv("up2", c, b, 1);
        l.residual("u2", 2 * b, b, Some(e));
        l.conv("up1", b, a, 1);
        l.residual("u1", 2 * a, a, Some(e));
        l.group_norm("norm", a);
        l.conv("out", a, LATENT, 3);
        l
    }

    pub(crate) fn decoder_layout(&self) -> Layout {
        let mut l = Layout::default();
        let [a, b, c, d] = self.decoder;
        l.weight("mean", &self.mean);
        l.weight("std", &self.deviation);
        l.conv("decoder.0", LATENT, a, 3);
        l.residual("decoder.1", a, a, None);
        l.residual("decoder.2", a, a, None);
        l.conv("decoder.3", a, b, 1);
        l.residual("decoder.5", b, b, None);
        l.residual("decoder.6", b, b, None);
        l.conv("decoder.7", b, c, 1);
        l.residual("decoder.9", c, c, None);
        l.group_norm("decoder.10", c);
        l.conv("decoder.12", c, d, 3);
        l.conv("decoder.14", d, d, 3);
        l.conv("decoder.16", d, 1, 3);
        l
    }
}

/// Signal and noise by training step, "scaled linear".
#[derive(Clone, Debug)]
pub struct Schedule {
    /// ᾱ by step.
    bars: Vec<f64>,
}

/// Variance that training assumed around the encoder's estimate of the latent.
const ESTIMATE_VARIANCE: f64 = 0.05;

impl Schedule {
    /// Square roots of β run evenly from that of `start` to that of `end`.
    pub fn scaled_linear(steps: usize, start: f64, end: f64) -> Self {
        let (a, b) = (start.sqrt(), end.sqrt());
        let beta = |i: usize| (a + (b - a) * i as f64 / (steps.max(2) - 1) as f64).powi(2);
        let bars = (0..steps).scan(1.0, |bar, i| {
            *bar *= 1.0 - beta(i);
            Some(*bar)
        });
        Self { bars: bars.collect() }
    }

    /// Amplitudes of signal and noise at a step.
    pub(crate) fn amplitudes(&self, t: usize) -> (f64, f64) {
        (self.bars[t].sqrt(), (1.0 - self.bars[t]).sqrt())
    }

    /// ᾱ of a step.
    pub fn bar(&self, t: usize) -> f64 {
        self.bars[t]
    }

    /// The steps that a sampler of `count` steps takes, noisiest first, evenly spaced from the end.
    pub fn trailing(&self, count: usize) -> Vec<usize> {
        let total = self.bars.len();
        (0..count).map(|i| (2 * total * (count - i) + count) / (2 * count) - 1).collect()
    }

    /// Weights of the noisy latent and of the encoder's estimate in the best linear prediction of v: with the latent
    /// drawn from N(estimate, variance), its posterior mean is estimate + k (x − a · estimate).
    fn base(&self, t: usize) -> (f32, f32) {
        let (a, s) = self.amplitudes(t);
        let k = a * ESTIMATE_VARIANCE / (a * a * ESTIMATE_VARIANCE + s * s);
        (((a - k) / s) as f32, ((k * a - 1.0) / s) as f32)
    }
}

/// The condition encoder: standardized pictures `[n, 3, side, side]` to conditions `[n, condition, cells, cells]`.
pub fn encode(leaves: &Leaves<'_>, sizes: &Sizes, pictures: &[f32]) -> Tensor {
    let l = Layers::new(leaves, ENCODER);
    let n = pictures.len() / sizes.picture();
    let [.., dim] = sizes.trunk;
    let (cells, tokens) = (sizes.cells(), (sizes.side / TOKEN).pow(2));
    let x = Tensor::new(&[n, COLORS, sizes.side, sizes.side], of_equal_power(pictures, sizes.picture()));
    let x = l.residual(&l.conv(&x, "trunk.0", 4, 2), "trunk.1", None);
    let x = l.residual(&l.conv(&x, "trunk.2", 2, 1), "trunk.3", None);
    let x = l.residual(&l.conv(&x, "trunk.4", 2, 1), "trunk.5", None);
    let x = l.group_norm(&x, "trunk.6", Activation::None);
    let mut x = ops::add_each(&ops::swapped(&x.reshaped(&[n, dim, tokens])), &l.weight("place"));
    for i in 0..DEPTH {
        x = l.transformer(&x, None, &format!("mix.{i}"));
    }
    let x = l.layer_norm(&x, "norm");
    let x = l.transformer(&ops::repeated(&l.weight("query"), n), Some(&x), "read");
    let x = ops::swapped(&l.linear(&x, "narrow")).reshaped(&[n, sizes.condition, cells, cells]);
    l.conv(&l.residual(&x, "refine", None), "out", 1, 0)
}

/// Pictures without their strength: the strength of colors differs from sensor to sensor.
fn of_equal_power(pictures: &[f32], length: usize) -> Vec<f32> {
    let one = |picture: &[f32]| {
        let power = picture.iter().map(|&v| f64::from(v).powi(2)).sum::<f64>() / length as f64;
        let strength = (power as f32 + 0.02).sqrt();
        picture.iter().map(|v| v / strength).collect::<Vec<_>>()
    };
    pictures.chunks_exact(length).flat_map(one).collect()
}

/// The denoiser: v of noisy latents `[n, 4, cells, cells]` at a step, the same for the whole batch.
pub(crate) fn denoise(
    leaves: &Leaves<'_>,
    sizes: &Sizes,
    schedule: &Schedule,
    latents: &Tensor,
    t: usize,
    condition: &Tensor,
) -> Tensor {
    let l = Layers::new(leaves, DENOISER);
    let [n, ..] = latents.dims::<4>();
    let [.., bottom] = sizes.levels;
    let (of_latent, of_estimate) = schedule.base(t);
    let base = ops::blend(latents, of_latent, &ops::channels(condition, 0..LATENT), of_estimate);
    let e = Some(&time_embedding(&l, sizes.time[0], t));
    let h1 = l.residual(&l.conv(&ops::beside(latents, condition), "enter", 1, 1), "d1", e);
    let h2 = l.residual(&l.conv(&h1, "down1", 2, 1), "d2", e);
    let h = l.residual(&l.conv(&h2, "down2", 2, 1), "m1", e);
    let size = sizes.cells() / 4;
    let tokens = ops::swapped(&h.clone().reshaped(&[n, bottom, size * size]));
    let mixed = ops::swapped(&l.transformer(&tokens, None, "mix")).reshaped(&[n, bottom, size, size]);
    let h = l.residual(&ops::add(&h, &mixed), "m2", e);
    let h = l.residual(&ops::beside(&ops::doubled(&l.conv(&h, "up2", 1, 0)), &h2), "u2", e);
    let h = l.residual(&ops::beside(&ops::doubled(&l.conv(&h, "up1", 1, 0)), &h1), "u1", e);
    ops::add(&base, &l.conv(&l.group_norm(&h, "norm", Activation::Silu), "out", 1, 1))
}

/// Sinusoids of the step through a perceptron, `[1, e]`.
fn time_embedding(l: &Layers<'_>, sinusoids: usize, t: usize) -> Tensor {
    let half = sinusoids / 2;
    let rate = |i: usize| (i as f32 * (-(10000f32.ln()) / half as f32)).exp();
    let angles: Vec<f32> = (0..half).map(|i| t as f32 * rate(i)).collect();
    let waves: Vec<f32> =
        angles.iter().map(|angle| angle.cos()).chain(angles.iter().map(|angle| angle.sin())).collect();
    let waves = Tensor::new(&[1, sinusoids], waves);
    ops::silu(&l.gemm(&ops::silu(&l.gemm(&waves, "time.0")), "time.2"))
}

/// The decoder: latents to imprints `[n, 1, side, side]` in −1..1.
pub fn decode(leaves: &Leaves<'_>, latents: &Tensor) -> Tensor {
    let l = Layers::new(leaves, DECODER);
    let [_, _, cells, _] = latents.dims();
    let whole = |name: &str| spread(&l.weight(name), cells * cells);
    let x = ops::rescaled(latents, Arc::new(whole("std")), &whole("mean"));
    let x = l.residual(&l.conv(&x, "decoder.0", 1, 1), "decoder.1", None);
    let x = l.conv(&l.residual(&x, "decoder.2", None), "decoder.3", 1, 0);
    let x = l.residual(&ops::doubled(&x), "decoder.5", None);
    let x = l.conv(&l.residual(&x, "decoder.6", None), "decoder.7", 1, 0);
    let x = l.residual(&ops::doubled(&x), "decoder.9", None);
    let x = l.conv(&l.group_norm(&x, "decoder.10", Activation::Silu), "decoder.12", 1, 1);
    let x = ops::silu(&l.conv(&ops::doubled(&x), "decoder.14", 1, 1));
    l.conv(&x, "decoder.16", 1, 1)
}

/// Values per channel, or per place, for all places of a latent.
fn spread(values: &Tensor, places: usize) -> Vec<f32> {
    let [_, channels, rows, columns] = values.dims();
    let (width, height) = (places.isqrt(), places.isqrt());
    let value = |i: usize| {
        let (channel, y, x) = (i / places, i % places / width, i % width);
        let (channel, y, x) = (channel.min(channels - 1), (y * rows) / height, (x * columns) / width);
        values.values()[(channel * rows + y) * columns + x]
    };
    (0..LATENT * places).map(value).collect()
}

#[cfg(test)]
mod tests;
