//! The brush in its true size, before the first click.

use eframe::egui::{Color32, Stroke};

use super::image_canvas::CanvasOutput;

/// Paints the circle that a stroke at `px` (image pixels) would cover.
pub fn paint(canvas: &CanvasOutput, px: [f32; 2], radius_px: f32, erase: bool, color: Color32) {
    let center = canvas.map.to_screen(px);
    // A brush smaller than a point would vanish: never draw it smaller than its own stroke.
    let radius = (radius_px * canvas.map.scale).max(2.0);
    canvas.painter.circle_stroke(center, radius, Stroke::new(3.0, Color32::from_black_alpha(140)));
    canvas.painter.circle_stroke(center, radius, Stroke::new(1.25, color));
    if erase {
        let arm = radius.clamp(3.0, 6.0) * 0.7;
        canvas.painter.hline(center.x - arm..=center.x + arm, center.y, Stroke::new(1.5, color));
    }
}
