//! Icons: a few lines each, drawn in the color of the text around them, so that no font has to have them.

use std::f32::consts::TAU;

use eframe::egui::{self, Align2, Color32, FontId, Pos2, Response, Role, Sense, Stroke, Ui, Vec2, WidgetInfo, vec2};

use crate::ui::parts::theme::Palette;

/// A sign on a button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Icon {
    /// A camera's cone of sight.
    Views,
    /// Two arrows apart: how far.
    Distance,
    /// Layers on each other.
    Layers,
    /// Arrows to four sides: what is held is moved.
    Hand,
    /// A brush.
    Brush,
    /// A rubber.
    Eraser,
    /// A loop.
    Lasso,
    /// Corners joined by lines.
    Polygon,
    /// A rectangle.
    Rectangle,
    /// A wand with sparks.
    Wand,
    /// A brush on a cube.
    BrushIn3d,
    /// An arrow back.
    Undo,
    /// An arrow forward.
    Redo,
}

/// Size of the sign, points.
const SIGN: f32 = 14.0;

impl Icon {
    /// Lines of the sign in a square of 14 units, each through its points.
    fn lines(self) -> Vec<Vec<[f32; 2]>> {
        let circle = |x: f32, y: f32, r: f32, from: f32, to: f32| -> Vec<[f32; 2]> {
            let at = |i: u8| (from + (to - from) * f32::from(i) / 16.0) * TAU;
            (0..=16).map(|i| [x + r * at(i).cos(), y + r * at(i).sin()]).collect()
        };
        match self {
            Self::Views => vec![
                vec![[1.0, 4.0], [9.0, 4.0], [9.0, 11.0], [1.0, 11.0], [1.0, 4.0]],
                vec![[9.0, 6.5], [13.0, 4.5], [13.0, 10.5], [9.0, 8.5]],
            ],
            Self::Distance => vec![
                vec![[1.0, 2.0], [1.0, 12.0]],
                vec![[13.0, 2.0], [13.0, 12.0]],
                vec![[2.5, 7.0], [11.5, 7.0]],
                vec![[4.5, 5.0], [2.5, 7.0], [4.5, 9.0]],
                vec![[9.5, 5.0], [11.5, 7.0], [9.5, 9.0]],
            ],
            Self::Layers => vec![
                vec![[7.0, 1.5], [13.0, 4.5], [7.0, 7.5], [1.0, 4.5], [7.0, 1.5]],
                vec![[1.0, 7.2], [7.0, 10.2], [13.0, 7.2]],
                vec![[1.0, 9.9], [7.0, 12.9], [13.0, 9.9]],
            ],
            Self::Hand => vec![
                vec![[7.0, 1.0], [7.0, 13.0]],
                vec![[1.0, 7.0], [13.0, 7.0]],
                vec![[5.2, 2.8], [7.0, 1.0], [8.8, 2.8]],
                vec![[5.2, 11.2], [7.0, 13.0], [8.8, 11.2]],
                vec![[2.8, 5.2], [1.0, 7.0], [2.8, 8.8]],
                vec![[11.2, 5.2], [13.0, 7.0], [11.2, 8.8]],
            ],
            Self::Brush => vec![
                vec![[13.0, 1.0], [6.5, 7.5]],
                vec![[6.5, 7.5], [4.0, 8.0], [2.0, 12.5], [6.0, 11.0], [6.9, 8.4], [6.5, 7.5]],
            ],
            Self::Eraser => vec![
                vec![[1.5, 8.5], [7.5, 2.5], [12.0, 7.0], [7.0, 12.0], [4.5, 12.0], [1.5, 8.5]],
                vec![[4.5, 5.5], [9.0, 10.0]],
                vec![[4.5, 12.0], [13.0, 12.0]],
            ],
            Self::Lasso => vec![circle(7.0, 5.5, 5.0, 0.0, 1.0), vec![[4.5, 10.0], [3.2, 11.5], [4.8, 13.2]]],
            Self::Polygon => vec![vec![[2.0, 5.0], [8.0, 1.5], [12.5, 6.0], [9.5, 12.5], [3.5, 11.5], [2.0, 5.0]]],
            Self::Rectangle => vec![vec![[1.5, 3.0], [12.5, 3.0], [12.5, 11.0], [1.5, 11.0], [1.5, 3.0]]],
            Self::Wand => vec![
                vec![[1.5, 12.5], [8.5, 5.5]],
                vec![[10.5, 0.8], [10.5, 3.0]],
                vec![[10.5, 4.8], [10.5, 7.0]],
                vec![[7.4, 3.9], [9.5, 3.9]],
                vec![[11.5, 3.9], [13.6, 3.9]],
            ],
            Self::Undo => vec![circle(7.0, 8.0, 4.5, 0.55, 1.2), vec![[1.0, 3.0], [2.5, 7.0], [6.5, 5.5]]],
            Self::Redo => vec![circle(7.0, 8.0, 4.5, 0.3, 0.95), vec![[13.0, 3.0], [11.5, 7.0], [7.5, 5.5]]],
            Self::BrushIn3d => vec![
                vec![[1.0, 6.0], [5.0, 4.0], [9.0, 6.0], [9.0, 11.0], [5.0, 13.0], [1.0, 11.0], [1.0, 6.0]],
                vec![[1.0, 6.0], [5.0, 8.0], [9.0, 6.0]],
                vec![[5.0, 8.0], [5.0, 13.0]],
                vec![[13.5, 0.5], [10.0, 4.0]],
            ],
        }
    }

