//! Adapters to files: data sets, meshes, arrays, masks, export.
//!
//! Every error names the file, what is wrong with it, and (`hint`) what to do about it.

pub(crate) mod archive;
pub mod atomic;
pub mod catch_panic;
pub mod dataset;
pub mod dataset_location;
pub mod digest;
pub mod doctor;
pub mod error;
pub mod exchange;
pub mod files;
pub mod folders;
pub mod fonts;
pub mod images;
pub mod masks;
pub mod memory;
pub(crate) mod model_id;
pub mod names;
pub mod npz;
pub mod ply;
pub mod predicted_id;
pub mod program;
pub mod pt;
pub mod simulated;
pub(crate) mod staging;
pub mod statistics;
pub mod stl;
pub(crate) mod tiff;
