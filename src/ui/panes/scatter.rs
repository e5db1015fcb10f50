//! Two scores of all pairs against each other, or one of them by tool: a click opens a pair, a drag brushes the list.

use std::collections::BTreeSet;
use std::sync::Arc;

use eframe::egui::{
    self, Align2, Color32, FontId, Rect, Role, ScrollArea, Sense, Stroke, StrokeKind, Ui, WidgetInfo, ecolor, pos2,
    vec2,
};
use strum::{EnumIter, IntoEnumIterator as _};

use crate::app::command::{LibraryCommand, Pane};
use crate::app::scores::{ScoreTable, SourceScores};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption};
use crate::ui::parts::widget::cut::cut_in_the_middle;
use crate::ui::parts::widget::empty;

use touch2touch_core::dataset::PairId;
use touch2touch_core::evaluation::{Metric, mean};

/// Room for the numbers of the axes, points.
const MARGIN: [f32; 2] = [44.0, 30.0];
/// Distance of the pointer from a point at which it means it, points.
const NEAR: f32 = 8.0;
/// A shorter drag is a click, points.
const DRAG: f32 = 4.0;
/// Bars of a histogram.
const BARS: usize = 24;
/// Least and largest height of a tool's histogram, points.
const STRIP: [f32; 2] = [16.0, 34.0];

/// A score: a place among the sources, and a metric. Values are brought to the unit of the screen.
#[derive(Clone, Debug, PartialEq)]
struct Axis {
    source: Arc<str>,
    metric: Metric,
}

/// Meaning of the points' colors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, EnumIter)]
enum Coloring {
    /// The tool.
    #[default]
    Tool,
    /// The source: the two metrics of every source, each in its color.
    Source,
}

impl Coloring {
    fn name(self) -> &'static str {
        match self {
            Self::Tool => "by tool",
            Self::Source => "by source",
        }
    }
}

/// Choices of the scatter, and the rectangle being drawn.
#[derive(Default)]
pub(crate) struct Memory {
    axes: [Option<Axis>; 2],
    coloring: Coloring,
    /// True where the first axis is shown as a histogram of each tool.
    by_tool: bool,
    /// Corner at which a rectangle was begun.
    begun: Option<egui::Pos2>,
}

/// A pair's point, in the units of the screen.
struct Point {
    pair: PairId,
    at: [f64; 2],
    color: Color32,
    source: [usize; 2],
}

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, _: Pane) {
    crate::ui::parts::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        let scores = cx.state.table.scores.clone();
        let Some(axes) = axes(&scores, memory) else {
            let how = "A point for each pair that was scored: Predict all, above the list of pairs";
            empty::show(ui, "No scores yet", how, None);
            return;
        };
        let axes = controls(cx, ui, memory, &scores, axes);
        if memory.by_tool {
            histograms(cx, ui, &scores, &axes[0]);
        } else {
            scatter(cx, ui, memory, &scores, &axes);
        }
    });
}

/// The axes in force: as chosen, else the angle error of the measured and of the predicted imprints.
fn axes(scores: &ScoreTable, memory: &Memory) -> Option<[Axis; 2]> {
    let sources = &scores.sources;
    let first = sources.iter().find(|source| !source.upper_bound).or(sources.first())?;
    let bound = sources.iter().find(|source| source.upper_bound).unwrap_or(first);
    let default = |source: &SourceScores, others: &[Metric]| {
        let metric = others.iter().copied().find(|metric| source.has(*metric)).or_else(|| source.metrics().next())?;
        Some(Axis { source: source.name.clone(), metric })
    };
    let there = |axis: &Option<Axis>| {
        axis.clone().filter(|a| sources.iter().any(|source| source.name == a.source && source.has(a.metric)))
    };
    let x = there(&memory.axes[0]).or_else(|| default(first, &[Metric::Angle, Metric::Ssim]))?;
    let y = there(&memory.axes[1]).or_else(|| {
        let [same, other] = if bound.has(Metric::Angle) && bound.name != first.name {
            [Metric::Angle, Metric::Psnr]
        } else {
            [Metric::Psnr, Metric::Ssim]
        };
        default(if same == Metric::Angle { bound } else { first }, &[same, other])
    })?;
    Some([x, y])
}

