//! The scores of all pairs by every source, in the order of the list.

use eframe::egui::{
    self, Align2, Color32, FontId, Rect, RichText, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2,
};

use super::browser::{predict_all, review_color, score_color};
use crate::app::action::Action;
use crate::app::command::{LibraryCommand, Pane};
use crate::app::evaluate::ScoreChoice;
use crate::app::library::{Sort, short_name};
use crate::app::scores::SourceScores;
use crate::app::tasks::TaskKind;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, medium};
use crate::ui::parts::widget::cut::cut_in_the_middle;
use crate::ui::parts::widget::empty;
use strum::IntoEnumIterator as _;
use touch2touch_core::dataset::PairId;
use touch2touch_core::evaluation::{Metric, mean};
use touch2touch_core::verdict::Grade;

/// Height of a row, points.
const ROW: f32 = 24.0;
/// Height of the head, which has two lines.
const HEAD: f32 = 36.0;
/// Widths of the columns of names, points.
const NAMES: [f32; 2] = [90.0, 110.0];
/// The least width of a number's column, points: what finds no room is left out.
const NUMBER: f32 = 62.0;
/// Nothing is kept between frames: the order is the list's.
pub(crate) type Memory = ();

/// A column of numbers.
type ScoreColumn<'a> = (&'a SourceScores, Metric);

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    crate::ui::parts::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        let table = &cx.state.table;
        let total = cx.state.library.pairs().len();
        let scored = table.scores.sources.iter().map(|source| source.scored).min().unwrap_or(0);
        let empty = table.scores.sources.is_empty() && cx.state.tasks.of_kind(TaskKind::Evaluate).is_none();
        if !empty && (scored < total || cx.state.tasks.of_kind(TaskKind::Evaluate).is_some()) {
            predict_all(cx, ui, scored);
        }
        if table.scores.sources.is_empty() {
            if cx.state.tasks.of_kind(TaskKind::Evaluate).is_none() {
                let action = Action::PredictAll.command(cx.state);
                let action = action.map(|_| ("Predict all", Action::PredictAll.tooltip()));
                let why = "One row per pair: scores of the measured imprint and of each chosen generator";
                if empty::show(ui, "No scores yet", why, action) {
                    cx.act(Action::PredictAll);
                }
            }
            return;
        }
        let columns = columns(&table.scores.sources, ui.available_width());
        let note = super::images::scale_note(cx.state);
        if !note.is_empty() {
            ui.label(RichText::new(note).size(SMALL).color(cx.p.caution));
        }
        head(cx, ui, &columns);
        means(cx, ui, &columns);
        ui.spacing_mut().item_spacing.y = 0.0;
        let n = cx.state.library.order.len();
        ScrollArea::vertical().auto_shrink(false).id_salt("table").show_rows(ui, ROW, n, |ui, range| {
            for row in range {
                if let Some(pair) = cx.state.library.order.get(row).copied() {
                    row_ui(cx, ui, pair, &columns);
                }
            }
        });
    });
}

/// The columns that there is room for, each source's together: the most telling metrics of all sources first.
fn columns(sources: &[SourceScores], width: f32) -> Vec<ScoreColumn<'_>> {
    let room = ((width - NAMES.iter().sum::<f32>() - 20.0) / NUMBER).max(1.0) as usize;
    let telling = Metric::iter().flat_map(|metric| sources.iter().map(move |source| (source, metric)));
    let taken: Vec<ScoreColumn<'_>> = telling.filter(|(source, metric)| source.has(*metric)).take(room).collect();
    let of = |source: &SourceScores| {
        let name = source.name.clone();
        taken.iter().copied().filter(move |(taken, _)| taken.name == name).collect::<Vec<_>>()
    };
    sources.iter().flat_map(of).collect()
}

