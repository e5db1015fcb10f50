//! Touch2Touch Studio: from a GelSlim image to the Soft Bubble imprint of the same grasp,
//! and from the imprint to the in-hand pose.
//!
//! Layers only point downwards (see `ARCHITECTURE.md`):
//!
//! ```text
//! main ─┬─> ui ──┬─> gpu ─────────────────┐
//!       │        └─> app ─┐               │
//!       │                 ├─> work ─> infer ─> io ─> domain
//!       └─> headless ─────┘
//! ```
//!
//! * [`domain`]: pure science, no files, threads, clocks or windows.
//! * [`io`]: data sets, meshes, masks and every other file.
//! * [`infer`]: model bundles and the engines that run them.
//! * [`work`]: the job itself, from a touch to a pose and its figures, once for the studio and the command line.
//! * [`app`]: the application model (state, commands, jobs), without a window.
//! * `gpu`, `ui` (feature `gui`): the renderer and the studio.
//! * [`headless`]: the command line, from the same code as the studio.

pub mod app;
pub mod domain;
mod fonts;
#[cfg(feature = "gui")]
pub mod gpu;
pub mod headless;
pub mod infer;
pub mod io;
#[cfg(feature = "gui")]
pub mod ui;
pub mod work;
