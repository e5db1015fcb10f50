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

pub use arithmetic::{add, add_each, blend, line, mul, rescaled, silu};
pub use arrange::{beside, channels, doubled, repeated, swapped};
pub use attention::attention;
pub use contact::contact_loss;
pub use conv::conv2d;
pub use distance::distance;
pub use linear::{Weights, linear};
pub use norm::{Activation, GROUPS, group_norm, layer_norm};
pub use place::placed;
pub use unet::{Margins, cropped, halved, padded, relu};

#[cfg(test)]
mod tests;
