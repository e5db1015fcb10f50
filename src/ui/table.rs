//! The figures of all pairs that were generated or aligned so far, worst first.

use eframe::egui::{self, Align2, Color32, FontId, RichText, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2};

use super::browser::review_color;
use super::cx::Cx;
use super::scene::error_color;
use super::theme::{Palette, SMALL, caption};
use super::widget::empty;
use crate::app::action::Action;
use crate::app::command::{LibraryCommand, Pane, ViewCommand};
use crate::app::labels::Review;
use crate::app::metrics::PairMetrics;
use crate::app::state::State;
use crate::domain::dataset::PairId;
use crate::domain::rig::PadId;
use crate::domain::units;

/// Height of a row, points.
const ROW: f32 = 24.0;

/// The columns: heading, share of the width, whether it is a number, tooltip.
const COLUMNS: [(&str, f32, bool, &str); 8] = [
    ("Pair", 1.6, false, "Name of the pair"),
    ("Tool", 1.9, false, "Tool of the pair"),
    ("Finger", 0.7, false, "Which finger's prediction"),
    ("PSNR dB", 0.8, true, "Prediction against truth; peak 22.5 mm, or both scaled to 0..1 where the scale is assumed"),
    ("SSIM", 0.7, true, "Structural similarity; range 22.5 mm, or both scaled to 0..1 where the scale is assumed"),
    ("Error mm", 0.8, true, "Mean absolute error of the prediction, millimeters"),
    ("Angle° meas.", 1.0, true, "Angle error of the pose from the measured imprint, degrees"),
    ("Angle° pred.", 1.0, true, "Angle error of the pose from the predicted imprint, degrees"),
];

struct Row {
    pair: PairId,
    name: String,
    tool: String,
    finger: Option<PadId>,
    review: Review,
    numbers: [Option<f64>; 5],
    /// Whether the poses were set by hand.
    by_hand: [bool; 2],
}

/// The order of the rows.
pub(super) struct Memory {
    /// The column sorted by, and whether downwards.
    sort: (usize, bool),
}

impl Default for Memory {
    fn default() -> Self {
        Self { sort: (4, false) }
    }
}

/// The pane.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, _: Pane) {
    super::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        let mut rows = rows(cx.state);
        if rows.is_empty() {
            let action = Action::Generate.command(cx.state).map(|_| ("Generate (Ctrl+G)", Action::Generate.tooltip()));
            if empty::show(
                ui,
                "No metrics yet",
                "Pairs appear here once they were generated or aligned, the worst first",
                action,
            ) {
                cx.act(Action::Generate);
            }
            return;
        }
        let (column, down) = memory.sort;
        sort(&mut rows, column, down);
        summary(cx, ui, &rows);
        header(cx.p, ui, memory);
        ui.spacing_mut().item_spacing.y = 0.0;
        let n = rows.len();
        ScrollArea::vertical().auto_shrink(false).id_salt("table").show_rows(ui, ROW, n, |ui, range| {
            for row in rows.get(range).unwrap_or_default() {
                row_ui(cx, ui, row);
            }
        });
    });
}

/// The rows, in the order of the results.
fn rows(state: &State) -> Vec<Row> {
    let row = |f: &PairMetrics<'_>| {
        let entry = state.library.entry(f.pair)?;
        let [measured, predicted] = f.poses.map(|pose| pose.error_rad.map(f64::to_degrees));
        let c = f.comparison;
        Some(Row {
            pair: f.pair,
            name: entry.name.rsplit('/').next().unwrap_or(&entry.name).to_owned(),
            tool: entry.tool.as_deref().unwrap_or("").trim_start_matches("pattern_").replace('_', " "),
            finger: f.finger,
            review: state.document.review(&entry.name),
            numbers: [
                c.and_then(|c| c.psnr_db),
                c.and_then(|c| c.ssim),
                c.map(|c| units::mm(c.mae_m)),
                measured,
                predicted,
            ],
            by_hand: f.poses.map(|pose| pose.by_hand),
        })
    };
    state.metrics_so_far().iter().filter_map(row).collect()
}

/// Sorts by a column; rows without a number come last either way.
fn sort(rows: &mut [Row], column: usize, down: bool) {
    rows.sort_by(|a, b| {
        let order = match column {
            0 => a.pair.cmp(&b.pair),
            1 => a.tool.cmp(&b.tool).then(a.pair.cmp(&b.pair)),
            2 => a.finger.cmp(&b.finger).then(a.pair.cmp(&b.pair)),
            c => match (a.numbers[c - 3], b.numbers[c - 3]) {
                (Some(x), Some(y)) => x.total_cmp(&y),
                (Some(_), None) => return std::cmp::Ordering::Less,
                (None, Some(_)) => return std::cmp::Ordering::Greater,
                (None, None) => a.pair.cmp(&b.pair),
            },
        };
        if down { order.reverse() } else { order }
    });
}

