//! [`Error`]: why something cannot be tuned.

/// Why something cannot be tuned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A graph's file cannot be read.
    #[error("{network}: not an ONNX file that can be tuned: {why}")]
    Onnx {
        /// Name of the network.
        network: &'static str,
        /// Reason.
        why: String,
    },
    /// The network lacks a weight of the architecture.
    #[error("{network}: the weight \"{weight}\" is missing: this is not the architecture that can be tuned")]
    Missing {
        /// Name of the network.
        network: &'static str,
        /// The weight's name.
        weight: String,
    },
    /// The network has a weight that the architecture lacks.
    #[error("{network}: the weight \"{weight}\" has no place in the architecture that can be tuned")]
    Unknown {
        /// Name of the network.
        network: &'static str,
        /// The weight's name.
        weight: String,
    },
    /// A weight has another shape than its neighbors ask for.
    #[error("{network}: the weight \"{weight}\" has the shape {found:?} where {expected:?} is needed")]
    Shape {
        /// Name of the network.
        network: &'static str,
        /// The weight's name.
        weight: String,
        /// Shape in the file.
        found: Vec<usize>,
        /// Shape that the architecture asks for.
        expected: Vec<usize>,
    },
    /// A value that is given beside the networks does not fit them.
    #[error("{what}: {why}")]
    Start {
        /// Name of the value.
        what: &'static str,
        /// Reason.
        why: String,
    },
    /// There is nothing to learn from.
    #[error("there is nothing to tune on")]
    NoPairs,
    /// An imprint with its mask cannot be learned from.
    #[error("mask {index}: {why}")]
    Mask {
        /// Index of the mask, from 0.
        index: usize,
        /// Reason.
        why: String,
    },
    /// A pair cannot be learned from.
    #[error("pair {index}: {why}")]
    Pair {
        /// Index of the pair, from 0.
        index: usize,
        /// Reason.
        why: String,
    },
    /// The loss left the numbers; the weights are those of the step before.
    #[error("step {step}: the loss is no longer a number; lower the rates, or look for a broken pair")]
    Diverged {
        /// Counted from 1.
        step: usize,
    },
    /// All steps of the plan are done.
    #[error("all {0} steps are done")]
    Done(usize),
    /// A saved state does not fit, or is damaged.
    #[error("the saved state cannot be used: {0}")]
    State(&'static str),
}

/// Result of the crate's functions, with its error.
pub type Result<T> = std::result::Result<T, Error>;