/// Cells of the names and of the numbers.
fn cells(rect: Rect, numbers: usize) -> ([Rect; 2], Vec<Rect>) {
    let cell = |left: f32, width: f32| Rect::from_min_size(pos2(left, rect.top()), vec2(width, rect.height()));
    let [pair, tool] = NAMES;
    let start = rect.left() + pair + tool;
    let width = (rect.right() - 20.0 - start) / numbers.max(1) as f32;
    let names = [cell(rect.left(), pair), cell(rect.left() + pair, tool)];
    (names, (0..numbers).map(|index| cell(start + index as f32 * width, width)).collect())
}

fn head(cx: &mut Cx<'_>, ui: &mut Ui, columns: &[ScoreColumn<'_>]) {
    let p = cx.p;
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), HEAD), Sense::hover());
    ui.painter().hline(rect.x_range(), rect.bottom(), (1.0, p.line));
    let lower = Rect::from_min_max(pos2(rect.left(), rect.center().y), rect.max);
    let (names, numbers) = cells(lower, columns.len());
    let font = FontId::new(SMALL, medium());
    for (cell, (name, sort)) in names.iter().zip([("Pair", Sort::Natural), ("Tool", Sort::Tool)]) {
        let response = ui.interact(*cell, ui.scope_id().with(name), Sense::click());
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Sort by {name}")));
        let color = if cx.state.library.sort == sort || response.hovered() { p.strong } else { p.weak };
        let left = pos2(cell.left() + 6.0, cell.center().y);
        ui.painter_at(*cell).text(left, Align2::LEFT_CENTER, name, font.clone(), color);
        if response.on_hover_text("Sorts the list").clicked() {
            cx.push(LibraryCommand::SetSort(sort));
        }
    }
    let by = cx.state.table.by().filter(|_| cx.state.library.sort == Sort::Score);
    let best_first = cx.state.table.chosen.best_first;
    let mut above: Option<(&SourceScores, Rect)> = None;
    for ((source, metric), cell) in columns.iter().zip(numbers) {
        above = match above {
            Some((before, place)) if before.name == source.name => Some((before, place.union(cell))),
            before => {
                source_name(cx, ui, before, rect);
                Some((source, cell))
            }
        };
        let sorted = by.is_some_and(|(s, f)| s.name == source.name && f == *metric);
        let response = ui.interact(cell, ui.scope_id().with((&source.name, metric)), Sense::click());
        let name = format!("Sort by {} of {}", metric.name(), source.short());
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
        let color = if sorted || response.hovered() { p.strong } else { p.weak };
        let text = match metric.unit() {
            "" => metric.short().to_owned(),
            unit => format!("{} {unit}", metric.short()),
        };
        let right = pos2(cell.right() - 14.0, cell.center().y);
        let place = ui.painter_at(cell).text(right, Align2::RIGHT_CENTER, text, font.clone(), color);
        if sorted {
            // Down: from bad to good.
            let c = pos2(place.right() + 7.0, cell.center().y);
            let s = if best_first { -1.0 } else { 1.0 };
            let points = vec![c + vec2(-3.0, -2.0 * s), c + vec2(3.0, -2.0 * s), c + vec2(0.0, 2.5 * s)];
            ui.painter().add(egui::Shape::convex_polygon(points, color, egui::Stroke::NONE));
        }
        let tip = format!(
            "{}: {}\n{}. Click to sort, worst first; click again to reverse",
            source.name,
            metric.name(),
            metric.tip()
        );
        if response.on_hover_text(tip).clicked() {
            cx.push(LibraryCommand::SetScore(ScoreChoice {
                source: Some(source.name.clone()),
                metric: Some(*metric),
                best_first: sorted && !best_first,
            }));
        }
    }
    source_name(cx, ui, above, rect);
}

/// The name of a source above its columns.
fn source_name(cx: &Cx<'_>, ui: &Ui, source: Option<(&SourceScores, Rect)>, rect: Rect) {
    let Some((source, place)) = source else { return };
    let color = if source.upper_bound { cx.p.truth } else { cx.p.prediction };
    let font = FontId::new(SMALL, medium());
    let width = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), color).size().x;
    let name = cut_in_the_middle(&source.name, place.width() - 16.0, width);
    let right = pos2(place.right() - 14.0, rect.top() + 0.25 * rect.height());
    ui.painter().text(right, Align2::RIGHT_CENTER, name, font.clone(), color);
}

