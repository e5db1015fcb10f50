//! The job itself, once: from a touch to a prediction, its imprint in meters, the contact mask, the cloud, the pose and
//! the figures, as plain functions of values.
//!
//! A button of the studio gathers the inputs, calls one of these on a lane and wraps the answer; a verb of the command
//! line parses, loops and prints. Neither computes anything itself, so that both always give the same figure.
//!
//! * [`io`]: data sets, meshes, masks and every other file. [`infer`]: model bundles and the engines that run them.
//! * [`models`]: bundles found and loaded once; predictions, from the disk where they were made before.
//! * [`imprint`], [`mask`], [`cloud`], [`pose`]: one step each. [`compare`], [`ledger`], [`layers`], [`influence`], [`ensemble`]: what
//!   there is to know about their results.
//! * [`figure`], [`pair_files`]: results as pictures for papers and as files for other programs.
//! * [`evaluate`], [`sweep`], [`statistics`], [`adapt`], [`train`], [`export`], [`import`],
//!   [`training_data`]: passes over a whole data set.
//! * [`job`], [`error`]: how work is watched, stopped, and how it fails.

pub mod adapt;
pub mod agreement;
pub mod bundles;
pub mod canvas;
pub mod case;
pub mod cloud;
pub mod compare;
pub mod deviation;
pub mod doubts;
pub mod ensemble;
pub mod error;
pub mod evaluate;
pub mod export;
pub mod fan;
pub mod feel;
pub mod figure;
pub mod filter;
pub mod follow;
pub mod fonts;
pub mod import;
pub mod imprint;
pub mod infer;
pub mod influence;
pub mod io;
pub mod job;
pub mod label_edit;
pub mod label_stats;
pub mod labels;
pub mod layers;
pub mod ledger;
pub mod mask;
pub mod models;
pub mod new_bundle;
pub mod on_pad;
pub mod pair_files;
pub mod pairs;
pub mod pose;
pub mod predict;
pub mod prediction;
pub mod propose;
pub mod queue;
pub mod recipe;
pub mod repeats;
pub mod statistics;
pub mod subject;
pub mod sweep;
pub mod tool;
pub mod train;
pub mod training_data;
pub mod tuning;
mod usable;
pub mod verdict;
