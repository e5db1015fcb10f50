//! Touch2Touch Studio: from a GelSlim image to the Soft Bubble imprint of the same grasp,
//! and from the imprint to the in-hand pose.
//!
//! The application: everything that a result depends on lies in `touch2touch_core` (the science) and `touch2touch_pipeline`
//! (the job, from a touch to a pose); see `ARCHITECTURE.md`.
//!
//! * [`app`]: the application model (state, commands, jobs), without a window.
//! * `gpu`, `ui` (feature `gui`): the renderer and the studio.
//! * [`headless`]: the command line, from the same code as the studio.

#[macro_use]
mod tables;

#[cfg_attr(
    not(feature = "gui"),
    allow(dead_code, unused_imports, reason = "without the window nobody asks for what only views show")
)]
pub mod app;
#[cfg(feature = "gui")]
pub mod gpu;
pub mod headless;
pub mod spatial;
#[cfg(feature = "gui")]
pub mod ui;
