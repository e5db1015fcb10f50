//! Parts that panes are built from: the context that each is given, widgets, the look, pens and 3D views.

pub(crate) mod cx;
pub(crate) mod dialogs;
pub(crate) mod frame_cache;
pub(crate) mod letters;
pub(crate) mod made_with;
pub(crate) mod pen;
pub(crate) mod saved;
pub(crate) mod scene_view;
pub mod theme;
pub mod widget;
