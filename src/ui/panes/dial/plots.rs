//! The plots of the dial.

use eframe::egui::{
    self, Align2, Color32, FontId, Pos2, Rect, RichText, Role, Sense, Shape, Stroke, StrokeKind, Ui, WidgetInfo, pos2,
    vec2,
};

use crate::app::command::{DialCommand, LibraryCommand};
use crate::app::dial;
use crate::ui::parts::cx::{Cx, side_color};
use crate::ui::parts::theme::{SMALL, medium};
use touch2touch_core::dataset::PairId;
use touch2touch_work::sweep::{Outcome, Point, Series, Setting, Sweep};

/// Columns of a small plot, and the one of the pairs without a pose besides.
const COLUMNS: usize = 24;
/// Errors beyond this share the last column, degrees.
const MOST_DEG: f64 = 30.0;
/// Least width of a small plot with its frame, points.
const CELL: f32 = 146.0;
/// Height of a small plot without its texts, points.
const HEIGHT: f32 = 58.0;
/// Between two of them, points.
const GAP: f32 = 8.0;
/// Largest radius of a dot, points.
const DOT: f32 = 3.0;
/// Distance of the pointer from a dot at which it means it, points.
const NEAR: f32 = 6.0;
/// Height of the line plot, points.
const LINE_HEIGHT: f32 = 88.0;
/// From this width on a small plot says how many contact points there are, points.
const WIDE: f32 = 200.0;

/// Position of a pair, degrees: its error, or without a truth its change.
fn place_deg(series: &Series, outcome: &Outcome) -> Option<f64> {
    let radians = if series.has_truth() { outcome.error_rad } else { outcome.change_rad };
    radians.map(|r| r.to_degrees().abs())
}

/// Axes that all small plots of a series share.
struct Axes {
    /// Degrees at the right end.
    most_deg: f64,
    /// Dots in the fullest column.
    tallest: usize,
}

impl Axes {
    fn of(series: &Series) -> Self {
        let all = || std::iter::once(&series.base).chain(&series.points);
        let places = all().flat_map(|point| point.cases.iter().filter_map(|case| place_deg(series, case)));
        let most_deg = places.fold(5.0_f64, f64::max).ceil().min(MOST_DEG);
        let mut axes = Self { most_deg, tallest: 1 };
        axes.tallest =
            all().map(|point| axes.columns(series, point).iter().map(Vec::len).max().unwrap_or(1)).max().unwrap_or(1);
        axes
    }

    /// The pairs in each column, the best first; those without a pose in the last.
    fn columns<'a>(&self, series: &Series, point: &'a Point) -> Vec<Vec<&'a Outcome>> {
        let mut columns = vec![Vec::new(); COLUMNS + 1];
        let mut cases: Vec<(f64, &Outcome)> = point
            .cases
            .iter()
            // A pair whose truth is not known has no place among those whose truth is.
            .filter(|case| case.truth || !series.has_truth())
            .map(|case| (place_deg(series, case).unwrap_or(f64::INFINITY), case))
            .collect();
        cases.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (deg, case) in cases {
            let at = if case.failure.is_some() || deg.is_infinite() {
                COLUMNS
            } else {
                ((deg / self.most_deg * COLUMNS as f64) as usize).min(COLUMNS - 1)
            };
            columns[at].push(case);
        }
        columns
    }
}

/// A value's name in the plots: short.
fn name(value: Option<Setting>) -> String {
    match value {
        None => "as set".to_owned(),
        Some(shift @ Setting::Shift(_)) => shift.key(),
        Some(value) => value.label(),
    }
}

fn small() -> FontId {
    FontId::proportional(SMALL)
}

/// One small plot for each value.
pub(super) fn multiples(cx: &mut Cx<'_>, ui: &mut Ui, sweep: &Sweep, series: &Series) {
    let axes = Axes::of(series);
    // Where the dial stands at none of the values, what is in force is a plot of its own.
    let standing = series.points.iter().any(|point| point.in_force);
    let base = (!standing).then_some(&series.base);
    let shown: Vec<(Option<usize>, &Point)> = base
        .map(|point| (None, point))
        .into_iter()
        .chain(series.points.iter().enumerate().map(|(i, p)| (Some(i), p)))
        .collect();
    let across = ((ui.available_width() + GAP) / (CELL + GAP)).floor().max(1.0) as usize;
    let across = across.min(shown.len());
    let width = ((ui.available_width() - 12.0 + GAP) / across as f32 - GAP).min(1.5 * CELL);
    ui.spacing_mut().item_spacing = vec2(GAP, GAP);
    for row in shown.chunks(across) {
        ui.horizontal_top(|ui| {
            for (at, point) in row {
                let best = at.is_some() && *at == series.best;
                ui.allocate_ui(vec2(width, HEIGHT + 54.0), |ui| {
                    ui.vertical(|ui| cell(cx, ui, (sweep, series), point, best, (&axes, width)));
                });
            }
        });
    }
}

