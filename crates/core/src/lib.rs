//! Pure science: images, sensors, frames, simulation, registration, diffusion, metrics.
//!
//! **Architecture invariant:** nothing here names a window, a GPU, a model runtime, a file,
//! a thread or a clock. Values come in as arguments and go out as results, in meters and radians.

pub mod align;
pub mod bits;
pub mod blur;
pub mod catalog;
pub mod cloud;
pub mod colormap;
pub mod contact;
pub mod dataset;
pub mod deviation;
pub mod diffusion;
pub mod doubt;
pub mod ensemble;
pub mod evaluation;
pub mod field;
pub mod findings;
pub mod fit;
#[cfg(test)]
mod fixture;
pub mod frames;
pub mod grid;
pub mod inspect;
pub mod label;
mod linear;
pub mod manual;
pub mod markers;
pub mod mesh;
pub mod metrics;
pub mod moments;
pub mod noise;
pub mod picture;
pub mod pose;
pub mod postprocess;
pub mod read_as;
mod relax;
pub mod resample;
pub mod rig;
pub mod sample;
pub mod sensor;
pub mod sim;
pub mod symmetry;
mod tent;
pub mod text;
pub mod tool;
pub mod turn;
pub mod units;
pub mod upright;
pub mod verdict;
pub mod which_tool;
