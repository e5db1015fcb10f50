//! The one integration binary (see ARCHITECTURE.md): each level of test is a module.

#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may stop anywhere, and says what it left out")]

mod adapt;
mod agreement;
mod apply;
mod cli;
mod cli_generate;
mod exchange;
mod fuzz;
mod generating;
mod gpu;
mod handed_on;
mod io;
mod kill;
mod layers;
mod models;
mod pose;
mod predictions_labeled;
mod providers;
mod recovery;
mod rigs;
mod rules;
mod sensors;
mod sim;
mod stability;
mod support;
mod training;
mod ui;
mod unsound;
