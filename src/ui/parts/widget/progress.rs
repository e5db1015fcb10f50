//! Progress bar of a running task.

use eframe::egui::text::{LayoutJob, TextWrapping};
use eframe::egui::{Align2, FontId, Rect, Response, Role, Sense, Ui, WidgetInfo, vec2};

use crate::ui::parts::theme::{Palette, SMALL};

/// A bar `width` wide with a text over it. `fraction` is 0..1; `None` shows that something runs without saying how
/// far it is (without animation: an unknown duration is no reason to draw frames).
pub fn bar(ui: &mut Ui, width: f32, fraction: Option<f32>, text: &str) -> Response {
    let p = Palette::of(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(width, 16.0), Sense::hover());
    let info = fraction.map_or_else(|| text.to_owned(), |f| format!("{text} {:.0} %", f * 100.0));
    response.widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, true, &info));
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, p.control[0]);
    let filled = rect.width() * fraction.unwrap_or(1.0).clamp(0.0, 1.0);
    let fill = if fraction.is_some() { p.accent } else { p.accent.gamma_multiply(0.45) };
    let done = Rect::from_min_size(rect.min, vec2(filled, rect.height()));
    painter.rect_filled(done, 3.0, fill);
    let mut job = LayoutJob::simple_singleline(text.to_owned(), FontId::proportional(SMALL), p.strong);
    job.wrap = TextWrapping::truncate_at_width(rect.width() - 8.0);
    let galley = painter.layout_job(job);
    let at = Align2::CENTER_CENTER.anchor_size(rect.center(), galley.size()).min;
    let write = |clip, color| ui.painter_at(clip).galley_with_override_text_color(at, galley.clone(), color);
    write(rect, p.strong);
    if fraction.is_some() {
        write(done, p.on_accent);
    }
    response.on_hover_text(info)
}
