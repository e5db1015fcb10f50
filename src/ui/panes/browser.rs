//! The list of pairs: source, filter, sort, thumbnails, review states.

use eframe::egui::{
    self, Align2, Color32, CornerRadius, FontId, Rect, RichText, Role, ScrollArea, Sense, Stroke, TextureId, Ui,
    WidgetInfo, pos2, vec2,
};
use strum::IntoEnumIterator as _;

use super::scene::error_color;
use crate::app::action::Action;
use crate::app::command::{Command, LibraryCommand, Pane};
use crate::app::evaluate::ScoreChoice;
use crate::app::labels::Review;
use crate::app::library::{Sort, short_name};
use crate::app::results;
use crate::app::tasks::TaskKind;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{Palette, SMALL, caption, grade_color};
use crate::ui::parts::widget::choice::choose;
use crate::ui::parts::widget::cut::cut_in_the_middle;
use crate::ui::parts::widget::empty;
use crate::ui::parts::widget::texture::depth_image;
use touch2touch_core::dataset::PairId;
use touch2touch_core::evaluation::Metric;
use touch2touch_core::units::counted;
use touch2touch_core::verdict::Grade;

/// Height of a row, points.
const ROW: f32 = 40.0;
/// Width of a thumbnail, points.
const THUMB: f32 = 44.0;

/// The color of a review state.
pub(crate) fn review_color(p: &Palette, review: Review) -> Color32 {
    match review {
        Review::Todo => p.weak,
        Review::InProgress => p.caution,
        Review::Flagged => p.wrong,
        Review::Done => p.good,
        Review::Skip => p.line,
    }
}

/// The filter being typed, and where the list was scrolled to.
#[derive(Default)]
pub(crate) struct Memory {
    /// The filter being typed.
    filter: String,
    /// True where the filter wants the keyboard.
    pub focus_filter: bool,
    /// The row that the list was last scrolled to; `None` where the list is a new one.
    pub scrolled_to: Option<Option<usize>>,
}

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, _: Pane) {
    title(cx, ui);
    filter_row(cx, ui, memory);
    ui.add_space(2.0);
    list(cx, ui, memory);
}

/// Title of what is open.
fn title(cx: &Cx<'_>, ui: &mut Ui) {
    let library = &cx.state.library;
    let title = match (&library.opening, &library.open) {
        (Some(place), _) => format!("Opening {place}…"),
        (None, Some(open)) => open.source.dataset.title.clone(),
        (None, None) => return,
    };
    let label = egui::Label::new(RichText::new(&title).color(cx.p.strong)).truncate();
    ui.add(label)
        .on_hover_text(format!("{title}. Use Open for others and for a summary of this one, or drop a folder here"));
}

fn filter_row(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory) {
    /// Narrower than this the order stands below the filter.
    const BESIDE: f32 = 60.0;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let (sort_width, full) = (74.0, ui.available_width());
        let beside = full - sort_width - 12.0;
        let width = if beside < BESIDE { full - 8.0 } else { beside };
        let edit = egui::TextEdit::singleline(&mut memory.filter).hint_text("Filter").desired_width(width);
        let response = ui.add(edit).accessible_name("Filter pairs");
        if std::mem::take(&mut memory.focus_filter) {
            response.request_focus();
        }
        if response.changed() {
            cx.out.push(Command::Library(LibraryCommand::SetFilter(memory.filter.clone())));
        } else if !response.has_focus() && memory.filter != cx.state.library.filter {
            memory.filter.clone_from(&cx.state.library.filter);
        }
        let tip = "Words of the name, the tool or the note. tool:rod narrows to tools, note:edge to notes, has:note to pairs \
             with one; is:todo, is:in-progress, is:flagged, is:done and \
             is:skip to review states; angle>5, verdict=wrong, psnr<20, ssim<0.8 to scores (of the source chosen, \
             or measured:angle>2) in °, dB and %";
        response.on_hover_text(Action::FindPair.behind(tip));
        let sort = cx.state.library.sort;
        let combo = egui::ComboBox::from_id_salt("sort").width(sort_width).selected_text(sort.name());
        let said = |s: &Sort| (s.name(), "");
        if let Some(sort) = choose(ui, combo, ("Sort", "Order of the list"), Some(&sort), Sort::iter(), said) {
            cx.push(LibraryCommand::SetSort(sort));
        }
    });
    score_row(cx, ui);
    if let Some(open) = &cx.state.library.open
        && open.tools.len() > 1
    {
        let chosen = cx.state.library.tool.clone();
        let text = chosen.clone().unwrap_or_else(|| format!("All {} tools", open.tools.len()));
        let combo = egui::ComboBox::from_id_salt("tool").width(ui.available_width()).selected_text(text).truncate();
        let all = std::iter::once(None).chain(open.tools.iter().map(|tool| Some(tool.as_str())));
        let name = ("Tool", "Only pairs of one tool");
        let asked = choose(ui, combo, name, Some(&chosen.as_deref()), all, |tool| (tool.unwrap_or("All tools"), ""));
        if let Some(tool) = asked {
            cx.push(LibraryCommand::SetToolFilter(tool.map(str::to_owned)));
        }
    }
}

