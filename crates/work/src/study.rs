//! Results looked into: one touch in detail, two against each other, whole data sets as tables, and figures of them.

pub mod canvas;
pub mod compare;
pub mod depict;
pub mod deviation;
pub mod doubts;
pub mod evaluate;
pub mod figure;
pub mod fonts;
pub mod layers;
pub mod space;
pub mod statistics;
pub mod still;
pub mod subject;
