//! Curves over steps: a plot as small as a caption.

use eframe::egui::{Align2, FontId, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2};

use crate::ui::parts::theme::Palette;
use touch2touch_pipeline::job::Curve;

/// Room for the numbers at the left, points.
const LEFT: f32 = 40.0;
/// Room for the heading above and the steps below, points.
const MARGIN: f32 = 15.0;

/// Draws the curves of one unit under a heading: the last one strong, those before it faint. A curve is named where the pointer is
/// near one.
pub fn show(ui: &mut Ui, size: Vec2, heading: &str, curves: &[&Curve]) {
    let p = Palette::of(ui);
    let (area, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, heading));
    let painter = ui.painter_at(area);
    let small = FontId::proportional(10.0);
    painter.text(area.left_top(), Align2::LEFT_TOP, heading, small.clone(), p.weak);
    let plot = Rect::from_min_max(area.min + vec2(LEFT, MARGIN), area.max - vec2(4.0, MARGIN));
    painter.rect_filled(plot, 2.0, p.canvas);
    let points = || curves.iter().flat_map(|curve| &curve.points).filter(|point| point[1].is_finite());
    let most = |axis: usize| points().map(|point| point[axis]).fold(f64::NEG_INFINITY, f64::max);
    let least = points().map(|point| point[1]).fold(f64::INFINITY, f64::min);
    let (steps, top) = (most(0).max(1.0), most(1));
    if !(least.is_finite() && top.is_finite()) {
        return;
    }
    let span = (top - least).max(1e-9);
    let place = |point: &[f64; 2]| {
        let right = point[0] / steps;
        let up = (point[1] - least) / span;
        pos2(plot.left() + plot.width() * right as f32, plot.bottom() - 2.0 - (plot.height() - 4.0) * up as f32)
    };
    for (value, y, corner) in [(top, plot.top(), Align2::RIGHT_TOP), (least, plot.bottom(), Align2::RIGHT_BOTTOM)] {
        painter.text(pos2(plot.left() - 4.0, y), corner, number(value, span), small.clone(), p.weak);
    }
    let last = format!("step {steps:.0}");
    painter.text(area.right_bottom() - vec2(4.0, 0.0), Align2::RIGHT_BOTTOM, last, small, p.weak);
    let mut near: Option<(f32, &Curve, &[f64; 2])> = None;
    for (i, curve) in curves.iter().enumerate() {
        let line: Vec<Pos2> = curve.points.iter().filter(|point| point[1].is_finite()).map(place).collect();
        let stroke = if i + 1 == curves.len() { Stroke::new(1.5, p.accent) } else { Stroke::new(1.0, p.weak) };
        if let [only] = line.as_slice() {
            painter.circle_filled(*only, 2.0, stroke.color);
        }
        painter.add(Shape::line(line, stroke));
        if let Some(pointer) = response.hover_pos() {
            for point in &curve.points {
                let distance = place(point).distance(pointer);
                if near.is_none_or(|(least, ..)| distance < least) {
                    near = Some((distance, curve, point));
                }
            }
        }
    }
    if let Some((_, curve, point)) = near {
        painter.circle_filled(place(point), 3.0, p.accent);
        let value = number(point[1], span);
        response.on_hover_text(format!("{}, step {:.0}: {value} {}", curve.name, point[0], curve.unit));
    }
}

fn number(value: f64, span: f64) -> String {
    if span < 1.0 { format!("{value:.3}") } else { format!("{value:.1}") }
}
