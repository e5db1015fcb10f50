//! The bar that says which color is which value: numbers, unit, histogram, and a range that can be changed.

use eframe::egui::{
    self, Align2, Color32, FontId, Mesh, Painter, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2,
};

use crate::ui::parts::theme::{Palette, SMALL};
use crate::ui::parts::widget::texture::Histogram;
use touch2touch_core::colormap::{ColorMap, Range};

/// Height of the whole bar, points.
pub(crate) const HEIGHT: f32 = 36.0;
/// Width of the numbers at the ends, points.
const END: f32 = 38.0;
/// A bar to be shown. Values are in millimeters.
pub(crate) struct Colorbar<'a> {
    /// The name for screen readers and tests, e.g. `Depth range`.
    pub label: &'a str,
    /// The colors.
    pub map: ColorMap,
    /// The range to fall back to on a double-click.
    pub default: Range,
    /// Both ends move together around zero.
    pub symmetric: bool,
    /// Of the picture above, in meters.
    pub histogram: Option<&'a Histogram>,
    /// True where the range stays when another sample is shown; `None` shows no lock.
    pub locked: Option<bool>,
    /// Tooltips of the button that sets the range from what is shown, and of the lock.
    pub tips: [String; 2],
}

/// Change that a person asked of the bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorbarChange {
    /// This range, millimeters.
    Range(Range),
    /// The range of what is shown, once.
    Auto,
    /// The lock.
    Lock(bool),
}

impl Colorbar<'_> {
    /// Shows the bar over the width of `ui`; `range` is in millimeters.
    pub(crate) fn show(self, ui: &mut Ui, range: Range) -> Option<ColorbarChange> {
        let p = Palette::of(ui);
        let mut asked = None;
        ui.allocate_ui(vec2(ui.available_width(), HEIGHT), |ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.horizontal_centered(|ui| {
                let mut edited = range;
                let lo = end(ui, &mut edited.lo, &format!("{}, lower end", self.label));
                // In a narrow pane the colors need the room of the unit.
                let unit = if ui.available_width() > 150.0 { 26.0 } else { 0.0 };
                let width = (ui.available_width() - END - 30.0 - unit).max(24.0);
                if let Some(new) = self.gradient(ui, width, range, p) {
                    asked = Some(ColorbarChange::Range(new));
                }
                let hi = end(ui, &mut edited.hi, &format!("{}, upper end", self.label));
                if unit > 0.0 {
                    ui.label(egui::RichText::new("mm").size(SMALL).color(p.weak));
                }
                let more = egui::Button::new(egui::RichText::new("…").size(SMALL)).min_size(vec2(18.0, 18.0));
                let (more, inner) = egui::containers::menu::MenuButton::from_button(more).ui(ui, |ui| self.buttons(ui));
                let kept = if self.locked == Some(false) { ", now fitted to each pair" } else { "" };
                more.accessible_name(format!("{}: more", self.label)).on_hover_text(format!("Fit, keep{kept}"));
                asked = inner.and_then(|i| i.inner).or(asked);
                if lo || hi {
                    if self.symmetric {
                        let size = if lo { edited.lo } else { edited.hi };
                        edited = Range::symmetric(size);
                    }
                    if edited.hi - edited.lo >= 0.01 {
                        asked = Some(ColorbarChange::Range(edited));
                    }
                }
            });
        });
        asked
    }

    fn buttons(&self, ui: &mut Ui) -> Option<ColorbarChange> {
        let mut asked = None;
        let auto = ui.add(egui::Button::new(egui::RichText::new("Fit").size(SMALL)).min_size(vec2(32.0, 18.0)));
        let auto = auto.accessible_name(format!("{}: set from what is shown", self.label));
        if auto.on_hover_text(&self.tips[0]).clicked() {
            asked = Some(ColorbarChange::Auto);
        }
        if let Some(locked) = self.locked {
            let text = egui::RichText::new("Keep").size(SMALL);
            let lock = ui.add(egui::Button::selectable(locked, text).min_size(vec2(32.0, 18.0)));
            let lock = lock.accessible_name(format!("{}: lock", self.label));
            if lock.on_hover_text(&self.tips[1]).clicked() {
                asked = Some(ColorbarChange::Lock(!locked));
            }
        }
        asked
    }

    /// The colors with histogram and ticks; a double-click resets.
    fn gradient(&self, ui: &mut Ui, width: f32, range: Range, p: &Palette) -> Option<Range> {
        let (rect, response) = ui.allocate_exact_size(vec2(width, HEIGHT - 4.0), Sense::click());
        let info = format!("{} {:.2} to {:.2} mm", self.label, range.lo, range.hi);
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &info));
        let bar = Rect::from_min_max(pos2(rect.left(), rect.top() + 10.0), pos2(rect.right(), rect.top() + 19.0));
        let painter = ui.painter_at(rect.expand2(vec2(12.0, 0.0)));
        gradient(&painter, bar, 48, |t| {
            let [r, g, b] = self.map.rgb8(t);
            Color32::from_rgb(r, g, b)
        });
        if let Some(histogram) = self.histogram {
            let above = Rect::from_min_max(rect.min, pos2(bar.right(), bar.top() - 1.0));
            paint_histogram(&painter, histogram, range, above, p);
        }
        for v in range.ticks((width / 44.0) as usize) {
            let x = bar.left() + range.unit(v) * bar.width();
            painter.vline(x, bar.bottom()..=bar.bottom() + 2.0, Stroke::new(1.0, p.weak));
            let text = if v.fract().abs() < 1e-3 { format!("{v:.0}") } else { format!("{v:.1}") };
            painter.text(pos2(x, bar.bottom() + 2.0), Align2::CENTER_TOP, text, FontId::proportional(10.0), p.weak);
        }
        let tip = format!("{info}; double-click resets to {:.2} to {:.2} mm", self.default.lo, self.default.hi);
        response.on_hover_text(tip).double_clicked().then_some(self.default)
    }
}

