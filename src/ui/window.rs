//! The window around the panes: a frame, bars, the arrangement, keys, and what covers the panes.

pub mod app;
pub(crate) mod bars;
pub(crate) mod doctor;
pub(crate) mod export;
pub(crate) mod fuzzy;
pub(crate) mod layout;
pub(crate) mod lost;
pub(crate) mod palette;
pub(crate) mod pane;
pub(crate) mod place;
pub(crate) mod screenshot;
pub(crate) mod shortcuts;
pub(crate) mod unsaved;
