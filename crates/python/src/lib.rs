//! The Python module `touch2touch._native`: the functions of the studio and its verbs with numpy's arrays.
//!
//! It computes nothing: each function takes arrays and words apart, calls the one function that the studio calls, and puts
//! the answer together again. What makes it pleasant in Python (progress bars, notebooks, PyTorch) is written in Python, in
//! `python/touch2touch`.

mod arrays;
mod data;
mod estimate;
mod masks;
mod measures;
mod picture;
mod process;
mod program;
mod recipe;
mod tables;
mod tool;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::{
        data::{Dataset, Pair, open, simulate},
        estimate::{Estimate, Pose, estimate, estimate_many, register, register_many},
        masks::{export_masks, label},
        measures::{frechet, psnr, ssim},
        picture::png,
        process::{Cancelled, Refused},
        program::main,
        recipe::Recipe,
        tables::{Scores, adapt, bundles, evaluate},
        tool::Tool,
    };

    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "the name in Python")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
