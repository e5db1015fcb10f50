//! The brush in its true size, before the first click.

use eframe::egui::{Color32, Painter, Pos2, Stroke};

/// Paints the circle that a stroke at `center` would cover, of a radius in points.
pub fn paint(painter: &Painter, center: Pos2, radius: f32, erase: bool, color: Color32) {
    // A brush smaller than a point would vanish: never draw it smaller than its own stroke.
    let radius = radius.max(2.0);
    painter.circle_stroke(center, radius, Stroke::new(3.0, Color32::from_black_alpha(140)));
    painter.circle_stroke(center, radius, Stroke::new(1.25, color));
    if erase {
        let arm = radius.clamp(3.0, 6.0) * 0.7;
        painter.hline(center.x - arm..=center.x + arm, center.y, Stroke::new(1.5, color));
    }
}
