//! The job itself, once: from a pair to a prediction, its imprint in meters, the contact mask, the cloud, the pose and
//! the scores, as plain functions of values.
//!
//! A button of the studio gathers the inputs, calls one of these on a worker thread and wraps the answer; a verb of the
//! command line parses, loops and prints. Neither computes anything itself, so that both always give the same figures.
//!
//! Each module needs only those above it:
//!
//! * [`io`]: data sets, meshes, masks and every other file. [`infer`]: model bundles and the engines that run them.
//! * [`job`], [`error`]: how work is watched, stopped, and how it fails. [`pairs`]: the choice of pairs for a pass over a data set.
//! * [`labels`]: what people said about pairs. [`follow`]: a folder that is still being recorded.
//! * [`steps`]: from a pair to its pose ([`steps::recipe`], [`steps::estimate`]).
//! * [`scores`], [`compare`], [`still`]: results as tables, beside each other, in 3D.
//! * [`masks`]: proposals and edits of contact masks. [`mod@export`]: results and labels as files.
//! * [`doubts`]: what of a data set contradicts itself.
//! * [`learn`]: networks fitted to the data at hand.
//! * [`doctor`]: what a data set is, and what would better it.

pub mod compare;
pub mod doctor;
pub mod doubts;
pub mod error;
pub mod export;
pub mod follow;
pub mod infer;
pub mod io;
pub mod job;
pub mod labels;
pub mod learn;
pub mod masks;
pub mod pairs;
pub mod scores;
pub mod steps;
pub mod still;