/// A value: its name and marks, its dots, what they say in sum, and a button.
fn cell(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    (sweep, series): (&Sweep, &Series),
    point: &Point,
    best: bool,
    (axes, width): (&Axes, f32),
) {
    ui.spacing_mut().item_spacing = vec2(6.0, 2.0);
    let dialed = match point.value {
        Some(value) => dial::is_dialed(cx.state, value, point.in_force),
        None => dial::recipe(cx.state) == sweep.in_force,
    };
    ui.horizontal(|ui| {
        ui.set_width(width);
        ui.label(RichText::new(name(point.value)).family(medium()).color(cx.p.strong));
        if dialed && point.value.is_some() {
            ui.label(RichText::new("in force").size(SMALL).color(cx.p.accent)).on_hover_text("What decides poses now");
        }
        if best {
            let tip = "The best of these values: most pairs within 5°, then within 10°, then the least median";
            ui.label(RichText::new("best").size(SMALL).color(cx.p.good)).on_hover_text(tip);
        }
        let Some(value) = point.value.filter(|value| !dialed && value.put(&dial::recipe(cx.state)).is_ok()) else {
            return;
        };
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let button = ui.add(egui::Button::new(RichText::new("Use").size(SMALL)).small());
            let button = button.accessible_name(format!("Use {}", value.label()));
            let tip = format!("Use this value: {} decides all poses from now on", value.label());
            if button.on_hover_text(tip).clicked() {
                cx.push(DialCommand::Use(value));
            }
        });
    });
    let stroke = match (best, dialed) {
        (_, true) => Stroke::new(1.5, cx.p.accent),
        (true, false) => Stroke::new(1.5, cx.p.good),
        (false, false) => Stroke::new(1.0, cx.p.line),
    };
    dots(cx, ui, series, point, axes, (width, stroke));
    let (text, more) = in_sum(series, point, width >= WIDE);
    ui.add(egui::Label::new(RichText::new(text).size(SMALL).color(cx.p.text)).truncate()).on_hover_text(more);
}

/// A line about all pairs of a value, and all there is to say.
fn in_sum(series: &Series, point: &Point, wide: bool) -> (String, String) {
    let s = &point.summary;
    let mut parts = Vec::new();
    let mut more = vec![format!(
        "{}, {} imprints, {} pairs",
        point.value.map_or(name(None), Setting::label),
        series.source.key(),
        point.cases.len()
    )];
    if let Some(angle) = &s.angle {
        let median = angle.median_deg.map_or("no pose".to_owned(), |deg| format!("median {deg:.2}°"));
        parts.push(format!("{median}   ≤5° {:.0} %", angle.success_5));
        more.push(format!(
            "{median}, mean {}\nwithin 5° {:.1} %, within 10° {:.1} % of {} pairs with a known pose",
            angle.mean_deg.map_or("-".to_owned(), |deg| format!("{deg:.2}°")),
            angle.success_5,
            angle.success_10,
            angle.count
        ));
    }
    let change = s.median_change_rad.map(|r| format!("change {:.2}°", r.to_degrees()));
    let rms = s.median_rms_m.map(|m| format!("residual {:.3} mm", m * 1e3));
    if s.angle.is_none() {
        parts.extend(change.clone());
        parts.extend(rms.clone());
    }
    more.extend(change.map(|text| format!("median {text} against what was in force")));
    more.extend(rms.map(|text| format!("median {text}")));
    if let Some(points) = s.median_points {
        parts.extend(wide.then(|| format!("{points:.0} pts")));
        more.push(format!("median of {points:.0} contact points"));
    }
    for failure in &s.failures {
        more.push(format!("{} without a pose: {}", failure.count, failure.why));
    }
    (parts.join("   "), more.join("\n"))
}

