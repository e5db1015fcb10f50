//! Grasps whose truth is known, for the benchmarks and for the tests of the studio.

pub mod known;
pub mod random_tool;
pub mod training_mix;