/// By which score the list is ordered, colored and filtered; nothing while there are no scores.
fn score_row(cx: &mut Cx<'_>, ui: &mut Ui) {
    let table = &cx.state.table;
    let Some((by, metric)) = table.by() else { return };
    let (chosen, sorted) = (table.chosen.clone(), cx.state.library.sort == Sort::Score);
    let mut next = None;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let direction = 80.0;
        let width = ui.available_width() - direction - 8.0;
        let combo = egui::ComboBox::from_id_salt("score").width(width).selected_text(metric.name());
        let tip = format!("Score to show, sort and filter by, of {}; Results chooses another source", by.short());
        let said = |f: &Metric| (f.name(), f.tip());
        if let Some(f) = choose(ui, combo, ("Score", &tip), Some(&metric), by.metrics(), said) {
            next = Some(ScoreChoice { metric: Some(f), ..chosen.clone() });
        }
        let text = if chosen.best_first { "Best first" } else { "Worst first" };
        let button = egui::Button::new(RichText::new(text).size(SMALL)).selected(sorted);
        let tip = "Sorts by the score; click again to reverse. N shows the next worst pair";
        if ui.add_sized([direction, 18.0], button).accessible_name("Order of the scores").on_hover_text(tip).clicked() {
            // The first click sorts, the next ones turn round.
            next = Some(ScoreChoice { best_first: sorted && !chosen.best_first, ..chosen.clone() });
        }
    });
    if let Some(next) = next {
        cx.push(LibraryCommand::SetScore(next));
    }
}

