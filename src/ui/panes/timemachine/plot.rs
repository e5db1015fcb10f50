//! Cost and inlier share over the steps: one curve per start.

use eframe::egui::{
    self, Align2, Color32, FontId, Painter, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2,
};

use super::table::root_mm;
use crate::app::inspect::InspectCommand;
use crate::app::inspect::Inspected;
use crate::app::keys::Inspection;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{Palette, mix};
use touch2touch_core::align::TraceStep;
use touch2touch_core::units;

/// Room for the numbers at the left, points.
const LEFT: f32 = 34.0;
/// Distance of the pointer from a step at which it means it, points.
const NEAR: f32 = 14.0;

/// Both plots over the same steps.
struct Plot<'a> {
    inspection: &'a Inspection,
    cost: Rect,
    share: Rect,
    /// Steps of the longest run, at least 2.
    steps: usize,
    /// The top of the cost's axis, millimeters.
    top_mm: f64,
}

impl Plot<'_> {
    fn x(&self, at: usize) -> f32 {
        self.cost.left() + self.cost.width() * at as f32 / (self.steps - 1) as f32
    }

    fn cost_at(&self, at: usize, step: &TraceStep) -> Pos2 {
        let share = (root_mm(step.cost_m2) / self.top_mm).clamp(0.0, 1.0) as f32;
        pos2(self.x(at), self.cost.bottom() - share * self.cost.height())
    }

    fn share_at(&self, at: usize, step: &TraceStep) -> Pos2 {
        pos2(self.x(at), self.share.bottom() - step.inlier_share.clamp(0.0, 1.0) as f32 * self.share.height())
    }

    /// The step nearest to a place, in either plot.
    fn nearest(&self, to: Pos2) -> Option<(usize, usize, f32)> {
        let mut best: Option<(usize, usize, f32)> = None;
        for run in 0..self.inspection.num_runs() {
            for (at, step) in self.inspection.steps(run).enumerate() {
                for place in [self.cost_at(at, step), self.share_at(at, step)] {
                    let distance = place.distance(to);
                    if best.is_none_or(|(_, _, least)| distance < least) {
                        best = Some((run, at, distance));
                    }
                }
            }
        }
        best
    }
}

/// A round number at or above a positive one.
fn round_up(value: f64) -> f64 {
    if !(value > 0.0 && value.is_finite()) {
        return 1.0;
    }
    let base = 10f64.powf(value.log10().floor());
    [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 8.0, 10.0].into_iter().map(|m| m * base).find(|v| *v >= value).unwrap_or(value)
}

