//! Operators on [`crate::tape::Tensor`]s, each with its own backward pass.
//!
//! Each runs on the thread that calls it; a batch is cut into parts which run side by side.

mod arithmetic;
mod arrange;
mod attention;
mod contact;
mod conv;
mod distance;
mod linear;
mod math;
mod norm;
mod place;
mod product;
mod unet;

pub use arithmetic::{add, blend, line};
pub(crate) use arithmetic::{add_each, mul, rescaled, silu};
pub use arrange::{beside, channels, doubled, repeated, swapped};
pub(crate) use attention::attention;
pub(crate) use contact::contact_loss;
pub(crate) use conv::conv2d;
pub use distance::distance;
pub(crate) use linear::Weights;
pub use linear::linear;
pub(crate) use norm::Activation;
pub(crate) use norm::{GROUPS, group_norm, layer_norm};
pub use place::placed;
pub(crate) use unet::Margins;
pub(crate) use unet::{cropped, relu};
pub use unet::{halved, padded};

#[cfg(test)]
mod tests;
