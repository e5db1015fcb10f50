//! One table of scores: a row for each method over all pairs, then a row for each pair by the method that is chosen.

use eframe::egui::{
    Align2, Color32, FontId, Rect, RichText, Role, ScrollArea, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2,
};

use super::browser::score_color;
use crate::app::action::Action;
use crate::app::command::{Command, LibraryCommand, Pane};
use crate::app::evaluate::{EvaluateCommand, ScoreChoice};
use crate::app::library::{Sort, short_name};
use crate::app::results;
use crate::app::scores::SourceScores;
use crate::app::tasks::TaskKind;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, medium};
use crate::ui::parts::widget::cut::cut_in_the_middle;
use crate::ui::parts::widget::empty;
use touch2touch_core::dataset::PairId;
use touch2touch_core::evaluation::{Column, Group, Metric, Row, TableMetrics, columns};

/// Height of a row, points.
const ROW: f32 = 20.0;
/// Widths of the columns of pair and tool, points; a method has both.
const NAMES: [f32; 2] = [90.0, 110.0];
/// The columns that are always shown, by their names in files.
const FEW: [&str; 7] =
    ["psnr_db", "psnr_noise_free_db", "ssim", "angle_deg", "success_5", "position_mm", "verdict_good"];

/// Choice of the columns.
#[derive(Default)]
pub(crate) struct Memory {
    /// True where all columns are shown.
    more: bool,
}

/// A row below the head.
enum Line<'a> {
    Group(Group),
    Method(&'a Row, &'a TableMetrics),
    Pair(PairId),
}

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, _: Pane) {
    choices(cx, ui, memory);
    let rows = cx.state.table.rows();
    let Some(result) = cx.state.table.result.clone() else {
        let (what, why) = match cx.state.tasks.of_kind(TaskKind::Evaluate) {
            Some(_) => ("The table appears when all pairs are scored", "Cancel keeps the scores so far"),
            None => ("No results yet", "PSNR, SSIM, angle error and verdict of every pair by each chosen generator"),
        };
        let action = Action::PredictAll.command(cx.state);
        let action = action.map(|_| (Action::PredictAll.name(), Action::PredictAll.tooltip()));
        if empty::show(ui, what, why, action) {
            cx.act(Action::PredictAll);
        }
        return;
    };
    ui.horizontal(|ui| {
        let about: Vec<&str> =
            std::iter::once(&*result.conventions).chain(result.notes.iter().map(String::as_str)).collect();
        ui.label(RichText::new(result.size()).color(cx.p.strong)).on_hover_text(about.join("\n"));
        if !result.complete {
            ui.label(RichText::new("stopped early").size(SMALL).color(cx.p.caution));
        }
    });
    let shown: Vec<&Column> =
        columns(&rows).into_iter().filter(|column| memory.more || FEW.contains(&column.key)).collect();
    head(cx, ui, &shown);
    let mut groups = result.groups.clone();
    groups.sort_unstable();
    let mut lines = Vec::new();
    for group in groups {
        lines.push(Line::Group(group));
        lines.extend(
            rows.iter().filter_map(|row| Some(Line::Method(row, row.groups.iter().find(|f| f.group == group)?))),
        );
    }
    lines.extend(cx.state.library.order.iter().copied().map(Line::Pair));
    ui.spacing_mut().item_spacing.y = 0.0;
    ScrollArea::vertical().auto_shrink(false).id_salt("results").show_rows(ui, ROW, lines.len(), |ui, range| {
        for line in &lines[range] {
            match line {
                Line::Group(group) => method_head(cx, ui, *group),
                Line::Method(row, figures) => method(cx, ui, row, figures, &shown),
                Line::Pair(pair) => pair_row(cx, ui, *pair, &shown),
            }
        }
    });
}

