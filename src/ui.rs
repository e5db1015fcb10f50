//! The studio's window: panes, widgets, theme.
//!
//! Panes read the state and put commands on a list; they compute nothing and change nothing. What is derived for the
//! screen (textures, outlines) is made again only when the recipe of what is shown changes.

pub mod app;
pub mod theme;
pub mod widget;

mod bars;
mod browser;
mod cx;
mod dialogs;
mod fuzzy;
mod generate;
mod images;
mod layout;
mod log;
mod masks;
mod metrics;
mod palette;
mod pane;
mod saved;
mod scene;
mod scene_view;
mod screenshot;
mod settings_pane;
mod shortcuts;
mod table;

pub use app::{Options, StudioApp};
