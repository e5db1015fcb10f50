//! Model bundles and the engines that run them.
//!
//! * [`bundle`]: a folder with a manifest and ONNX graphs, checked completely when it is opened.
//! * [`engine`]: one small trait over two engines, rten (built in) and ONNX Runtime (used where its library is found).
//! * [`sandbox`]: trial of a bundle by an engine, in a process of its own, before its first use.
//! * [`runtime`]: what was found of that library.
//! * [`generator`], [`mask`], [`classifier`]: what a bundle does, from a GelSlim difference to a decoder's picture, and
//!   from a depth map to a contact mask or to the tool that made it.
//! * [`kept_key`]: everything a generated result depends on; [`store`]: results on the disk, by it.
//!
//! Without the feature `onnx` everything here compiles, bundles can be opened and checked, and running one is an
//! error that says so.

pub mod bundle;
pub mod classifier;
pub mod engine;
pub mod generator;
pub mod kept_key;
#[cfg(feature = "onnx")]
mod library;
pub mod mask;
mod onnx_header;
mod provider;
pub(crate) mod recipe_id;
pub mod runtime;
pub mod sandbox;
pub mod store;
