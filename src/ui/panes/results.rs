//! The paper's results table of the open data set: what is compared, how far it is, and the figures.

use eframe::egui::{
    self, Align2, Color32, FontId, Rect, RichText, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2,
};

use crate::app::action::Action;
use crate::app::command::{Command, Pane};
use crate::app::evaluate::{EvaluateCommand, GRASPS};
use crate::app::results;
use crate::app::tasks::TaskKind;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, medium, section};
use crate::ui::parts::widget::empty;
use touch2touch_core::evaluation::{Column, Group, Row, TableMetrics, columns};

/// Height of a row, points.
const ROW: f32 = 20.0;
/// Share of the width that the method's name takes, in letters.
const NAME: f32 = 30.0;

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    crate::ui::parts::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        choices(cx, ui);
        ui.separator();
        let rows = cx.state.table.rows();
        if rows.is_empty() {
            let (what, why) = match cx.state.tasks.of_kind(TaskKind::Evaluate) {
                Some(_) => ("The table appears when all grasps are scored", "Cancel keeps the scores so far"),
                None => (
                    "No results yet",
                    "The paper's table: PSNR, SSIM, angle error and success rate of each chosen generator",
                ),
            };
            let action = Action::EvaluateDataset.command(cx.state);
            let action = action.map(|_| (Action::EvaluateDataset.name(), Action::EvaluateDataset.tooltip()));
            if empty::show(ui, what, why, action) {
                cx.act(Action::EvaluateDataset);
            }
            return;
        }
        table(cx, ui, &rows);
    });
}

/// Choice of what is compared, and the buttons.
fn choices(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
        let bundles: Vec<_> = results::evaluated(cx.state).map(|(b, chosen)| (b.clone(), chosen)).collect();
        if bundles.is_empty() {
            ui.label(RichText::new("No generator found").color(cx.p.caution));
        }
        for (bundle, chosen) in bundles {
            let mut on = chosen;
            let tip = format!("Include this generator ({})", bundle.origin);
            if ui.checkbox(&mut on, &bundle.name).on_hover_text(tip).changed() {
                cx.push(Command::Evaluate(EvaluateCommand::Choose(bundle.id.clone(), on)));
            }
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.label(caption("Grasps to use per tool", cx.p));
        let name = |n: Option<usize>| n.map_or_else(|| "all".to_owned(), |n| n.to_string());
        let now = cx.state.table.grasps_per_tool;
        let combo = egui::ComboBox::from_id_salt("grasps").width(48.0).selected_text(name(now));
        let response = combo.show_ui(ui, |ui| {
            for n in GRASPS {
                if ui.selectable_label(n == now, name(n)).clicked() {
                    cx.push(Command::Evaluate(EvaluateCommand::Grasps(n)));
                }
            }
        });
        let tip = "Spread evenly over the grasps of each tool. Default: all; a few give a quick look. Each generator uses its own default steps and seed; `evaluate --steps N --seed N` sets the same for all";
        response.response.accessible_name("Grasps per tool").on_hover_text(tip);
        let mut published = cx.state.table.published;
        let tip =
            "Adds the numbers published on real data, by the paper and the lab; not directly comparable with yours";
        if ui.checkbox(&mut published, "published rows").on_hover_text(tip).changed() {
            cx.push(Command::Evaluate(EvaluateCommand::Published(published)));
        }
        match cx.state.tasks.of_kind(TaskKind::Evaluate) {
            Some((_, task)) => {
                let now = &task.progress;
                let text = match now.fraction() {
                    Some(_) => format!("{} of {} grasps   {}", now.done, now.total, now.text),
                    None => now.text.clone(),
                };
                cx.under_way(ui, task, &text);
            }
            None => {
                // The empty table offers it large; an export is in the pane's menu.
                if cx.state.table.result.is_some() {
                    cx.action_button(ui, Action::EvaluateDataset, "Evaluate");
                }
            }
        }
    });
}

/// The column groups, one below the other.
fn table(cx: &Cx<'_>, ui: &mut Ui, rows: &[Row]) {
    let Some(result) = &cx.state.table.result else { return };
    let all = columns(rows);
    ui.label(RichText::new(result.size()).color(cx.p.strong));
    ScrollArea::vertical().auto_shrink(false).id_salt("results").show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        let mut groups: Vec<Group> = result.groups.clone();
        groups.sort_unstable();
        for group in groups {
            let figures: Vec<(&Row, &TableMetrics)> =
                rows.iter().filter_map(|r| Some((r, r.groups.iter().find(|f| f.group == group)?))).collect();
            heading(cx, ui, group, &all);
            let best = Best::of(&all, &figures);
            for (row, figures) in figures {
                line(cx, ui, row, figures, &all, &best);
            }
            ui.add_space(10.0);
        }
        ui.spacing_mut().item_spacing.y = 2.0;
        let mut notes = vec![result.conventions.to_owned()];
        notes.extend(result.notes.iter().cloned());
        if !result.complete {
            ui.label(RichText::new("Stopped early: not all grasps are scored").size(SMALL).color(cx.p.caution));
        }
        for note in notes {
            ui.add(egui::Label::new(caption(note, cx.p)).wrap());
        }
    });
}