fn summary(cx: &Cx<'_>, ui: &mut Ui, rows: &[Row]) {
    let mean = |i: usize| {
        let values: Vec<f64> = rows.iter().filter_map(|r| r.numbers[i]).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    let text = |name: &str, v: Option<f64>, decimals: usize| v.map(|v| format!("{name} {v:.decimals$}"));
    let parts: Vec<String> = [
        Some(format!("{} rows so far", rows.len())),
        text("mean PSNR", mean(0), 1),
        text("SSIM", mean(1), 3),
        text("error mm", mean(2), 2),
        text("angle° measured", mean(3), 1),
        text("predicted", mean(4), 1),
    ]
    .into_iter()
    .flatten()
    .collect();
    let note = super::images::scale_note(cx.state);
    ui.horizontal(|ui| {
        ui.label(caption(parts.join("   "), cx.p));
        if !note.is_empty() {
            ui.label(RichText::new(note).size(SMALL).color(cx.p.caution));
        }
    });
}

/// Left end and width of each column.
fn columns(left: f32, width: f32) -> [(f32, f32); 8] {
    let total: f32 = COLUMNS.iter().map(|c| c.1).sum();
    let mut x = left;
    COLUMNS.map(|(_, share, _, _)| {
        let w = (width - 20.0) * share / total;
        let start = x;
        x += w;
        (start, w)
    })
}

fn header(p: &Palette, ui: &mut Ui, memory: &mut Memory) {
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    ui.painter().hline(rect.x_range(), rect.bottom(), (1.0, p.line));
    let (column, down) = memory.sort;
    for (i, ((name, _, number, tip), (x, w))) in COLUMNS.iter().zip(columns(rect.left(), rect.width())).enumerate() {
        let cell = egui::Rect::from_min_size(pos2(x, rect.top()), vec2(w, ROW));
        let response = ui.interact(cell, ui.scope_id().with(("column", i)), Sense::click());
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Sort by {name}")));
        let color = if i == column || response.hovered() { p.strong } else { p.weak };
        let font = FontId::new(SMALL, super::theme::medium());
        let (at, anchor) = if *number {
            (pos2(cell.right() - 14.0, cell.center().y), Align2::RIGHT_CENTER)
        } else {
            (pos2(cell.left() + 6.0, cell.center().y), Align2::LEFT_CENTER)
        };
        let place = ui.painter_at(cell).text(at, anchor, name, font, color);
        if i == column {
            let c = pos2(place.right() + 7.0, cell.center().y);
            let s = if down { 1.0 } else { -1.0 };
            let points = vec![c + vec2(-3.0, -2.0 * s), c + vec2(3.0, -2.0 * s), c + vec2(0.0, 2.5 * s)];
            ui.painter().add(egui::Shape::convex_polygon(points, color, egui::Stroke::NONE));
        }
        if response.on_hover_text(format!("{tip}. Click to sort; again to turn round")).clicked() {
            // Worst first: small PSNR and SSIM, large errors.
            memory.sort = if i == column { (i, !down) } else { (i, i >= 5) };
        }
    }
}

fn row_ui(cx: &mut Cx<'_>, ui: &mut Ui, row: &Row) {
    let p = cx.p;
    let selected =
        cx.state.selection.pair == Some(row.pair) && row.finger.is_none_or(|f| f == cx.state.selection.finger);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, selected, format!("Row {}", row.name)));
    let fill = if selected {
        p.selected
    } else if response.hovered() {
        p.control[0]
    } else {
        Color32::TRANSPARENT
    };
    ui.painter().rect_filled(rect, 3.0, fill);
    let finger = row.finger.map_or("both".into(), |finger| cx.state.finger_name(finger));
    for (i, (x, w)) in columns(rect.left(), rect.width()).into_iter().enumerate() {
        let cell = egui::Rect::from_min_size(pos2(x, rect.top()), vec2(w, ROW));
        let painter = ui.painter_at(cell);
        let text = |text: &str, color: Color32| {
            painter.text(
                pos2(cell.left() + 6.0, cell.center().y),
                Align2::LEFT_CENTER,
                text,
                FontId::proportional(12.0),
                color,
            )
        };
        match i {
            0 => text(&row.name, p.strong),
            1 => text(&row.tool, p.text),
            2 => text(&finger, p.text),
            i => {
                let v = row.numbers[i - 3];
                let decimals = [1, 3, 2, 1, 1][i - 3];
                let (text, color) = match v {
                    Some(v) if i >= 6 => {
                        let hand = if row.by_hand[i - 6] { "by hand " } else { "" };
                        (format!("{hand}{v:.decimals$}"), error_color(p, v.to_radians()))
                    }
                    Some(v) => (format!("{v:.decimals$}"), p.strong),
                    None => ("–".to_owned(), p.weak),
                };
                painter.text(
                    pos2(cell.right() - 14.0, cell.center().y),
                    Align2::RIGHT_CENTER,
                    text,
                    FontId::proportional(12.0),
                    color,
                )
            }
        };
    }
    ui.painter().circle_filled(pos2(rect.right() - 10.0, rect.center().y), 3.5, review_color(p, row.review));
    if response.on_hover_text("Show this pair").clicked() {
        cx.push(LibraryCommand::Select(row.pair));
        if let Some(finger) = row.finger {
            cx.push(ViewCommand::SelectFinger(finger));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_without_a_number_come_last_either_way() {
        let row = |pair: u32, v: Option<f64>| Row {
            pair: PairId(pair),
            name: String::new(),
            tool: String::new(),
            finger: None,
            review: Review::Todo,
            numbers: [v, None, None, None, None],
            by_hand: [false; 2],
        };
        for down in [false, true] {
            let mut rows = vec![row(0, None), row(1, Some(2.0)), row(2, Some(1.0))];
            sort(&mut rows, 3, down);
            let order: Vec<u32> = rows.iter().map(|r| r.pair.0).collect();
            assert_eq!(order, if down { [1, 2, 0] } else { [2, 1, 0] });
        }
    }
}
