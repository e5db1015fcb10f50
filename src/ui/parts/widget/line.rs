//! A line of figures: a name at the left, numbers in columns that never move.

use eframe::egui::{Align2, Color32, FontId, Rect, Response, Role, Sense, Ui, WidgetInfo, pos2, vec2};

/// Look of the lines of a list.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Height of a line, points.
    pub height: f32,
    /// Size of the letters, points.
    pub size: f32,
    /// From one column to the next, points; the last one ends at the right edge.
    pub column: f32,
    /// The color of a small square before the name.
    pub swatch: Option<Color32>,
}

impl Line {
    /// Shows a line: its name and its numbers, each with its color.
    pub fn show(self, ui: &mut Ui, name: (&str, Color32), numbers: &[(String, Color32)]) -> Response {
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), self.height), Sense::hover());
        let all: Vec<&str> = numbers.iter().map(|n| n.0.as_str()).collect();
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{} {}", name.0, all.join(" "))));
        let painter = ui.painter_at(rect);
        let font = FontId::proportional(self.size);
        let (mut left, y) = (rect.left(), rect.center().y);
        if let Some(color) = self.swatch {
            painter.rect_filled(Rect::from_center_size(pos2(left + 5.0, y), vec2(9.0, 9.0)), 2.0, color);
            left += 15.0;
        }
        painter.text(pos2(left, y), Align2::LEFT_CENTER, name.0, font.clone(), name.1);
        for (i, (number, color)) in numbers.iter().rev().enumerate() {
            let right = pos2(rect.right() - 2.0 - self.column * i as f32, y);
            painter.text(right, Align2::RIGHT_CENTER, number, font.clone(), *color);
        }
        response
    }
}