/// Choice of the scores, and of how they are shown.
fn controls(cx: &Cx<'_>, ui: &mut Ui, memory: &mut Memory, scores: &ScoreTable, mut axes: [Axis; 2]) -> [Axis; 2] {
    let shown = if memory.by_tool { 1 } else { 2 };
    for (axis_index, (axis, name)) in axes.iter_mut().zip(["x", "y"]).enumerate().take(shown) {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.label(caption(name, cx.p));
            let text = format!("{}: {}", axis.metric.name(), short(scores, &axis.source));
            let combo = egui::ComboBox::from_id_salt(("axis", axis_index)).width(ui.available_width() - 8.0);
            let response = combo.selected_text(text).truncate().show_ui(ui, |ui| {
                for source in &scores.sources {
                    ui.label(caption(&*source.name, cx.p));
                    for metric in source.metrics() {
                        let this = Axis { source: source.name.clone(), metric };
                        if ui.selectable_label(*axis == this, metric.name()).on_hover_text(metric.tip()).clicked() {
                            memory.axes[axis_index] = Some(this.clone());
                            *axis = this;
                        }
                    }
                }
            });
            let tip = "Which score of which source stands along this axis";
            response.response.accessible_name(format!("Score along {name}")).on_hover_text(tip);
        });
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        if !memory.by_tool {
            for coloring in Coloring::iter() {
                let tip = match coloring {
                    Coloring::Tool => "A color for each tool; the tooltip of a point names it",
                    Coloring::Source => "The two metrics of every source, in the colors of measured and predicted",
                };
                let chosen = memory.coloring == coloring;
                if ui.selectable_label(chosen, coloring.name()).on_hover_text(tip).clicked() {
                    memory.coloring = coloring;
                }
            }
        }
        let tip = "A histogram of the score along x for each tool, with its mean and median";
        ui.toggle_value(&mut memory.by_tool, "histograms").on_hover_text(tip);
    });
    axes
}

fn short<'a>(scores: &'a ScoreTable, name: &'a str) -> &'a str {
    scores.sources.iter().find(|source| *source.name == *name).map_or(name, SourceScores::short)
}

/// A color for each of some tools, around the circle of hues.
fn tool_color(dark: bool, index: usize, of: usize) -> Color32 {
    let hue = index as f32 / of.max(1) as f32;
    ecolor::Hsva::new(hue, 0.6, if dark { 0.95 } else { 0.65 }, 1.0).into()
}

/// The points of the pairs that have both scores. Pairs without a pose have none.
fn points(cx: &Cx<'_>, memory: &Memory, scores: &ScoreTable, axes: &[Axis; 2]) -> Vec<Point> {
    let sources = &scores.sources;
    let place = |name: &str| sources.iter().position(|source| *source.name == *name).unwrap_or(0);
    let series: Vec<[usize; 2]> = match memory.coloring {
        Coloring::Tool => vec![[place(&axes[0].source), place(&axes[1].source)]],
        Coloring::Source => (0..sources.len()).map(|source| [source, source]).collect(),
    };
    let tools = cx.state.library.open.as_ref().map_or(&[][..], |open| &open.tools);
    let dark = cx.p.canvas.r() < 128;
    let mut points = Vec::new();
    for source in series {
        for pair in &cx.state.library.order {
            let value = |axis: usize| sources[source[axis]].value(*pair, axes[axis].metric).filter(|v| v.is_finite());
            let (Some(x), Some(y)) = (value(0), value(1)) else { continue };
            let color = match memory.coloring {
                Coloring::Source if sources[source[0]].upper_bound => cx.p.truth,
                Coloring::Source => cx.p.prediction,
                Coloring::Tool => {
                    let tool = cx.state.library.entry(*pair).and_then(|entry| entry.tool.as_ref());
                    let index = tool.and_then(|tool| tools.iter().position(|t| t == tool));
                    index.map_or(cx.p.text, |index| tool_color(dark, index, tools.len()))
                }
            };
            points.push(Point { pair: *pair, at: [axes[0].metric.shown(x), axes[1].metric.shown(y)], color, source });
        }
    }
    points
}

/// The range of some numbers with a little room; `None` without any.
fn range(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
    let room = if high > low { 0.04 * (high - low) } else { 0.5 };
    // What cannot be negative does not look as if it were.
    let start = if low >= 0.0 { (low - room).max(0.0) } else { low - room };
    (low <= high).then_some([start, high + room])
}

