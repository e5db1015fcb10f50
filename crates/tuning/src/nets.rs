//! Networks as functions of named weights.

pub mod generator;
mod layers;
mod layout;
pub mod mask;

pub use layers::Layers;
pub use layout::Layout;