fn list(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory) {
    let library = &cx.state.library;
    let total = library.pairs().len();
    let shown = library.order.len();
    let done =
        library.open.as_ref().map_or(0, |_| cx.state.document.reviews.values().filter(|r| r.is_finished()).count());
    ui.horizontal(|ui| {
        let count = if shown == total { counted(total, "pair") } else { format!("{shown} of {total} pairs") };
        ui.label(caption(count, cx.p));
        if done > 0 {
            ui.label(RichText::new(format!("{done} done")).size(SMALL).color(cx.p.good));
        }
        let problems = library.open.as_ref().map_or(0, |o| o.source.problems.len());
        if problems > 0 {
            let text = RichText::new(counted(problems, "problem")).size(SMALL).color(cx.p.caution);
            ui.label(text).on_hover_ui(|ui| {
                if let Some(open) = &cx.state.library.open {
                    for problem in open.source.problems.iter().take(12) {
                        ui.label(format!("{}: {}", problem.file.display(), problem.what));
                        ui.label(caption(problem.hint.as_str(), cx.p));
                    }
                }
            });
        }
    });
    scoring(cx, ui);
    if let Some(failure) = &library.failure {
        ui.label(RichText::new(failure.to_string()).color(cx.p.wrong).size(SMALL));
    }
    if shown == 0 {
        if library.opening.is_some() {
            ui.label(caption("Reading the index…", cx.p));
        } else if library.open.is_none() {
            let action = Some(("Open the demo", Action::OpenDemo.tooltip()));
            if empty::show(ui, "Nothing is open", "Drop a folder here", action) {
                cx.act(Action::OpenDemo);
            }
        } else if empty::show(ui, "No pair matches the filter", "", Some(("Clear the filter", "Shows all pairs"))) {
            cx.push(LibraryCommand::SetFilter(String::new()));
            cx.push(LibraryCommand::SetToolFilter(None));
        }
        return;
    }
    let selected_row = cx.state.selection.pair.and_then(|p| library.row_of(p));
    let spacing = 2.0;
    ui.spacing_mut().item_spacing.y = spacing;
    let mut area = ScrollArea::vertical().auto_shrink(false).id_salt("pairs");
    // A step by key may leave the visible rows: follow it, once.
    if Some(selected_row) != memory.scrolled_to {
        let fresh = memory.scrolled_to.is_none();
        memory.scrolled_to = Some(selected_row);
        if let Some(row) = selected_row {
            let rows = &library.rows;
            let height = ui.available_height();
            if fresh || !(rows.start < row && row + 2 < rows.end) {
                let offset = row as f32 * (ROW + spacing) - height * 0.5 + ROW * 0.5;
                area = area.vertical_scroll_offset(offset.max(0.0));
            }
        }
    }
    let output = area.show_rows(ui, ROW, shown, |ui, range| {
        for row in range.clone() {
            if let Some(id) = cx.state.library.order.get(row).copied() {
                row_ui(cx, ui, id, Some(row) == selected_row);
            }
        }
        range
    });
    if output.inner != cx.state.library.rows {
        cx.push(LibraryCommand::ShowRows(output.inner));
    }
}

/// The button that scores all pairs, or how far that is; the bar at the bottom of the window stops it.
fn scoring(cx: &mut Cx<'_>, ui: &mut Ui) {
    let total = cx.state.library.pairs().len();
    let scored = cx.state.table.by().map_or(0, |(source, _)| source.scored);
    // The table of all scores has its own.
    if cx.state.selection.panes.contains(&Pane::Results) {
        return;
    }
    ui.horizontal_wrapped(|ui| match cx.state.tasks.of_kind(TaskKind::Evaluate) {
        Some((_, task)) => {
            let text = format!("scoring {} of {}", task.progress.done, task.progress.total);
            ui.label(RichText::new(text).size(SMALL).color(cx.p.accent));
        }
        None if scored < total && Action::PredictAll.command(cx.state).is_some() => {
            cx.action_button(ui, Action::PredictAll, "Predict all");
            ui.add(egui::Label::new(caption(format!("{scored} of {total} scored"), cx.p)).extend());
        }
        None => {}
    });
}

/// The color of a score, where its size means something on its own: of an angle's error and of a verdict.
pub(crate) fn score_color(p: &Palette, metric: Metric, value: f64) -> Color32 {
    match metric {
        Metric::Angle if value.is_nan() => p.wrong,
        Metric::Angle => error_color(p, value),
        Metric::Verdict => {
            Grade::iter().find(|grade| f64::from(*grade as u8) == value).map_or(p.text, |grade| grade_color(p, grade))
        }
        _ => p.text,
    }
}