/// Draws the curves into `rect`; a click or a drag asks for a step.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, rect: Rect, shown: Inspected<'_>) -> Option<InspectCommand> {
    let response = ui.interact(rect, ui.scope_id().with("curves"), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Cost and inliers over the steps"));
    let p = cx.p;
    let inspection = &**shown.inspection;
    let split = rect.top() + (rect.height() * 0.62).round();
    let steps = (0..inspection.num_runs()).map(|r| inspection.num_steps(r)).max().unwrap_or(0).max(2);
    let highest = (0..inspection.num_runs())
        .flat_map(|run| inspection.steps(run))
        .map(|s| root_mm(s.cost_m2))
        .filter(|v| v.is_finite())
        .fold(0.0, f64::max);
    let plot = Plot {
        inspection,
        cost: Rect::from_min_max(pos2(rect.left() + LEFT, rect.top() + 14.0), pos2(rect.right() - 6.0, split - 6.0)),
        share: Rect::from_min_max(
            pos2(rect.left() + LEFT, split + 10.0),
            pos2(rect.right() - 6.0, rect.bottom() - 14.0),
        ),
        steps,
        top_mm: round_up(highest),
    };
    let painter = ui.painter_at(rect);
    axes(p, &painter, &plot);
    kernels(p, &painter, &plot, shown.run);
    for run in (0..inspection.num_runs()).filter(|r| *r != shown.run).chain([shown.run]) {
        curve(p, &painter, &plot, run, run == shown.run);
    }
    pins(cx, &painter, &plot);
    // The step shown.
    let x = plot.x(shown.at);
    painter.vline(x, plot.cost.top()..=plot.share.bottom(), Stroke::new(1.0, p.strong));
    for at in [plot.cost_at(shown.at, shown.step), plot.share_at(shown.at, shown.step)] {
        painter.circle(at, 4.0, p.accent, Stroke::new(1.5, p.strong));
    }
    let hovered = response.hover_pos().and_then(|pos| plot.nearest(pos)).filter(|(_, _, distance)| *distance <= NEAR);
    if let Some((run, at, _)) = hovered
        && let Some(step) = inspection.step(run, at)
    {
        painter.circle_stroke(plot.cost_at(at, step), 6.0, Stroke::new(1.0, p.strong));
        label(p, &painter, &plot, run, at, step);
    }
    if response.clicked() || response.dragged() {
        let to = response.interact_pointer_pos()?;
        let share = ((to.x - plot.cost.left()) / plot.cost.width()).clamp(0.0, 1.0);
        let column = (share * (steps - 1) as f32).round() as usize;
        // A click on another start's curve shows that start; a drag stays with the one shown.
        let go = match hovered {
            Some((run, at, _)) if response.clicked() => InspectCommand::Go { run, at },
            _ => InspectCommand::Go { run: shown.run, at: column },
        };
        let same = matches!(go, InspectCommand::Go { run, at } if run == shown.run && at == shown.at);
        return (!same).then_some(go);
    }
    None
}

fn axes(p: &Palette, painter: &Painter, plot: &Plot<'_>) {
    let font = FontId::proportional(10.0);
    let faint = Stroke::new(1.0, p.line);
    for (rect, top, unit, title) in
        [(plot.cost, plot.top_mm, 1.0, "√cost per point, mm"), (plot.share, 100.0, 1.0, "points that fit, %")]
    {
        for share in [0.0, 0.5, 1.0] {
            let y = rect.bottom() - share as f32 * rect.height();
            painter.hline(rect.x_range(), y, faint);
            let value = top * share * unit;
            let text = if top >= 10.0 || value == 0.0 { format!("{value:.0}") } else { format!("{value:.2}") };
            painter.text(pos2(rect.left() - 4.0, y), Align2::RIGHT_CENTER, text, font.clone(), p.weak);
        }
        painter.text(pos2(rect.left(), rect.top() - 2.0), Align2::LEFT_BOTTOM, title, font.clone(), p.weak);
    }
    let last = plot.steps - 1;
    let every = [1, 2, 5, 10, 20, 50, 100].into_iter().find(|e| last / e <= 10).unwrap_or(last.max(1));
    for at in (0..=last).step_by(every) {
        let place = pos2(plot.x(at), plot.share.bottom() + 2.0);
        painter.text(place, Align2::CENTER_TOP, at.to_string(), font.clone(), p.weak);
    }
    let end = pos2(plot.share.right(), plot.share.top() - 2.0);
    painter.text(end, Align2::RIGHT_BOTTOM, "step", font, p.weak);
}

/// Lines where the kernel's width or the points change: costs on both sides of a line are not of one kind.
fn kernels(p: &Palette, painter: &Painter, plot: &Plot<'_>, run: usize) {
    let font = FontId::proportional(10.0);
    let mut before = None;
    // Labels that would lie on each other are left out: the table has the numbers of every step.
    let mut free = plot.cost.left();
    for (at, step) in plot.inspection.steps(run).enumerate() {
        let now = (step.kernel_m, step.points);
        if step.kernel_m.is_finite() && before != Some(now) {
            let x = plot.x(at);
            painter.add(Shape::dashed_line(
                &[pos2(x, plot.cost.top()), pos2(x, plot.share.bottom())],
                Stroke::new(1.0, p.weak.gamma_multiply(0.6)),
                2.0,
                3.0,
            ));
            let text = format!("{} mm, {} points", (10.0 * units::mm(step.kernel_m)).round() / 10.0, step.points);
            let galley = painter.layout_no_wrap(text, font.clone(), p.weak);
            let width = galley.size().x + 6.0;
            let left = if plot.cost.right() - x < width { x - width } else { x };
            if left >= free - 0.5 {
                painter.galley(pos2(left + 3.0, plot.cost.top() + 1.0), galley, p.weak);
                free = left + width;
            }
        }
        before = Some(now);
    }
}

