//! [`Layout`]: the names and shapes that a network asks of a file.

use std::collections::BTreeSet;

use crate::error::{Error, Result};
use crate::onnx::Onnx;
use crate::params::Params;

/// The weights that a network needs, in the order in which they were asked for.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    weights: Vec<(String, Vec<usize>)>,
}

impl Layout {
    /// A weight of its own.
    pub fn weight(&mut self, name: impl Into<String>, shape: &[usize]) {
        self.weights.push((name.into(), shape.to_vec()));
    }

    /// A weight and a bias per output.
    fn layer(&mut self, name: &str, weight: &[usize], outputs: usize) {
        self.weight(format!("{name}.weight"), weight);
        self.weight(format!("{name}.bias"), &[outputs]);
    }

    /// A convolution with square kernels.
    pub(crate) fn conv(&mut self, name: &str, inputs: usize, outputs: usize, kernel: usize) {
        self.layer(name, &[outputs, inputs, kernel, kernel], outputs);
    }

    /// A normalization of pictures.
    pub(crate) fn group_norm(&mut self, name: &str, channels: usize) {
        self.weight(format!("{name}.weight"), &[channels, 1, 1]);
        self.weight(format!("{name}.bias"), &[channels, 1, 1]);
    }

    /// A normalization of tokens.
    pub(crate) fn layer_norm(&mut self, name: &str, dim: usize) {
        self.layer(name, &[dim], dim);
    }

    /// A product with tokens, `[in, out]`.
    pub fn linear(&mut self, name: &str, inputs: usize, outputs: usize) {
        self.layer(name, &[inputs, outputs], outputs);
    }

    /// A `Gemm` node, `[out, in]`.
    pub(crate) fn gemm(&mut self, name: &str, inputs: usize, outputs: usize) {
        self.layer(name, &[outputs, inputs], outputs);
    }

    /// A residual block, with a skip convolution where the width changes.
    pub fn residual(&mut self, name: &str, inputs: usize, outputs: usize, embedding: Option<usize>) {
        self.group_norm(&format!("{name}.norm1"), inputs);
        self.conv(&format!("{name}.conv1"), inputs, outputs, 3);
        self.group_norm(&format!("{name}.norm2"), outputs);
        self.conv(&format!("{name}.conv2"), outputs, outputs, 3);
        if inputs != outputs {
            self.conv(&format!("{name}.skip"), inputs, outputs, 1);
        }
        if let Some(embedding) = embedding {
            self.gemm(&format!("{name}.embed"), embedding, 2 * outputs);
        }
    }

    /// Attention and a perceptron, each behind a normalization.
    pub(crate) fn transformer(&mut self, name: &str, dim: usize) {
        for norm in ["norm1", "norm2"] {
            self.layer_norm(&format!("{name}.{norm}"), dim);
        }
        self.linear(&format!("{name}.attention.q"), dim, dim);
        self.linear(&format!("{name}.attention.kv"), dim, 2 * dim);
        self.linear(&format!("{name}.attention.out"), dim, dim);
        self.linear(&format!("{name}.mlp.0"), dim, 2 * dim);
        self.linear(&format!("{name}.mlp.2"), 2 * dim, dim);
    }

    /// Names and shapes.
    pub fn weights(&self) -> &[(String, Vec<usize>)] {
        &self.weights
    }

    /// Reads the weights of `network` out of its file into `params`, under names with `prefix` in front.
    ///
    /// # Errors
    /// If the file lacks one, has one in another shape, or has one too many, or values that are not numbers.
    pub fn read(&self, network: &'static str, prefix: &str, file: &Onnx, params: &mut Params) -> Result<()> {
        for (name, expected) in &self.weights {
            let missing = || Error::Missing { network, weight: name.clone() };
            let weight = file.weights().iter().find(|weight| weight.name() == name).ok_or_else(missing)?;
            if weight.shape() != expected {
                let (found, expected) = (weight.shape().to_vec(), expected.clone());
                return Err(Error::Shape { network, weight: name.clone(), found, expected });
            }
            let values = file.values(weight);
            if values.iter().any(|value| !value.is_finite()) {
                let why = format!("the weight \"{name}\" has values that are not numbers");
                return Err(Error::Onnx { network, why });
            }
            params.push(format!("{prefix}{name}"), expected.clone(), values);
        }
        let known: BTreeSet<&str> = self.weights.iter().map(|(name, _)| name.as_str()).collect();
        match file.weights().iter().find(|weight| !known.contains(weight.name())) {
            Some(extra) => Err(Error::Unknown { network, weight: extra.name().to_owned() }),
            None => Ok(()),
        }
    }
}
