//! The program `touch2touch` in Python's process.

use std::ffi::OsString;

use pyo3::prelude::*;
use touch2touch_pipeline::io::program::Program;

/// Runs a command line, the program's name first, and gives its exit code. `again` are the words that start the program
/// once more.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, arguments: Vec<OsString>, again: Vec<OsString>) -> u8 {
    py.detach(|| touch2touch::headless::main_with(arguments, Some(Program(again))))
}