/// Choice of what is compared, and the buttons.
fn choices(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
        let bundles: Vec<_> = results::evaluated(cx.state).map(|(b, chosen)| (b.clone(), chosen)).collect();
        if bundles.is_empty() {
            ui.label(RichText::new("No generator found").color(cx.p.caution));
        }
        for (bundle, chosen) in bundles {
            let mut on = chosen;
            let tip = format!("Include this generator ({}), with its own steps and seed", bundle.origin);
            if ui.checkbox(&mut on, &bundle.name).on_hover_text(tip).changed() {
                cx.push(Command::Evaluate(EvaluateCommand::Choose(bundle.id.clone(), on)));
            }
        }
        match cx.state.tasks.of_kind(TaskKind::Evaluate) {
            Some((_, task)) => {
                let now = &task.progress;
                let text = match now.fraction() {
                    Some(_) => format!("{} of {} pairs   {}", now.done, now.total, now.text),
                    None => now.text.clone(),
                };
                cx.under_way(ui, task, &text);
            }
            // The empty table offers it large.
            None if cx.state.table.result.is_some() => _ = cx.action_button(ui, Action::PredictAll, "Predict all"),
            None => {}
        }
        if cx.state.table.result.is_none() {
            return;
        }
        let mut published = cx.state.table.published;
        let tip =
            "Adds the numbers published on real data, by the paper and the lab; not directly comparable with yours";
        if ui.checkbox(&mut published, "published rows").on_hover_text(tip).changed() {
            cx.push(Command::Evaluate(EvaluateCommand::Published(published)));
        }
        ui.checkbox(&mut memory.more, "more columns").on_hover_text("Shows every column that has numbers");
    });
}

/// Cells of pair, tool and figures.
fn cells(rect: Rect, numbers: usize) -> ([Rect; 2], Vec<Rect>) {
    let cell = |left: f32, width: f32| Rect::from_min_size(pos2(left, rect.top()), vec2(width, rect.height()));
    let [pair, tool] = NAMES;
    let start = rect.left() + pair + tool;
    let width = ((rect.right() - start) / numbers.max(1) as f32).max(0.0);
    let names = [cell(rect.left(), pair), cell(rect.left() + pair, tool)];
    (names, (0..numbers).map(|index| cell(start + index as f32 * width, width)).collect())
}

/// The names of the columns; a click sorts by one.
fn head(cx: &mut Cx<'_>, ui: &mut Ui, shown: &[&Column]) {
    let p = cx.p;
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    ui.painter().hline(rect.x_range(), rect.bottom(), (1.0, p.line));
    let (names, numbers) = cells(rect, shown.len());
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
    let by = cx.state.table.by().filter(|_| cx.state.library.sort == Sort::Score).map(|(_, metric)| metric);
    let chosen = cx.state.table.chosen.clone();
    for (column, cell) in shown.iter().zip(numbers) {
        let metric = column.metric();
        let sorted = metric.is_some() && by == metric;
        let sense = if metric.is_some() { Sense::click() } else { Sense::hover() };
        let response = ui.interact(cell, ui.scope_id().with(column.key), sense);
        let text = if metric == Some(Metric::Verdict) { "verdict" } else { column.heading };
        let name = metric.map_or(text.to_owned(), |metric| format!("Sort by {}", metric.name()));
        response.widget_info(|| WidgetInfo::labeled(Role::Button, metric.is_some(), &name));
        let color = if sorted || metric.is_some() && response.hovered() { p.strong } else { p.weak };
        let right = pos2(cell.right() - 14.0, cell.center().y);
        let place = ui.painter_at(cell).text(right, Align2::RIGHT_CENTER, text, font.clone(), color);
        if sorted {
            // Down: from bad to good.
            let c = pos2(place.right() + 7.0, cell.center().y);
            let s = if chosen.best_first { -1.0 } else { 1.0 };
            let points = vec![c + vec2(-3.0, -2.0 * s), c + vec2(3.0, -2.0 * s), c + vec2(0.0, 2.5 * s)];
            ui.painter().add(Shape::convex_polygon(points, color, Stroke::NONE));
        }
        let sorts = if metric.is_some() { ". Click to sort, worst first; click again to reverse" } else { "" };
        if response.on_hover_text(format!("{}{sorts}", column.tip)).clicked() {
            let best_first = sorted && !chosen.best_first;
            cx.push(LibraryCommand::SetScore(ScoreChoice { metric, best_first, ..chosen.clone() }));
        }
    }
}

fn method_head(cx: &Cx<'_>, ui: &mut Ui, group: Group) {
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    let left = pos2(rect.left() + 6.0, rect.center().y);
    ui.painter_at(rect).text(left, Align2::LEFT_CENTER, group.label(), FontId::new(SMALL, medium()), cx.p.weak);
}

/// A name in its cell, cut in the middle.
fn name(ui: &Ui, cell: Rect, text: &str, color: Color32) {
    let font = FontId::proportional(12.0);
    let width = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), color).size().x;
    let text = cut_in_the_middle(text, cell.width() - 10.0, width);
    let left = pos2(cell.left() + 6.0, cell.center().y);
    ui.painter_at(cell).text(left, Align2::LEFT_CENTER, text, font.clone(), color);
}

fn number(ui: &Ui, cell: Rect, text: &str, color: Color32) {
    let right = pos2(cell.right() - 14.0, cell.center().y);
    ui.painter_at(cell).text(right, Align2::RIGHT_CENTER, text, FontId::proportional(12.0), color);
}

