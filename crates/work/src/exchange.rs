//! Results and labels as files that other programs read and write.

pub mod export;
pub mod import;
pub mod pair_files;
