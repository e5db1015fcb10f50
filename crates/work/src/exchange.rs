//! Results and labels as files: cases that give the same results elsewhere, and what other programs read and write.

pub mod case;
pub mod export;
pub mod import;
pub mod pair_files;
