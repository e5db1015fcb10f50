//! The 3D renderer. Knows domain types, not the application state, and nothing of the window toolkit.
//!
//! One view is a [`view::Camera`], a [`target::Target`] and a [`scene::SceneRenderer`]; what it shows is a
//! [`scene::SceneData`], a list of items that carry a key and a revision. Geometry goes to the device only when a
//! revision changes, and nothing is drawn when nothing changed.
//!
//! **Architecture invariants:** positions are f64 until [`view`] turns them into f32; every failure of the device is
//! a [`GpuError`] that the view shows as text; every object on the device has a label.

pub use context::Gpu;
pub use eframe::wgpu;

pub mod context;
pub mod edges;
pub mod floor;
pub mod guides;
pub mod lines;
pub mod mesh;
pub mod pick;
pub mod pipelines;
pub mod points;
pub mod raster;
pub mod scene;
pub mod target;
pub mod view;

mod buffer;
mod shaders;
mod vertex;

/// What can go wrong between a scene and its picture.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No graphics adapter at all, not even a software one.
    #[error("no graphics adapter: {0}. Install a Vulkan driver (on Debian or Ubuntu: mesa-vulkan-drivers)")]
    NoAdapter(String),
    /// The adapter is there but gives no device.
    #[error("the graphics adapter {adapter} gives no device: {reason}")]
    NoDevice {
        /// Name of the adapter.
        adapter: String,
        /// The driver's reason.
        reason: String,
    },
    /// The adapter is there, but a driver of the kind that a browser has: flat triangles alone.
    #[error(
        "the driver of {adapter} has no storage buffers, which points and lines need. Install a Vulkan driver (on Debian or \
         Ubuntu: mesa-vulkan-drivers); all but the 3D views works without"
    )]
    NoStorage {
        /// Name of the adapter.
        adapter: String,
    },
    /// A call was refused by the driver or its validation.
    #[error("{what} failed on the graphics device: {reason}")]
    Device {
        /// What was being done.
        what: String,
        /// The first error that was reported.
        reason: String,
    },
    /// More data than one buffer of this device holds.
    #[error("{what} needs {bytes} bytes, this graphics device holds {limit} in one buffer: show fewer points")]
    TooLarge {
        /// The item.
        what: String,
        /// Bytes that it needs.
        bytes: u64,
        /// Bytes that the device allows.
        limit: u64,
    },
}