/// The means over the pairs of the list.
fn means(cx: &Cx<'_>, ui: &mut Ui, columns: &[ScoreColumn<'_>]) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    ui.painter().hline(rect.x_range(), rect.bottom(), (1.0, cx.p.line));
    let (names, numbers) = cells(rect, columns.len());
    let order = &cx.state.library.order;
    let left = pos2(names[0].left() + 6.0, rect.center().y);
    let scored = |pair: &&PairId| columns.iter().any(|(source, metric)| source.value(**pair, *metric).is_some());
    let what = format!("mean of {}", order.iter().filter(scored).count());
    ui.painter().text(left, Align2::LEFT_CENTER, what, FontId::proportional(SMALL), cx.p.weak);
    for ((source, metric), cell) in columns.iter().zip(numbers) {
        let values = order.iter().filter_map(|pair| source.value(*pair, *metric)).filter(|v| v.is_finite());
        let text = match metric {
            // Of words, the share of the best: a cell has room for a number.
            Metric::Verdict => mean(values.map(|value| f64::from(u8::from(value == f64::from(Grade::Good as u8)))))
                .map(|share| format!("{:.0} %", 100.0 * share)),
            metric => mean(values).map(|mean| number(*metric, mean)),
        };
        let text = text.unwrap_or_else(|| "–".to_owned());
        put(ui, cell, &text, cx.p.strong);
    }
    response.on_hover_text(
        "Means over the scored pairs of the list; for verdicts the share of good ones; grasps without a pose are \
         left out of those of the angle",
    );
}

/// A value without its unit, which the heading says.
fn number(metric: Metric, value: f64) -> String {
    if value.is_nan() || metric == Metric::Verdict {
        metric.text(value)
    } else {
        format!("{:.*}", metric.decimals(), metric.shown(value))
    }
}

fn put(ui: &Ui, cell: Rect, text: &str, color: Color32) {
    let right = pos2(cell.right() - 14.0, cell.center().y);
    ui.painter_at(cell).text(right, Align2::RIGHT_CENTER, text, FontId::proportional(12.0), color);
}

fn row_ui(cx: &mut Cx<'_>, ui: &mut Ui, pair: PairId, columns: &[ScoreColumn<'_>]) {
    let p = cx.p;
    let Some(entry) = cx.state.library.entry(pair) else { return };
    let selected = cx.state.selection.pair == Some(pair);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, selected, format!("Row {}", entry.name)));
    let fill = if selected {
        p.selected
    } else if response.hovered() {
        p.control[0]
    } else {
        Color32::TRANSPARENT
    };
    ui.painter().rect_filled(rect, 3.0, fill);
    let (names, numbers) = cells(rect, columns.len());
    let tool = entry.tool.as_deref().unwrap_or("");
    let tool = tool.strip_prefix("pattern_").unwrap_or(tool).replace('_', " ");
    let font = FontId::proportional(12.0);
    for (cell, text, color) in [(names[0], short_name(entry), p.strong), (names[1], &tool, p.text)] {
        let width = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), color).size().x;
        let text = cut_in_the_middle(text, cell.width() - 10.0, width);
        let left = pos2(cell.left() + 6.0, cell.center().y);
        ui.painter_at(cell).text(left, Align2::LEFT_CENTER, text, font.clone(), color);
    }
    for ((source, metric), cell) in columns.iter().zip(numbers) {
        match source.value(pair, *metric) {
            Some(value) => put(ui, cell, &number(*metric, value), score_color(p, source, *metric, value)),
            None => put(ui, cell, "–", p.weak),
        }
    }
    let review = cx.state.document.review(&entry.name);
    ui.painter().circle_filled(pos2(rect.right() - 10.0, rect.center().y), 3.5, review_color(p, review));
    if response.on_hover_text(format!("{}, {}. Click to show it", entry.name, review.name())).clicked() {
        cx.push(LibraryCommand::Select(pair));
    }
}
