//! The studio's window: panes, widgets, theme.

pub mod theme;
pub mod widget;
