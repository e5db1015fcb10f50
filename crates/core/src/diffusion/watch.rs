//! [`Watch`]: what follows a sampling run from outside, step by step ([`Progress`]).

use std::ops::ControlFlow;

use super::Tensor;

/// Progress of a generation. Sent before each step; answer `Break` to cancel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Steps done.
    pub step: u32,
    /// Steps in all.
    pub of: u32,
}

/// Follows a sampling run. Every closure from [`Progress`] to [`ControlFlow`] is one that wants no estimates.
pub trait Watch {
    /// Called before each step and once at the end; `Break` ends the run within one step.
    fn progress(&mut self, progress: Progress) -> ControlFlow<()>;

    /// Returns true where the clean latent, as the model sees it `after` these steps, is wanted. Not asked after the
    /// last step, whose estimate is the result. Nothing is computed for an answer of `false`.
    fn wants_estimate(&mut self, after: Progress) -> bool {
        let _ = after;
        false
    }

    /// The clean latent that the model sees in the noise, `[batch, …latent_shape]`: the result as it would be if the
    /// rest of the way were straight.
    fn estimate(&mut self, after: Progress, clean: &Tensor) {
        let _ = (after, clean);
    }
}

impl<F: FnMut(Progress) -> ControlFlow<()>> Watch for F {
    fn progress(&mut self, progress: Progress) -> ControlFlow<()> {
        self(progress)
    }
}
