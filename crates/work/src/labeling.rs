//! Labels: what people said about pairs, and how far they are.

pub mod filter;
pub mod labels;
pub mod progress;