fn paint_histogram(painter: &egui::Painter, histogram: &Histogram, range: Range, rect: Rect, p: &Palette) {
    // Most of an imprint is untouched membrane: a logarithm keeps the touch visible beside it.
    let height = |n: u32| f64::from(n + 1).ln() as f32;
    let most = histogram.counts.iter().copied().map(height).fold(0.0, f32::max);
    if most <= 0.0 {
        return;
    }
    let bins = histogram.counts.len() as f32;
    let span = histogram.span.hi - histogram.span.lo;
    for (i, n) in histogram.counts.iter().enumerate() {
        // Histograms are of meters, the bar is in millimeters.
        let value_mm = |k: f32| (histogram.span.lo + span * k / bins) * 1e3;
        let (a, b) = (value_mm(i as f32), value_mm(i as f32 + 1.0));
        if *n == 0 || b < range.lo || a > range.hi {
            continue;
        }
        let x = |v: f32| rect.left() + range.unit(v) * rect.width();
        let top = rect.bottom() - rect.height() * height(*n) / most;
        let right = x(b).max(x(a) + 1.0);
        let bar = Rect::from_min_max(pos2(x(a), top), pos2(right, rect.bottom()));
        painter.rect_filled(bar, 0.0, p.weak.gamma_multiply(0.6));
    }
}

/// A number that can be typed or dragged. Returns whether it changed.
fn end(ui: &mut Ui, value: &mut f32, label: &str) -> bool {
    let drag = egui::DragValue::new(value).speed(0.05).fixed_decimals(2).range(-100.0..=100.0);
    let response = ui.scope(|ui| {
        ui.style_mut().override_font_id = Some(FontId::proportional(12.0));
        ui.spacing_mut().button_padding.x = 2.0;
        ui.add_sized([END, 18.0], drag).accessible_name(label)
    });
    response.inner.on_hover_text(format!("{label}, mm: drag, or click and type")).changed()
}

/// Fills `bar` from left to right with the colors of 0 to 1, exact at `steps` + 1 places.
pub(crate) fn gradient(painter: &Painter, bar: Rect, steps: u32, color: impl Fn(f32) -> Color32) {
    let mut mesh = Mesh::default();
    for i in 0..=steps {
        let t = i as f32 / steps as f32;
        let (x, color) = (bar.left() + t * bar.width(), color(t));
        mesh.colored_vertex(pos2(x, bar.top()), color);
        mesh.colored_vertex(pos2(x, bar.bottom()), color);
        if i > 0 {
            let k = 2 * i;
            mesh.add_triangle(k - 2, k - 1, k);
            mesh.add_triangle(k - 1, k, k + 1);
        }
    }
    painter.add(Shape::mesh(mesh));
}