fn scatter(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, scores: &ScoreTable, axes: &[Axis; 2]) {
    let p = cx.p;
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
    let plot = Rect::from_min_max(rect.min + vec2(MARGIN[0], 6.0), rect.max - vec2(8.0, MARGIN[1]));
    let points = points(cx, memory, scores, axes);
    let ranges = [0, 1].map(|axis| range(points.iter().map(|point| point.at[axis])));
    let [Some(xs), Some(ys)] = ranges else {
        ui.painter().text(
            rect.center(),
            Align2::CENTER_CENTER,
            "No listed pair has both scores",
            FontId::proportional(12.0),
            p.weak,
        );
        return;
    };
    if !plot.is_positive() {
        return;
    }
    let place = |values: [f64; 2]| {
        let share = |v: f64, [low, high]: [f64; 2]| ((v - low) / (high - low)) as f32;
        pos2(plot.left() + share(values[0], xs) * plot.width(), plot.bottom() - share(values[1], ys) * plot.height())
    };
    let painter = ui.painter_at(rect);
    painter.rect_filled(plot, 2.0, p.canvas);
    let font = FontId::proportional(SMALL);
    let titles = [0, 1].map(|axis| {
        let width = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), p.text).size().x;
        cut_in_the_middle(&title(scores, memory, &axes[axis]), plot.width() - 8.0, width)
    });
    ticks(ui, plot, xs, ys, axes, p.weak, p.line);
    painter.text(
        pos2(plot.center().x, rect.bottom()),
        Align2::CENTER_BOTTOM,
        &titles[0],
        FontId::proportional(SMALL),
        p.text,
    );
    let above = pos2(plot.left() + 4.0, plot.top() + 2.0);
    painter.text(above, Align2::LEFT_TOP, &titles[1], FontId::proportional(SMALL), p.text);
    // One source against another by the same metric: on the line both are equal.
    if axes[0].metric == axes[1].metric {
        let (low, high) = (xs[0].max(ys[0]), xs[1].min(ys[1]));
        painter.with_clip_rect(plot).line_segment([place([low, low]), place([high, high])], Stroke::new(1.0, p.line));
    }
    let selected = cx.state.selection.pair;
    for point in &points {
        painter.circle_filled(place(point.at), 2.75, point.color.gamma_multiply(0.85));
    }
    for point in points.iter().filter(|point| Some(point.pair) == selected) {
        painter.circle_stroke(place(point.at), 6.0, Stroke::new(1.5, p.accent));
    }
    response.widget_info(|| {
        let text = format!("Scatter of {} points, {} against {}", points.len(), titles[1], titles[0]);
        WidgetInfo::labeled(Role::Image, true, text)
    });
    brush(cx, ui, memory, &response, plot, |area| {
        points.iter().filter(|point| area.contains(place(point.at))).map(|point| point.pair).collect()
    });
    let Some(pointer) = response.hover_pos().filter(|_| memory.begun.is_none()) else { return };
    let near = points.iter().map(|point| (place(point.at).distance(pointer), point));
    let Some((_, point)) = near.filter(|(d, _)| *d <= NEAR).min_by(|a, b| a.0.total_cmp(&b.0)) else { return };
    painter.circle_stroke(place(point.at), 5.0, Stroke::new(1.5, p.strong));
    let value = |axis: usize| {
        let (metric, v) = (axes[axis].metric, point.at[axis]);
        let source = &scores.sources[point.source[axis]];
        format!("{} {}: {:.*} {}", source.short(), metric.name(), metric.decimals(), v, metric.unit())
    };
    let name = cx.state.library.entry(point.pair).map_or("", |entry| &entry.name);
    let said = format!("{name}\n{}\n{}", value(0), value(1));
    if response.clicked() {
        cx.push(LibraryCommand::Select(point.pair));
    }
    response.on_hover_text_at_pointer(said);
}

fn title(scores: &ScoreTable, memory: &Memory, axis: &Axis) -> String {
    let source = match memory.coloring {
        Coloring::Tool => format!("{} ", short(scores, &axis.source)),
        Coloring::Source if !memory.by_tool => String::new(),
        Coloring::Source => format!("{} ", short(scores, &axis.source)),
    };
    let unit = if axis.metric.unit().is_empty() { String::new() } else { format!(", {}", axis.metric.unit()) };
    format!("{source}{}{unit}", axis.metric.name())
}