/// A row that can be chosen: its place, and whether it was clicked.
fn row(cx: &Cx<'_>, ui: &mut Ui, label: &str, selected: bool, tip: &str) -> (Rect, bool) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, selected, label));
    ui.painter().rect_filled(rect, 3.0, cx.p.row(selected, response.hovered()));
    (rect, response.on_hover_text(tip).clicked())
}

/// The means of a method over the pairs of a group; a click has the pairs below show its scores.
fn method(cx: &mut Cx<'_>, ui: &mut Ui, of: &Row, figures: &TableMetrics, shown: &[&Column]) {
    let source = cx.state.table.scores.sources.iter().find(|source| *source.name == *of.method);
    let chosen = cx.state.table.by().is_some_and(|(by, _)| *by.name == *of.method);
    let label = format!("{}: {} grasps, {} images", of.method, figures.grasps, figures.images);
    let mut tip = label.clone();
    for (column, e) in shown.iter().filter_map(|c| Some((c, figures.get(c)?))) {
        if let Some([low, high]) = e.interval {
            tip += &format!("\n{} {:.3$} to {:.3$} (95 % CI)", column.heading, low, high, column.decimals);
        }
    }
    if figures.without_pose > 0 {
        tip += &format!("\n{} grasps without a pose", figures.without_pose);
    }
    tip += if of.published { "\nPublished, on real data" } else { "\nClick: the pairs below show its scores" };
    let next = source.map(|source| ScoreChoice { source: Some(source.name.clone()), ..cx.state.table.chosen.clone() });
    let (rect, clicked) = row(cx, ui, &label, chosen, &tip);
    if let Some(next) = next.filter(|_| clicked) {
        cx.push(LibraryCommand::SetScore(next));
    }
    let ([pair, tool], numbers) = cells(rect, shown.len());
    let color = match (of.upper_bound, of.published) {
        (true, _) => cx.p.truth,
        (_, true) => cx.p.weak,
        _ => cx.p.prediction,
    };
    name(ui, pair.union(tool), &of.method, color);
    for (column, cell) in shown.iter().zip(numbers) {
        let of_verdict = column.metric() == Some(Metric::Verdict);
        let (unit, decimals) = if of_verdict { (" % good", 0) } else { ("", column.decimals) };
        match figures.get(column) {
            Some(e) => number(ui, cell, &format!("{:.decimals$}{unit}", e.value), cx.p.strong),
            None => number(ui, cell, "–", cx.p.weak),
        }
    }
}

/// The scores of a pair.
fn pair_row(cx: &mut Cx<'_>, ui: &mut Ui, pair: PairId, shown: &[&Column]) {
    let Some(entry) = cx.state.library.entry(pair) else { return };
    let selected = cx.state.selection.pair == Some(pair);
    let (rect, clicked) =
        row(cx, ui, &format!("Row {}", entry.name), selected, &format!("{}. Click to show it", entry.name));
    let (names, numbers) = cells(rect, shown.len());
    let tool = entry.tool.as_deref().unwrap_or("");
    name(ui, names[0], short_name(entry), cx.p.strong);
    name(ui, names[1], &tool.strip_prefix("pattern_").unwrap_or(tool).replace('_', " "), cx.p.text);
    let source = cx.state.table.by().map(|(source, _)| source);
    for (column, cell) in shown.iter().zip(numbers) {
        match source.and_then(|source| figure(cx, source, pair, column)) {
            Some((text, color)) => number(ui, cell, &text, color),
            None => number(ui, cell, "–", cx.p.weak),
        }
    }
    if clicked {
        cx.push(LibraryCommand::Select(pair));
    }
}

/// A pair's figure in words, with its color.
fn figure(cx: &Cx<'_>, source: &SourceScores, pair: PairId, column: &Column) -> Option<(String, Color32)> {
    let grasp = source.grasp(pair)?;
    if let Some(metric) = column.metric() {
        let value = grasp.metric(metric)?;
        let text = match metric {
            Metric::Verdict => metric.text(value),
            _ if value.is_nan() => metric.text(value),
            _ => format!("{:.*}", metric.decimals(), metric.shown(value)),
        };
        return Some((text, score_color(cx.p, metric, value)));
    }
    let value = column.of_grasp(grasp)?;
    let text = match column.heading.ends_with('%') {
        true if value > 0.0 => "yes".to_owned(),
        true => "no".to_owned(),
        false => format!("{value:.*}", column.decimals),
    };
    Some((text, cx.p.text))
}
