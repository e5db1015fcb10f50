//! Labels: what people said about pairs, how far they agree, and what it cost them.

pub mod agreement;
pub mod filter;
pub mod label_stats;
pub mod labels;
pub mod repeats;