/// Numbers along the axes: the ends and the middle.
fn ticks(ui: &Ui, plot: Rect, xs: [f64; 2], ys: [f64; 2], axes: &[Axis; 2], text: Color32, line: Color32) {
    let painter = ui.painter();
    let font = FontId::proportional(SMALL);
    for (share, align) in [(0.0_f32, Align2::LEFT_TOP), (0.5, Align2::CENTER_TOP), (1.0, Align2::RIGHT_TOP)] {
        let value = |[low, high]: [f64; 2]| low + f64::from(share) * (high - low);
        let x = plot.left() + share * plot.width();
        let label = tick(axes[0].metric, value(xs));
        painter.text(pos2(x, plot.bottom() + 2.0), align, label, font.clone(), text);
        let y = plot.bottom() - share * plot.height();
        let label = tick(axes[1].metric, value(ys));
        let align = if share == 0.0 {
            Align2::RIGHT_BOTTOM
        } else if share == 1.0 {
            Align2::RIGHT_TOP
        } else {
            Align2::RIGHT_CENTER
        };
        painter.text(pos2(plot.left() - 4.0, y), align, label, font.clone(), text);
        painter.vline(x, plot.y_range(), Stroke::new(0.5, line));
        painter.hline(plot.x_range(), y, Stroke::new(0.5, line));
    }
}

/// A number at an axis: nothing is no less than nothing.
fn tick(metric: Metric, value: f64) -> String {
    let text = format!("{value:.*}", metric.decimals());
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.to_owned(),
        _ => text,
    }
}

/// A rectangle that is dragged: the pairs inside are listed alone. A click beside the points lists all again.
fn brush(
    cx: &mut Cx<'_>,
    ui: &Ui,
    memory: &mut Memory,
    response: &egui::Response,
    plot: Rect,
    inside: impl FnOnce(Rect) -> BTreeSet<PairId>,
) {
    if response.drag_started() {
        // Where the button went down, not where the pointer was when it had moved far enough.
        memory.begun = ui.input(|input| input.pointer.press_origin()).or_else(|| response.interact_pointer_pos());
    }
    let Some(begun) = memory.begun else { return };
    let Some(now) = response.interact_pointer_pos().or_else(|| ui.input(|input| input.pointer.latest_pos())) else {
        return;
    };
    let area = Rect::from_two_pos(begun, now).intersect(plot);
    if response.drag_stopped() {
        memory.begun = None;
        if begun.distance(now) < DRAG {
            return;
        }
        let pairs = inside(area);
        cx.push(LibraryCommand::Brush((!pairs.is_empty()).then(|| Arc::new(pairs))));
    } else {
        ui.painter().rect_filled(area, 0.0, cx.p.accent.gamma_multiply(0.2));
        ui.painter().rect_stroke(area, 0.0, Stroke::new(1.0, cx.p.accent), StrokeKind::Inside);
    }
}

/// A tool's pairs with their values, in the unit of the screen.
type ToolValues<'a> = (&'a str, Vec<(PairId, f64)>);

