//! Place of the window on the desktop, kept from one start to the next.

use eframe::egui::{Context, ViewportBuilder};

use crate::app::settings::WindowPlace;

/// The place now; `before` says where it was when it filled the screen, or where the system tells nothing.
pub(super) fn of(ctx: &Context, before: Option<WindowPlace>) -> Option<WindowPlace> {
    ctx.input(|i| {
        let viewport = i.viewport();
        let maximized = viewport.maximized == Some(true) || viewport.fullscreen == Some(true);
        match (before, viewport.outer_rect, viewport.inner_rect) {
            (Some(before), ..) if maximized => Some(WindowPlace { maximized, ..before }),
            (_, Some(outer), Some(inner)) => {
                Some(WindowPlace { position: outer.min.into(), size: inner.size().into(), maximized })
            }
            _ => before,
        }
    })
}

/// The window as it was; as `window` says where nothing is known.
pub(crate) fn restored(window: ViewportBuilder, last: Option<WindowPlace>) -> ViewportBuilder {
    match last {
        Some(last) => window.with_position(last.position).with_inner_size(last.size).with_maximized(last.maximized),
        None => window,
    }
}