/// One dot for each pair, on axes that all plots share.
fn dots(cx: &mut Cx<'_>, ui: &mut Ui, series: &Series, point: &Point, axes: &Axes, (width, stroke): (f32, Stroke)) {
    let p = cx.p;
    let (rect, response) = ui.allocate_exact_size(vec2(width, HEIGHT + 14.0), Sense::click());
    let plot = Rect::from_min_size(rect.min, vec2(width, HEIGHT));
    let painter = ui.painter_at(rect);
    painter.rect_filled(plot, 3.0, p.canvas);
    painter.rect_stroke(plot, 3.0, stroke, StrokeKind::Inside);
    // The last two columns' room is for the pairs without a pose.
    let (left, right) = (plot.left() + 4.0, plot.right() - 20.0);
    let column = (right - left) / COLUMNS as f32;
    let radius = (0.5 * column).min(0.5 * (HEIGHT - 8.0) / axes.tallest as f32).clamp(1.0, DOT);
    let rise = ((HEIGHT - 8.0) / axes.tallest as f32).min(2.0 * radius + 1.0);
    let x_of = |deg: f64| left + (deg / axes.most_deg) as f32 * (right - left);
    let place = |at: usize, up: usize| {
        let x = if at == COLUMNS { plot.right() - 10.0 } else { left + (at as f32 + 0.5) * column };
        pos2(x, plot.bottom() - 4.0 - radius - up as f32 * rise)
    };
    if series.has_truth() {
        painter.vline(x_of(5.0), plot.y_range(), Stroke::new(0.5, p.line));
    }
    painter.vline(right + 2.0, plot.y_range(), Stroke::new(0.5, p.line));
    let beyond = if axes.most_deg >= MOST_DEG { "+" } else { "" };
    let below = plot.bottom() + 1.0;
    painter.text(pos2(left, below), Align2::LEFT_TOP, "0°", small(), p.weak);
    painter.text(pos2(right, below), Align2::RIGHT_TOP, format!("{:.0}°{beyond}", axes.most_deg), small(), p.weak);
    if series.has_truth() && axes.most_deg > 12.0 {
        painter.text(pos2(x_of(5.0), below), Align2::CENTER_TOP, "5°", small(), p.weak);
    }
    painter.text(pos2(plot.right(), below), Align2::RIGHT_TOP, "–", small(), p.wrong);
    let (color, selected) = (side_color(p, series.source), cx.state.selection.pair);
    let mut near: Option<(f32, Pos2, &Outcome)> = None;
    for (at, cases) in axes.columns(series, point).into_iter().enumerate() {
        for (up, case) in cases.into_iter().enumerate() {
            let center = place(at, up);
            let color = if at == COLUMNS { p.wrong } else { color };
            painter.circle_filled(center, radius, color);
            if Some(case.pair) == selected {
                painter.circle_stroke(center, radius + 2.0, Stroke::new(1.5, p.strong));
            }
            if let Some(distance) = response.hover_pos().map(|pointer| pointer.distance(center))
                && distance <= NEAR
                && near.is_none_or(|(least, ..)| distance < least)
            {
                near = Some((distance, center, case));
            }
        }
    }
    let (text, _) = in_sum(series, point, true);
    let label = format!("Pairs at {}: {text}", name(point.value));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &label));
    let Some((_, center, case)) = near else { return };
    painter.circle_stroke(center, radius + 2.0, Stroke::new(1.5, p.accent));
    if response.clicked() {
        open(cx, case.pair);
    }
    response.on_hover_text_at_pointer(said(case));
}

fn open(cx: &mut Cx<'_>, pair: PairId) {
    cx.push(LibraryCommand::Select(pair));
}

/// A pair with a value, in words.
fn said(case: &Outcome) -> String {
    let mut lines = vec![case.name.clone()];
    let degrees = |radians: f64| radians.to_degrees().abs();
    lines.extend(case.error_rad.map(|r| format!("error {:.2}°", degrees(r))));
    lines.extend(case.change_rad.map(|r| format!("change {:.2}° against what was in force", degrees(r))));
    lines.extend(case.rms_m.map(|m| format!("residual {:.3} mm", m * 1e3)));
    lines.push(format!("{} contact points", case.points));
    lines.extend(case.failure.as_ref().map(|why| format!("no pose: {why}")));
    lines.join("\n")
}

/// Curve that is drawn over the values.
struct Track {
    name: &'static str,
    unit: &'static str,
    color: Color32,
    /// Of each point.
    values: Vec<Option<f64>>,
    /// Without the dial.
    base: Option<f64>,
    /// Top of its axis.
    top: f64,
}

impl Track {
    fn new(
        series: &Series,
        (name, unit, color): (&'static str, &'static str, Color32),
        get: impl Fn(&Point) -> Option<f64>,
    ) -> Self {
        let (values, base) = (series.points.iter().map(&get).collect::<Vec<_>>(), get(&series.base));
        let finite = values.iter().chain([&base]).flatten().copied().filter(|v| v.is_finite());
        let top = finite.fold(0.0, f64::max).max(1e-9);
        Self { name, unit, color, values, base, top }
    }
}

