//! [`Layers`]: the layers that networks are made of, each by the name of its weights.

use crate::ops::{self, Activation, Weights};
use crate::params::Leaves;
use crate::tape::Tensor;

/// Heads of every attention.
pub(super) const HEADS: usize = 5;

/// Layers over the weights of one network, whose names all begin with the same prefix.
#[derive(Clone, Copy, Debug)]
pub struct Layers<'a> {
    leaves: &'a Leaves<'a>,
    prefix: &'static str,
}

impl<'a> Layers<'a> {
    /// The layers under a prefix.
    pub fn new(leaves: &'a Leaves<'a>, prefix: &'static str) -> Self {
        Self { leaves, prefix }
    }

    /// A weight.
    pub fn weight(&self, name: &str) -> Tensor {
        self.leaves.get(&format!("{}{name}", self.prefix))
    }

    /// A layer's weight and bias.
    fn both(&self, name: &str) -> (Tensor, Tensor) {
        (self.weight(&format!("{name}.weight")), self.weight(&format!("{name}.bias")))
    }

    /// A convolution.
    pub(crate) fn conv(&self, x: &Tensor, name: &str, stride: usize, padding: usize) -> Tensor {
        let (weight, bias) = self.both(name);
        ops::conv2d(x, &weight, &bias, stride, padding)
    }

    /// A normalization of pictures.
    pub(crate) fn group_norm(&self, x: &Tensor, name: &str, then: Activation) -> Tensor {
        let (scale, shift) = self.both(name);
        ops::group_norm(x, &scale, &shift, then)
    }

    /// A normalization of tokens `[n, tokens, dim]`.
    pub(crate) fn layer_norm(&self, x: &Tensor, name: &str) -> Tensor {
        let (scale, shift) = self.both(name);
        ops::layer_norm(x, &scale, &shift)
    }

    /// A product with tokens; weights are `[in, out]`.
    pub fn linear(&self, x: &Tensor, name: &str) -> Tensor {
        let (weight, bias) = self.both(name);
        ops::linear(x, &weight, &bias, Weights::InOut)
    }

    /// A product with rows; weights are `[out, in]`.
    pub(crate) fn gemm(&self, x: &Tensor, name: &str) -> Tensor {
        let (weight, bias) = self.both(name);
        ops::linear(x, &weight, &bias, Weights::OutIn)
    }

    /// A residual block: norm, SiLU, convolution, twice. An embedding `[1, e]` scales and shifts the second norm.
    pub fn residual(&self, x: &Tensor, name: &str, embedding: Option<&Tensor>) -> Tensor {
        let h = self.group_norm(x, &format!("{name}.norm1"), Activation::Silu);
        let h = self.conv(&h, &format!("{name}.conv1"), 1, 1);
        let h = match embedding {
            None => self.group_norm(&h, &format!("{name}.norm2"), Activation::Silu),
            Some(embedding) => self.embedded_norm(&h, name, embedding),
        };
        let h = self.conv(&h, &format!("{name}.conv2"), 1, 1);
        let skip = format!("{name}.skip");
        if self.leaves.has(&format!("{}{skip}.weight", self.prefix)) {
            ops::add(&self.conv(x, &skip, 1, 0), &h)
        } else {
            ops::add(x, &h)
        }
    }

    /// The second norm of a block with an embedding. The embedding is the same for the whole batch, so what it scales
    /// and shifts goes into the norm's own scale and shift.
    fn embedded_norm(&self, h: &Tensor, name: &str, embedding: &Tensor) -> Tensor {
        let [_, count, ..] = h.dims::<4>();
        let both = self.gemm(embedding, &format!("{name}.embed"));
        let factor = ops::line(&ops::channels(&both, 0..count), 1.0, 1.0);
        let (scale, shift) = self.both(&format!("{name}.norm2"));
        let shift = ops::add(&ops::mul(&shift, &factor), &ops::channels(&both, count..2 * count));
        ops::group_norm(h, &ops::mul(&scale, &factor), &shift, Activation::Silu)
    }

    /// Attention of tokens on a source, or on themselves, then a perceptron of two layers.
    pub(crate) fn transformer(&self, x: &Tensor, source: Option<&Tensor>, name: &str) -> Tensor {
        let h = self.layer_norm(x, &format!("{name}.norm1"));
        let queries = self.linear(&h, &format!("{name}.attention.q"));
        let both = self.linear(source.unwrap_or(&h), &format!("{name}.attention.kv"));
        let read = ops::attention(&queries, &both, HEADS);
        let x = ops::add(x, &self.linear(&read, &format!("{name}.attention.out")));
        let h = self.layer_norm(&x, &format!("{name}.norm2"));
        let h = ops::silu(&self.linear(&h, &format!("{name}.mlp.0")));
        ops::add(&x, &self.linear(&h, &format!("{name}.mlp.2")))
    }
}
