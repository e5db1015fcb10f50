//! The job itself, once: from a touch to a prediction, its imprint in meters, the contact mask, the cloud, the pose and
//! the figures, as plain functions of values.
//!
//! A button of the studio gathers the inputs, calls one of these on a lane and wraps the answer; a verb of the command
//! line parses, loops and prints. Neither computes anything itself, so that both always give the same figure.
//!
//! The rooms, each needing only those above it; their modules are named without them.
//!
//! * [`io`]: data sets, meshes, masks and every other file. [`infer`]: model bundles and the engines that run them.
//! * [`job`], [`error`]: how work is watched, stopped, and how it fails. [`pairs`]: the choice of pairs for a pass over a data set.
//! * `labeling` ([`labels`]): what people said about pairs. [`follow`]: a folder that is still being recorded.
//! * `way` ([`recipe`], [`feel`]): the steps from a touch to its pose.
//! * `study` ([`evaluate`], [`compare`], [`figure`]): results looked into.
//! * `assist` ([`propose`], [`label_edit`], [`mod@label_pair`]): help for those who draw masks.
//! * `exchange` ([`mod@export`], [`import`]): results and labels as files.
//! * `learn` ([`adapt`], [`train`]): networks fitted to the data at hand.
//! * [`about`]: what a data set is, and what would better it.

pub mod about;
mod assist;
pub mod error;
mod exchange;
pub mod follow;
pub mod infer;
pub mod io;
pub mod job;
mod labeling;
mod learn;
pub mod pairs;
mod study;
mod way;

pub use assist::{label_edit, label_pair, propose, queue};
pub use exchange::{export, import, pair_files};
pub use labeling::{filter, labels, progress};
pub use learn::{adapt, mask_worth, new_bundle, train, training_data, tuning};
pub use study::{
    canvas, compare, depict, deviation, doubts, evaluate, figure, fonts, layers, space, statistics, still, subject,
};
pub use way::{bundles, cloud, feel, imprint, mask, models, on_pad, pose, predict, prediction, recipe, tool};