/// One row for each tool: how its values of a score lie.
fn histograms(cx: &mut Cx<'_>, ui: &mut Ui, scores: &ScoreTable, axis: &Axis) {
    let Some(source) = scores.sources.iter().find(|source| source.name == axis.source) else { return };
    let state = cx.state;
    let metric = axis.metric;
    let tools: Vec<&str> = match state.library.open.as_ref().map(|open| &open.tools) {
        Some(tools) if !tools.is_empty() => tools.iter().map(String::as_str).collect(),
        _ => vec![""],
    };
    // All pairs, so that a brush made here can be moved: not only those it lists.
    let of = |tool: &str| {
        let pairs = (0u32..).map(PairId).zip(state.library.pairs());
        let pairs = pairs.filter(|(_, entry)| entry.tool.as_deref().unwrap_or("") == tool);
        let value = |(pair, _)| Some((pair, metric.shown(source.value(pair, metric)?)));
        pairs.filter_map(value).filter(|(_, v)| v.is_finite()).collect::<Vec<_>>()
    };
    let rows: Vec<ToolValues<'_>> = tools.iter().map(|tool| (*tool, of(tool))).filter(|(_, v)| !v.is_empty()).collect();
    let Some([low, high]) = range(rows.iter().flat_map(|(_, values)| values.iter().map(|(_, v)| *v))) else { return };
    let bar_of = |v: f64| (((v - low) / (high - low) * BARS as f64) as usize).min(BARS - 1);
    let unit = if metric.unit().is_empty() { String::new() } else { format!(" {}", metric.unit()) };
    let decimals = metric.decimals();
    let line = format!(
        "{} {}: {low:.decimals$} to {high:.decimals$}{unit}; line: mean, dot: median. A click on a bar lists its pairs",
        source.short(),
        metric.name()
    );
    ui.label(caption(line, cx.p));
    ui.spacing_mut().item_spacing.y = 2.0;
    let height = (ui.available_height() / rows.len().max(1) as f32 - 2.0).clamp(STRIP[0], STRIP[1]);
    ScrollArea::vertical().auto_shrink(false).id_salt("histograms").show(ui, |ui| {
        for (tool, values) in &rows {
            let mut bars: Vec<Vec<PairId>> = vec![Vec::new(); BARS];
            values.iter().for_each(|(pair, v)| bars[bar_of(*v)].push(*pair));
            let mut sorted: Vec<f64> = values.iter().map(|(_, v)| *v).collect();
            sorted.sort_by(f64::total_cmp);
            let middle = 0.5 * (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2]);
            let average = mean(sorted.iter().copied()).unwrap_or(middle);
            strip(cx, ui, height, tool, &bars, [average, middle].map(|v| ((v - low) / (high - low)) as f32), |bar| {
                let edge = |bar: usize| low + bar as f64 * (high - low) / BARS as f64;
                let n = bars[bar].len();
                format!(
                    "{tool}: {n} pairs at {:.decimals$} to {:.decimals$}{unit}\nmean {average:.decimals$}{unit}, median {middle:.decimals$}{unit} of {}",
                    edge(bar),
                    edge(bar + 1),
                    values.len()
                )
            });
        }
    });
}

/// The histogram of one tool; `marks`: where mean and median lie, 0..1.
fn strip(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    height: f32,
    tool: &str,
    bars: &[Vec<PairId>],
    marks: [f32; 2],
    said: impl FnOnce(usize) -> String,
) {
    let p = cx.p;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::click());
    let name = tool.strip_prefix("pattern_").unwrap_or(tool).replace('_', " ");
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Histogram of {name}")));
    let plot = Rect::from_min_max(rect.min + vec2(84.0, 2.0), rect.max - vec2(4.0, 2.0));
    let painter = ui.painter_at(rect);
    let font = FontId::proportional(SMALL);
    let wide = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), p.text).size().x;
    let name = cut_in_the_middle(&name, 78.0, wide);
    painter.text(pos2(rect.left() + 2.0, rect.center().y), Align2::LEFT_CENTER, name, font.clone(), p.text);
    painter.rect_filled(plot, 2.0, p.canvas);
    let most = bars.iter().map(Vec::len).max().unwrap_or(0).max(1) as f32;
    let width = plot.width() / bars.len() as f32;
    let hovered = response
        .hover_pos()
        .filter(|pointer| plot.contains(*pointer))
        .map(|pointer| ((pointer.x - plot.left()) / width) as usize);
    let brush = cx.state.library.brush.clone();
    for (index, pairs) in bars.iter().enumerate().filter(|(_, pairs)| !pairs.is_empty()) {
        let height = (plot.height() - 2.0) * pairs.len() as f32 / most;
        let left = plot.left() + index as f32 * width;
        let bar = Rect::from_min_max(pos2(left + 0.5, plot.bottom() - height), pos2(left + width - 0.5, plot.bottom()));
        let brushed = brush.as_ref().is_some_and(|brush| pairs.iter().all(|pair| brush.contains(pair)));
        let color = if brushed || hovered == Some(index) { p.accent } else { p.prediction.gamma_multiply(0.8) };
        painter.rect_filled(bar, 0.0, color);
    }
    let x = |share: f32| plot.left() + share * plot.width();
    painter.vline(x(marks[0]), plot.y_range(), Stroke::new(1.0, p.strong));
    painter.circle_filled(pos2(x(marks[1]), plot.top() + 4.0), 2.5, p.strong);
    let Some(bar) = hovered.filter(|bar| *bar < bars.len()) else { return };
    if response.clicked() {
        let pairs: BTreeSet<PairId> = bars[bar].iter().copied().collect();
        cx.push(LibraryCommand::Brush((!pairs.is_empty()).then(|| Arc::new(pairs))));
    }
    response.on_hover_text_at_pointer(said(bar));
}