/// Success and median over the value.
pub(super) fn line(cx: &Cx<'_>, ui: &mut Ui, sweep: &Sweep, series: &Series) {
    let p = cx.p;
    let side = side_color(p, series.source);
    let what = if series.has_truth() { "median error" } else { "median change" };
    let median = |point: &Point| match &point.summary.angle {
        Some(angle) => angle.median_deg,
        None => point.summary.median_change_rad.map(f64::to_degrees),
    };
    let second = if series.has_truth() {
        let success = |point: &Point| point.summary.angle.map(|angle| angle.success_5);
        Track { top: 100.0, ..Track::new(series, ("within 5°", " %", p.good), success) }
    } else {
        let rms = |point: &Point| point.summary.median_rms_m.map(|m| m * 1e3);
        Track::new(series, ("median residual", " mm", p.cad), rms)
    };
    let tracks = [Track::new(series, (what, "°", side), median), second];
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width() - 12.0, LINE_HEIGHT), Sense::hover());
    let painter = ui.painter_at(rect);
    let plot = Rect::from_min_max(rect.min + vec2(52.0, 16.0), rect.max - vec2(52.0, 16.0));
    if !plot.is_positive() || series.points.is_empty() {
        return;
    }
    painter.rect_filled(plot, 2.0, p.canvas);
    let last = (series.points.len().max(2) - 1) as f32;
    let x = |at: usize| plot.left() + 10.0 + at as f32 / last * (plot.width() - 20.0);
    let y = |value: f64, top: f64| plot.bottom() - 3.0 - (value / top) as f32 * (plot.height() - 6.0);
    for (at, point) in series.points.iter().enumerate() {
        if point.value.is_some_and(|value| dial::is_dialed(cx.state, value, point.in_force)) {
            painter.vline(x(at), plot.y_range(), Stroke::new(1.5, p.accent));
        }
    }
    let standing = series.points.iter().any(|point| point.in_force);
    for (i, Track { name, unit, color, values, base, top }) in tracks.iter().enumerate() {
        // Where the dial stands at none of the values, what is in force is a level of its own.
        if let Some(base) = base.filter(|base| !standing && base.is_finite()) {
            let ends = [plot.left(), plot.right()].map(|x| pos2(x, y(base, *top)));
            painter.extend(Shape::dashed_line(&ends, Stroke::new(1.0, *color), 4.0, 4.0));
        }
        let mut at = 0;
        for run in values.split(Option::is_none) {
            let points: Vec<Pos2> =
                run.iter().flatten().enumerate().map(|(i, value)| pos2(x(at + i), y(*value, *top))).collect();
            for center in &points {
                painter.circle_filled(*center, 2.0, *color);
            }
            painter.add(Shape::line(points, Stroke::new(1.5, *color)));
            at += run.len() + 1;
        }
        // The first at the left, the second at the right.
        let (edge, align, ends) = if i == 0 {
            (plot.left() - 4.0, Align2::RIGHT_CENTER, Align2::LEFT_TOP)
        } else {
            (plot.right() + 4.0, Align2::LEFT_CENTER, Align2::RIGHT_TOP)
        };
        let digits = usize::from(*top < 20.0) + usize::from(*top < 2.0);
        for value in [0.0, *top] {
            let text = format!("{value:.*}{unit}", if value == 0.0 { 0 } else { digits });
            painter.text(pos2(edge, y(value, *top)), align, text, small(), *color);
        }
        let dashed = if standing { "" } else { ", dashed: as set" };
        let corner = if i == 0 { pos2(plot.left(), rect.top()) } else { pos2(plot.right(), rect.top()) };
        painter.text(corner, ends, format!("{name}{dashed}"), small(), *color);
    }
    if let Some((best, value)) = series.best.and_then(|best| Some((best, tracks[0].values[best]?))) {
        painter.circle_stroke(pos2(x(best), y(value, tracks[0].top)), 5.0, Stroke::new(1.5, p.good));
    }
    // As many names as there is room for.
    let every = (series.points.len() as f32 * 76.0 / plot.width().max(1.0)).ceil().max(1.0) as usize;
    for (at, point) in series.points.iter().enumerate().filter(|(at, _)| at % every == 0) {
        painter.text(pos2(x(at), plot.bottom() + 2.0), Align2::CENTER_TOP, name(point.value), small(), p.weak);
    }
    let label = format!("{}: {what} and success over {} values", sweep.dial.name(), series.points.len());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &label));
    let Some(pointer) = response.hover_pos() else { return };
    let near = (0..series.points.len()).min_by(|a, b| (x(*a) - pointer.x).abs().total_cmp(&(x(*b) - pointer.x).abs()));
    if let Some(point) = near.map(|at| &series.points[at]) {
        response.on_hover_text_at_pointer(in_sum(series, point, true).1);
    }
}
