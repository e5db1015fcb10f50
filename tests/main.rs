//! The one integration binary (see ARCHITECTURE.md): each level of test is a module.

#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may stop anywhere, and says what it left out")]

#[allow(dead_code, reason = "not every feature set uses every helper")]
mod support;

#[cfg(all(feature = "onnx", feature = "tune"))]
mod adapt;
#[cfg(feature = "onnx")]
mod agreement;
mod apply;
#[cfg(feature = "onnx")]
#[cfg(feature = "onnx")]
mod cli;
#[cfg(feature = "onnx")]
mod cli_generate;
mod exchange;
mod fuzz;
mod io;
mod kill;
mod layers;
mod models;
mod pose;
mod predictions_labeled;
mod recovery;
mod rigs;
mod rules;
mod sim;
mod stability;

#[cfg(feature = "onnx")]
mod generating;
#[cfg(feature = "gui")]
mod gpu;
#[cfg(feature = "onnx")]
mod handed_on;
#[cfg(feature = "onnx")]
#[cfg(feature = "onnx")]
mod providers;
#[cfg(feature = "onnx")]
mod sensors;
#[cfg(feature = "onnx")]
#[cfg(all(feature = "onnx", feature = "tune"))]
mod training;
#[cfg(feature = "ui-test")]
mod ui;
#[cfg(feature = "onnx")]
mod unsound;