    fn paint(self, painter: &egui::Painter, center: Pos2, color: Color32) {
        let origin = center - Vec2::splat(SIGN / 2.0);
        for line in self.lines() {
            let points: Vec<Pos2> = line.into_iter().map(|[x, y]| origin + vec2(x, y)).collect();
            painter.line(points, Stroke::new(1.3, color));
        }
    }
}

/// Size of a button with room for its key, points.
pub const SIZE: Vec2 = vec2(30.0, 28.0);

/// A button with a sign, its key below it in small letters where there is the room.
#[derive(Clone, Copy, Debug)]
pub struct Button<'a> {
    /// The sign.
    pub icon: Icon,
    /// The key; empty without one.
    pub key: &'a str,
    /// The name that a screen reader says.
    pub name: &'a str,
    /// True where it can be pressed.
    pub enabled: bool,
    /// True where it stands for what is in force.
    pub on: bool,
}

impl Button<'_> {
    /// Draws it.
    pub fn show(self, ui: &mut Ui, size: Vec2) -> Response {
        const KEY: f32 = 8.5;
        let p = Palette::of(ui);
        let sense = if self.enabled { Sense::click() } else { Sense::hover() };
        let (rect, response) = ui.allocate_exact_size(size, sense);
        response.widget_info(|| WidgetInfo::selected(Role::Button, self.enabled, self.on, self.name));
        let hovered = response.hovered() && self.enabled;
        let fill = match (self.on, hovered) {
            (true, _) => p.selected,
            (false, true) => p.control[1],
            (false, false) => Color32::TRANSPARENT,
        };
        ui.painter().rect_filled(rect, 4.0, fill);
        let color = match (self.enabled, self.on || hovered) {
            (false, _) => p.line,
            (true, true) => p.strong,
            (true, false) => p.text,
        };
        let key = if rect.height() < SIZE.y - 4.0 { "" } else { self.key };
        let up = if key.is_empty() { 0.0 } else { 4.0 };
        self.icon.paint(ui.painter(), rect.center() - vec2(0.0, up), color);
        let foot = egui::pos2(rect.center().x, rect.bottom() - 5.0);
        ui.painter().text(foot, Align2::CENTER_CENTER, key, FontId::proportional(KEY), p.weak);
        response
    }
}
