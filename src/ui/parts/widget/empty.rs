//! Sentence of a pane that has nothing to show, with the action that brings it.

use eframe::egui::{self, Align, Layout, RichText, Ui, UiBuilder, vec2};

use crate::ui::parts::theme::Palette;

/// Fills the space with a sentence, a second quieter one, and a button. Returns whether the button was clicked.
pub fn show(ui: &mut Ui, what: &str, why: &str, action: Option<(&str, &str)>) -> bool {
    let p = Palette::of(ui);
    let rect = ui.available_rect_before_wrap();
    ui.painter().rect_filled(rect, 0.0, p.canvas);
    let mut clicked = false;
    let height: f32 = 24.0 + if why.is_empty() { 0.0 } else { 36.0 } + if action.is_some() { 36.0 } else { 0.0 };
    let inner = egui::Rect::from_center_size(rect.center(), vec2(rect.width() - 24.0, height.min(rect.height())));
    ui.scope_builder(UiBuilder::new().max_rect(inner).layout(Layout::top_down(Align::Center)), |ui| {
        ui.add(egui::Label::new(RichText::new(what).color(p.text)).wrap());
        if !why.is_empty() {
            ui.add(egui::Label::new(RichText::new(why).small().color(p.weak)).wrap());
        }
        if let Some((name, tooltip)) = action {
            ui.add_space(4.0);
            clicked = ui.button(name).on_hover_text(tooltip).clicked();
        }
    });
    ui.advance_cursor_after_rect(rect);
    clicked
}
