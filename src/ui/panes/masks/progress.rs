//! Progress of the labeling.

use eframe::egui::{self, Align2, Color32, FontId, Rect, RichText, Role, Sense, Ui, WidgetInfo, vec2};
use strum::IntoEnumIterator as _;

use super::super::browser::review_color;
use crate::app::labels::Review;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, section};
use crate::ui::parts::widget::cut::cut_in_the_middle;
use touch2touch_pipeline::labels::progress::Counts;

/// Height of a tool's row, points.
const ROW: f32 = 18.0;
/// Height of the bar under its text.
const BAR: f32 = 4.0;

pub(super) fn show(cx: &Cx<'_>, ui: &mut Ui) {
    ui.add_space(2.0);
    ui.label(section("Progress", cx.p));
    let progress = &cx.state.document.progress;
    counts(cx, ui, "all pairs", &progress.all);
    let tool = cx.state.entry().and_then(|entry| entry.tool.clone());
    if progress.tools.len() > 1 {
        if let Some(own) = progress.tools.iter().find(|of| of.tool == tool) {
            counts(cx, ui, name(tool.as_deref()), &own.pairs);
        }
        let all = egui::CollapsingHeader::new(RichText::new(format!("All {} tools", progress.tools.len())).size(SMALL));
        all.id_salt("tools").show(ui, |ui| {
            for of in &progress.tools {
                counts(cx, ui, name(of.tool.as_deref()), &of.pairs);
            }
        });
    }
}

fn name(tool: Option<&str>) -> &str {
    tool.map_or("no tool", |tool| tool.strip_prefix("pattern_").unwrap_or(tool))
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
