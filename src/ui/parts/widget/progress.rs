//! Progress bar of a running task.

use eframe::egui::{self, Color32, FontId, Rect, Response, Role, Sense, Ui, WidgetInfo, vec2};

use crate::ui::parts::theme::{Palette, SMALL};

/// A bar `width` wide with a text over it. `fraction` is 0..1; `None` shows that something runs without saying how
/// far it is (without animation: an unknown duration is no reason to draw frames).
pub fn bar(ui: &mut Ui, width: f32, fraction: Option<f32>, text: &str) -> Response {
    let p = Palette::of(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(width, 16.0), Sense::hover());
    let info = match fraction {
        Some(f) => format!("{text} {:.0} %", f * 100.0),
        None => text.to_owned(),
    };
    response.widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, true, &info));
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, p.control[0]);
    let filled = rect.width() * fraction.unwrap_or(1.0).clamp(0.0, 1.0);
    let fill = if fraction.is_some() { p.accent } else { p.accent.gamma_multiply(0.45) };
    let done = Rect::from_min_size(rect.min, vec2(filled, rect.height()));
    painter.rect_filled(done, 3.0, fill);
    let write = |clip: Rect, color: Color32| {
        ui.painter_at(clip).text(rect.center(), egui::Align2::CENTER_CENTER, text, FontId::proportional(SMALL), color);
    };
    write(rect, p.strong);
    if fraction.is_some() {
        write(done, p.on_accent);
    }
    response.on_hover_text(info)
}
