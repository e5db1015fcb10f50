//! Scores of whole data sets as tables.

pub mod evaluate;
pub mod statistics;
