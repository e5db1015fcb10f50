//! The panes, a file for each kind of them, as the table in `app/pane.rs` lists them.

pub(crate) mod adapt;
pub(crate) mod browser;
pub(crate) mod compare;
pub(crate) mod generate;
pub(crate) mod images;
pub(crate) mod log;
pub(crate) mod masks;
pub(crate) mod metrics;
pub(crate) mod results;
pub(crate) mod scene;
pub(crate) mod settings_pane;
pub(crate) mod steps;
