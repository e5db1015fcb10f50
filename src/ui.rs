//! The studio's window: panes, widgets, theme.
