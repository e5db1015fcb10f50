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

use eframe::egui;

/// The widget that has the keyboard focus.
pub(crate) fn focused(ctx: &egui::Context) -> Option<egui::Response> {
    ctx.memory(egui::Memory::focused).and_then(|id| ctx.read_response(id))
}

/// Scrolls to the widget that the keyboard has just reached, at the end of what scrolls.
pub(crate) fn scroll_to_focus(ui: &egui::Ui) {
    let reached = focused(ui.ctx()).filter(egui::Response::gained_focus);
    if let Some(widget) = reached.filter(|widget| ui.min_rect().contains(widget.rect.center())) {
        widget.scroll_to_me(None);
    }
}
