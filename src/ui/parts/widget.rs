//! Widgets that know nothing of the application's state.

pub mod choice;
pub mod colorbar;
pub mod curves;
pub mod cut;
pub mod empty;
pub mod help;
pub mod icon;
pub mod image_canvas;
pub mod line;
pub mod progress;
pub mod texture;