fn curve(p: &Palette, painter: &Painter, plot: &Plot<'_>, run: usize, shown: bool) {
    let color = if shown { p.accent } else { mix(p.panel, p.weak, 0.7) };
    let stroke = Stroke::new(if shown { 2.0 } else { 1.0 }, color);
    let steps: Vec<&TraceStep> = plot.inspection.steps(run).collect();
    for (at, pair) in steps.windows(2).enumerate() {
        let jump = pair[0].kernel_m != pair[1].kernel_m || pair[0].points != pair[1].points;
        // A jump of the cost at another kernel is no change of the fit: no line.
        if !jump {
            painter.line_segment([plot.cost_at(at, pair[0]), plot.cost_at(at + 1, pair[1])], stroke);
        }
        painter.line_segment([plot.share_at(at, pair[0]), plot.share_at(at + 1, pair[1])], stroke);
    }
    for (at, step) in steps.iter().enumerate() {
        painter.circle_filled(plot.cost_at(at, step), if shown { 2.0 } else { 1.2 }, color);
    }
    if run == plot.inspection.report().winner
        && let Some(step) = steps.last()
    {
        painter.circle_stroke(plot.cost_at(steps.len() - 1, step), 5.0, Stroke::new(1.5, p.good));
    }
}

fn pins(cx: &Cx<'_>, painter: &Painter, plot: &Plot<'_>) {
    for (i, pin) in cx.state.inspect.pins_of(cx.state.pair_key()).into_iter().enumerate() {
        let Some(pin) = pin else { continue };
        let here = pin.source == cx.state.inspect.source && pin.registration == cx.state.settings.registration;
        let step = plot.inspection.step(pin.run, pin.at).filter(|s| s.grasp_from_object == pin.grasp_from_object);
        if let (true, Some(step)) = (here, step) {
            let at = plot.cost_at(pin.at, step);
            painter.circle_stroke(at, 6.0, Stroke::new(2.0, cx.p.pins[i]));
            let font = FontId::proportional(11.0);
            painter.text(at - vec2(0.0, 8.0), Align2::CENTER_BOTTOM, ["A", "B"][i], font, cx.p.pins[i]);
        }
    }
}

/// The figures of the step under the pointer, beside it.
fn label(p: &Palette, painter: &Painter, plot: &Plot<'_>, run: usize, at: usize, step: &TraceStep) {
    let angle = units::text_deg(units::wrap_angle(-step.grasp_from_object.theta_rad));
    let (cost, inliers) = (root_mm(step.cost_m2), step.inlier_share * 100.0);
    let text = format!("start {}, step {at}\n{angle} · {cost:.2} mm · {inliers:.0} %", run + 1);
    let galley = painter.layout_no_wrap(text, FontId::proportional(11.0), p.strong);
    let x = (plot.x(at) + 10.0).min(plot.cost.right() - galley.size().x - 4.0);
    let y = (plot.cost_at(at, step).y - galley.size().y - 8.0).max(plot.cost.top() + 2.0);
    let back = Rect::from_min_size(pos2(x, y), galley.size()).expand(3.0);
    painter.rect(back, 3.0, p.panel, Stroke::new(1.0, p.line), egui::StrokeKind::Outside);
    painter.galley(pos2(x, y), galley, Color32::PLACEHOLDER);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_at_round_numbers() {
        for (value, top) in [(0.34, 0.4), (1.0, 1.0), (4.2, 5.0), (12.0, 15.0), (81.0, 100.0)] {
            assert!((round_up(value) - top).abs() < 1e-9, "{value}");
        }
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(round_up(odd), 1.0);
        }
    }
}