/// Cells of the method's name and of the figures, the number of grasps first: as wide as their headings ask for.
fn cells(rect: Rect, shown: &[&Column]) -> (Rect, Vec<Rect>) {
    let letters = |text: &str| text.chars().count().max(6) as f32 + 1.0;
    let shares: Vec<f32> = std::iter::once("grasps").chain(shown.iter().map(|c| c.heading)).map(letters).collect();
    let unit = rect.width() / (NAME + shares.iter().sum::<f32>());
    let name = Rect::from_min_size(rect.min, vec2(unit * NAME, rect.height()));
    let mut left = name.right();
    let mut number = |share: f32| {
        let cell = Rect::from_min_size(pos2(left, rect.top()), vec2(unit * share, rect.height()));
        left = cell.right();
        cell
    };
    (name, shares.into_iter().map(&mut number).collect())
}

fn heading(cx: &Cx<'_>, ui: &mut Ui, group: Group, shown: &[&Column]) {
    ui.label(section(group.label(), cx.p));
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    ui.painter().hline(rect.x_range(), rect.bottom(), (1.0, cx.p.line));
    let (name, numbers) = cells(rect, shown);
    let font = FontId::new(SMALL, medium());
    let left = pos2(name.left() + 4.0, name.center().y);
    ui.painter_at(name).text(left, Align2::LEFT_CENTER, "Method", font.clone(), cx.p.weak);
    let grasps = ("grasps", "Grasps that were scored");
    let texts = std::iter::once(grasps).chain(shown.iter().map(|c| (c.heading, c.tip)));
    for (column, ((text, tip), cell)) in texts.zip(numbers).enumerate() {
        let right = pos2(cell.right() - 6.0, cell.center().y);
        ui.painter_at(cell).text(right, Align2::RIGHT_CENTER, text, font.clone(), cx.p.weak);
        ui.interact(cell, ui.scope_id().with((group.label(), column)), Sense::hover()).on_hover_text(tip);
    }
}

/// The best computed figure of each column, to be seen at a glance; the upper bound and published rows do not compete.
struct Best(Vec<Option<f64>>);

impl Best {
    fn of(shown: &[&Column], figures: &[(&Row, &TableMetrics)]) -> Self {
        let of = |column: &&Column| {
            let values: Vec<f64> = figures
                .iter()
                .filter(|(row, _)| competes(row))
                .filter_map(|(_, f)| Some(f.get(column)?.value))
                .collect();
            let pick = if column.larger_is_better { f64::max } else { f64::min };
            (values.len() > 1).then(|| values.into_iter().reduce(pick)).flatten()
        };
        Self(shown.iter().map(of).collect())
    }
}

fn competes(row: &Row) -> bool {
    !row.published && !row.upper_bound
}

fn line(cx: &Cx<'_>, ui: &mut Ui, row: &Row, figures: &TableMetrics, shown: &[&Column], best: &Best) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    if response.hovered() {
        ui.painter().rect_filled(rect, 3.0, cx.p.control[0]);
    }
    let (name, numbers) = cells(rect, shown);
    let color = match (row.upper_bound, row.published) {
        (true, _) => cx.p.truth,
        (_, true) => cx.p.weak,
        _ => cx.p.prediction,
    };
    let font = FontId::proportional(12.0);
    let left = pos2(name.left() + 4.0, name.center().y);
    let galley = ui.painter().layout_job(egui::text::LayoutJob {
        wrap: egui::text::TextWrapping::truncate_at_width(name.width() - 8.0),
        ..egui::text::LayoutJob::single_section(row.method.clone(), egui::TextFormat::simple(font.clone(), color))
    });
    let top = left - vec2(0.0, 0.5 * galley.size().y);
    ui.painter().galley(top, galley, color);
    let put = |cell: Rect, text: &str, color: Color32| {
        let right = pos2(cell.right() - 6.0, cell.center().y);
        ui.painter_at(cell).text(right, Align2::RIGHT_CENTER, text, font.clone(), color);
    };
    put(numbers[0], &figures.grasps.to_string(), cx.p.weak);
    for ((column, cell), best) in shown.iter().zip(&numbers[1..]).zip(&best.0) {
        let Some(e) = figures.get(column) else {
            put(*cell, "–", cx.p.weak);
            continue;
        };
        let is_best = competes(row) && best.is_some_and(|b| b == e.value);
        let color = match (row.published, is_best) {
            (true, _) => cx.p.weak,
            (false, true) => cx.p.good,
            (false, false) => cx.p.strong,
        };
        put(*cell, &format!("{:.1$}", e.value, column.decimals), color);
    }
    let mut said = format!("{}: {} grasps, {} images", row.method, figures.grasps, figures.images);
    for (column, e) in shown.iter().filter_map(|c| Some((c, figures.get(c)?))) {
        let decimals = column.decimals;
        said += &format!("\n{} {:.decimals$}", column.heading, e.value);
        if let Some([low, high]) = e.interval {
            said += &format!("   (95 % CI {low:.decimals$} to {high:.decimals$})");
        }
    }
    if figures.without_pose > 0 {
        said += &format!("\n{} grasps without a pose", figures.without_pose);
    }
    if row.published {
        said += "\nPublished, on real data";
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Row, true, said.lines().next().unwrap_or_default()));
    response.on_hover_text(said);
}