fn row_ui(cx: &mut Cx<'_>, ui: &mut Ui, id: PairId, selected: bool) {
    let Some(entry) = cx.state.library.entry(id) else { return };
    let p = cx.p;
    let review = cx.state.document.review(&entry.name);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    response.widget_info(|| {
        WidgetInfo::selected(Role::Button, true, selected, format!("{}, {}", entry.name, review.name()))
    });
    if ui.is_rect_visible(rect) {
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 4.0, p.row(selected, response.hovered()));
        if selected {
            let mark = Rect::from_min_size(rect.min, vec2(3.0, ROW));
            painter.rect_filled(mark, CornerRadius { nw: 4, sw: 4, ne: 0, se: 0 }, p.accent);
        }
        let thumb = Rect::from_min_size(rect.min + vec2(6.0, 2.5), vec2(THUMB, ROW - 5.0));
        match thumbnail(cx, ui, id) {
            Some(texture) => {
                let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                painter.image(texture, thumb, uv, Color32::WHITE);
            }
            None => {
                painter.rect_filled(thumb, 2.0, p.canvas);
            }
        }
        let left = thumb.right() + 8.0;
        let dot = pos2(rect.right() - 10.0, rect.center().y);
        let color = review_color(p, review);
        if review == Review::Todo {
            painter.circle_stroke(dot, 3.5, Stroke::new(1.25, color));
        } else {
            painter.circle_filled(dot, 4.0, color);
        }
        let noted = !cx.state.document.note(&entry.name).is_empty();
        if noted {
            note_mark(&painter, pos2(rect.right() - 10.0, rect.top() + 9.0), p.caution);
        }
        let mut right = rect.right() - 18.0;
        if let Some((text, color)) = figure_text(cx, id) {
            let end = pos2(right, rect.bottom() - 5.0);
            right = painter.text(end, Align2::RIGHT_BOTTOM, text, FontId::proportional(SMALL), color).left() - 4.0;
        }
        let clip = Rect::from_min_max(pos2(left, rect.top()), pos2(right, rect.bottom()));
        let text = ui.painter_at(clip);
        let name = short_name(entry);
        let (font, color) = (FontId::proportional(13.0), if selected { p.strong } else { p.text });
        let width = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), color).size().x;
        let name = cut_in_the_middle(name, rect.right() - 18.0 - left, width);
        text.text(pos2(left, rect.top() + 5.0), Align2::LEFT_TOP, name, font.clone(), color);
        let tool = entry.tool.as_deref().unwrap_or("no tool");
        let tool = tool.strip_prefix("pattern_").unwrap_or(tool).replace('_', " ");
        let font = FontId::proportional(SMALL);
        let width = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), p.weak).size().x;
        let tool = cut_in_the_middle(&tool, right - left, width);
        text.text(pos2(left, rect.bottom() - 5.0), Align2::LEFT_BOTTOM, tool, font.clone(), p.weak);
    }
    let mut tip = format!("{}\n{}", entry.name, review.name());
    let note = cx.state.document.note(&entry.name);
    if !note.is_empty() {
        tip += &format!("\nNote: {note}");
    }
    if response.on_hover_text(tip).clicked() {
        cx.push(LibraryCommand::Select(id));
    }
}

/// A sheet with lines: the pair has a note.
fn note_mark(painter: &egui::Painter, center: egui::Pos2, color: Color32) {
    let (sheet, stroke) = (Rect::from_center_size(center, vec2(7.0, 8.0)), Stroke::new(1.0, color));
    painter.rect_stroke(sheet, 1.0, stroke, egui::StrokeKind::Inside);
    for y in [-1.0, 1.0] {
        painter.hline(center.x - 2.0..=center.x + 2.0, center.y + y, stroke);
    }
}

/// The score of a pair that the list is about.
fn figure_text(cx: &Cx<'_>, pair: PairId) -> Option<(String, Color32)> {
    let table = &cx.state.table;
    let (source, metric) = table.by()?;
    let value = source.value(pair, metric)?;
    Some((metric.text(value), score_color(cx.p, metric, value)))
}

/// The picture of a pair's measured imprint, if it is there.
fn thumbnail(cx: &mut Cx<'_>, ui: &Ui, id: PairId) -> Option<TextureId> {
    let open = cx.state.library.open.as_ref()?;
    let key = open.key(id);
    // Without a measured imprint it is empty, and the device takes no empty picture: the whole window would stay black.
    let depth = results::thumbnail(cx.state, id).filter(|depth| !depth.is_empty())?;
    let range = super::images::range_of(cx.state);
    let bits = (range.lo.to_bits(), range.hi.to_bits());
    let map = super::images::map_of(cx.state);
    let make = || (depth_image(depth, map, range), None);
    let picture = cx.shared.textures.get(ui.ctx(), ("thumbnail", key), (bits, map), false, make);
    Some(picture.texture.id())
}
