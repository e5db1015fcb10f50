//! Progress of the labeling, and the work that the masks took.

use eframe::egui::{self, Align2, Color32, FontId, Rect, RichText, Role, Sense, Ui, WidgetInfo, vec2};
use strum::IntoEnumIterator as _;

use super::super::browser::review_color;
use crate::app::labels::Review;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, section};
use crate::ui::parts::widget::cut::cut_in_the_middle;
use touch2touch_work::label_stats::{Counts, Effort, LabelStats};

/// Height of a tool's row, points.
const ROW: f32 = 18.0;
/// Height of the bar under its text.
const BAR: f32 = 4.0;
/// Pairs drawn twice that are listed.
const LISTED: usize = 12;

pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.add_space(2.0);
    ui.label(section("Progress", cx.p));
    let Some(stats) = cx.state.document.stats.clone() else {
        ui.label(caption("Counting…", cx.p));
        return;
    };
    counts(cx, ui, "all pairs", &stats.all);
    let tool = cx.state.entry().and_then(|entry| entry.tool.clone());
    if stats.tools.len() > 1 {
        if let Some(own) = stats.tools.iter().find(|of| of.tool == tool) {
            counts(cx, ui, name(tool.as_deref()), &own.pairs);
        }
        let all = egui::CollapsingHeader::new(RichText::new(format!("All {} tools", stats.tools.len())).size(SMALL));
        all.id_salt("tools").show(ui, |ui| {
            for of in &stats.tools {
                counts(cx, ui, name(of.tool.as_deref()), &of.pairs);
            }
        });
    }
    if stats.effort.masks > 0 {
        let line = egui::Label::new(RichText::new(took(stats.effort)).size(SMALL).color(cx.p.text)).wrap();
        let tip = "From the journals: time from the first change of a pair to the last, without pauses over a minute; \
                   changes that were taken back are not counted off";
        ui.add(line).on_hover_text(tip);
        let sources = egui::CollapsingHeader::new(RichText::new("By source").size(SMALL));
        sources.id_salt("sources").show(ui, |ui| {
            for (source, effort) in &stats.sources {
                let text = RichText::new(format!("from {source}: {}", took(*effort))).size(SMALL);
                ui.add(egui::Label::new(text).wrap());
            }
            for (deed, count) in &stats.deeds {
                ui.label(caption(format!("{count} × {deed}"), cx.p));
            }
        });
    }
    repeats(cx, ui, &stats);
    if !stats.problems.is_empty() {
        let text = RichText::new(format!("{} journals or masks cannot be read", stats.problems.len()));
        ui.label(text.size(SMALL).color(cx.p.caution)).on_hover_text(stats.problems.join("\n"));
    }
}

fn name(tool: Option<&str>) -> &str {
    tool.map_or("no tool", |tool| tool.strip_prefix("pattern_").unwrap_or(tool))
}

/// `12 masks, 23.1 s and 4.0 edits each`.
fn took(effort: Effort) -> String {
    let (Some(seconds), Some(edits)) = (effort.seconds_per_mask(), effort.edits_per_mask()) else {
        return "no mask".into();
    };
    let masks = if effort.masks == 1 { "mask" } else { "masks" };
    format!("{} {masks}, {seconds:.1} s and {edits:.1} edits each", effort.masks)
}

/// A name, how many pairs are finished, and a bar of all review states.
fn counts(cx: &Cx<'_>, ui: &mut Ui, name: &str, counts: &Counts) {
    let p = cx.p;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width() - 4.0, ROW), Sense::hover());
    let total = counts.total();
    let done = counts.of(Review::Done);
    let said: Vec<String> = Review::iter().map(|review| format!("{} {}", counts.of(review), review.name())).collect();
    let said = format!("{name}: {}", said.join(", "));
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &said));
    let painter = ui.painter_at(rect);
    let font = FontId::proportional(SMALL);
    let number = format!("{done} of {total} done");
    let right = painter.text(rect.right_top(), Align2::RIGHT_TOP, number, font.clone(), p.weak).left();
    let width = |text: &str| painter.layout_no_wrap(text.to_owned(), font.clone(), p.text).size().x;
    let shown = cut_in_the_middle(name, right - rect.left() - 8.0, width);
    painter.text(rect.left_top(), Align2::LEFT_TOP, shown, font.clone(), p.text);
    let bar = Rect::from_min_max(egui::pos2(rect.left(), rect.bottom() - BAR), rect.max);
    painter.rect_filled(bar, 2.0, p.control[0]);
    let mut left = bar.left();
    // What is to be done is the empty part of the bar.
    for review in [Review::Done, Review::Skip, Review::Flagged, Review::InProgress] {
        let wide = bar.width() * counts.of(review) as f32 / total.max(1) as f32;
        let color: Color32 = review_color(p, review);
        painter.rect_filled(Rect::from_min_size(egui::pos2(left, bar.top()), vec2(wide, BAR)), 0.0, color);
        left += wide;
    }
    response.on_hover_text(said);
}

/// Masks that were drawn twice, the worst first.
fn repeats(cx: &Cx<'_>, ui: &mut Ui, stats: &LabelStats) {
    let masks = &stats.repeats.masks;
    if masks.is_empty() {
        return;
    }
    let mean = masks.iter().map(|repeat| repeat.compared.agreement.dice).sum::<f64>() / masks.len() as f64;
    let title = format!("Drawn twice: {} masks, Dice {mean:.3}", masks.len());
    egui::CollapsingHeader::new(RichText::new(title).size(SMALL)).id_salt("repeats").show(ui, |ui| {
        for repeat in masks.iter().take(LISTED) {
            let (compared, [first, second]) = (&repeat.compared, repeat.seconds);
            let a = &compared.agreement;
            let edge = a.edge_mm.map_or_else(|| "no edge".to_owned(), |mm| format!("edges {mm:.2} mm"));
            let text = format!("Dice {:.3}, IoU {:.3}, {edge}; {first} s, then {second} s", a.dice, a.iou);
            let tip = format!("{}, {} finger: your first mask against your second", compared.pair, compared.finger);
            ui.add(egui::Label::new(RichText::new(text).size(SMALL)).wrap()).on_hover_text(tip);
        }
        if masks.len() > LISTED {
            ui.label(caption(format!("and {} that agree better", masks.len() - LISTED), cx.p));
        }
    });
}
