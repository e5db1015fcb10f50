//! The image panes: GelSlim, measured and predicted imprint. Linked pan, zoom and cross-hair.

pub(crate) mod bar;
mod link;
mod paint;

use std::hash::Hash;
use std::sync::Arc;

use eframe::egui::{Align2, Button, Color32, ComboBox, FontId, Rect, RichText, Ui, UiBuilder, Vec2, pos2, vec2};
use strum::IntoEnumIterator as _;

use crate::app::action::Action;
use crate::app::command::{Hover, LabelsCommand, LibraryCommand, Pane, TasksCommand, ViewCommand};
use crate::app::keys::{ImprintSource, Preview};
use crate::app::{recipe, results};
use crate::ui::parts::cx::{Cx, side_color};
use crate::ui::parts::pen::{self, Easel};
use crate::ui::parts::theme::{Palette, SMALL};
use crate::ui::parts::widget::choice::choose;
use crate::ui::parts::widget::colorbar;
use crate::ui::parts::widget::empty;
use crate::ui::parts::widget::image_canvas::{CanvasMap, CanvasOutput, ImageCanvas, Primary, shows_squares};
use crate::ui::parts::widget::texture::{Histogram, Memo, depth_image, picture_image};

use crate::app::settings::{ColorMap as MapChoice, GelView, MaskTool, prefer};
use crate::app::state::{Absent, Lookup, State};
use link::Link;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::picture;
use touch2touch_core::rig::{PadId, Sensor, SensorKind};
use touch2touch_core::sample::Scale;
use touch2touch_core::turn::Turn;
use touch2touch_core::units;
use touch2touch_pipeline::error::{TaskError, UnitOffer};
use touch2touch_pipeline::steps::bundles::BundleKind;

/// Stroke on the images, and outlines of masks.
#[derive(Default)]
pub(crate) struct Memory {
    /// The stroke that the pointer is drawing: its pane and finger.
    painting: Option<(Pane, PadId)>,
    /// Outlines of masks.
    outlines: Memo<Vec<[[f32; 2]; 2]>>,
}

impl Memory {
    /// Follows the pen no further; whether it was drawing.
    pub(crate) fn lift_pen(&mut self) -> bool {
        self.painting.take().is_some()
    }
}

/// The shared range of imprints, meters.
pub(crate) fn range_of(state: &State) -> Range {
    Range { lo: state.settings.range.min_m, hi: state.settings.range.max_m }
}

/// The color map of imprints.
pub(crate) fn map_of(state: &State) -> ColorMap {
    match state.settings.color_map {
        MapChoice::Viridis => ColorMap::Viridis,
        MapChoice::Gray => ColorMap::Gray,
    }
}

/// Remark at every millimeter of this sample; empty where lengths are measured.
pub(crate) fn scale_note(state: &State) -> &'static str {
    match results::sample(state).ready().map(|s| s.scale) {
        Some(Scale::Assumed) => "assumed scale",
        _ => "",
    }
}

/// [`scale_note`], and how the files' pictures lie if they had to be laid upright.
fn source_note(state: &State) -> String {
    let reading = results::sample(state).ready().and_then(|s| s.reading);
    let laid = reading.filter(|read| read.turn != Turn::default() || !read.is_sure()).map(|read| {
        let sure = if read.is_sure() { "" } else { " (not sure)" };
        format!("file {}, shown upright{sure}", read.turn)
    });
    let fitted = recipe::bundle(state, BundleKind::Generator)
        .ok()
        .and_then(|bundle| bundle.misgiving(results::sample(state).ready()?));
    let fitted = fitted.map(|_| "model fitted to other data".to_owned());
    [scale_note(state).to_owned(), laid.unwrap_or_default(), fitted.unwrap_or_default()]
        .into_iter()
        .filter(|s| !s.is_empty())
        .collect::<Vec<_>>()
        .join(" · ")
}

/// The stored size of a kind of picture, for a place where there is none yet.
fn usual_size(cx: &Cx<'_>, kind: SensorKind) -> [usize; 2] {
    let rig = cx.state.rig();
    rig.first(kind).and_then(|id| rig.sensor(id)).map_or([4, 3], Sensor::size)
}

/// The pane of one kind of image, for every finger on screen.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, pane: Pane) {
    let bar = pane != Pane::GelSlim;
    if !bar {
        choose_gel(cx, ui);
    }
    let full = ui.available_rect_before_wrap();
    ui.advance_cursor_after_rect(full);
    let bottom = if bar { full.bottom() - colorbar::HEIGHT } else { full.bottom() };
    let area = Rect::from_min_max(full.min, pos2(full.right(), bottom.max(full.top() + 16.0)));
    // In the order of the rig, whichever is active: images must not swap places when the finger is switched.
    let shown = cx.state.fingers();
    let fingers: Vec<PadId> = cx.state.rig().pads().filter(|f| shown.contains(f)).collect();
    let beside = area.width() >= area.height();
    let n = fingers.len() as f32;
    let mut histogram = None;
    for (i, finger) in fingers.iter().enumerate() {
        let i = i as f32;
        let step = if beside { vec2(area.width() / n, 0.0) } else { vec2(0.0, area.height() / n) };
        let gap = if n > 1.0 { step.normalized() } else { Vec2::ZERO };
        let size = if beside { vec2(step.x, area.height()) } else { vec2(area.width(), step.y) };
        let rect = Rect::from_min_size(area.min + step * i, size - gap);
        let active = n > 1.0 && *finger == cx.state.selection.finger;
        let mut child = ui.new_child(UiBuilder::new().max_rect(rect).id_salt((pane, *finger)));
        child.set_clip_rect(rect.intersect(ui.clip_rect()));
        let drawn = finger_image(cx, &mut child, memory, pane, *finger);
        if histogram.is_none() || active {
            histogram = drawn.or(histogram);
        }
        if active {
            ui.painter().hline(rect.x_range(), rect.top() + 1.0, (2.0, cx.p.accent));
        }
    }
    if bar {
        let rect = Rect::from_min_max(pos2(full.left(), area.bottom()), full.max);
        ui.painter().rect_filled(rect, 0.0, cx.p.panel);
        let mut child = ui.new_child(UiBuilder::new().max_rect(rect.shrink2(vec2(6.0, 0.0))).id_salt((pane, "bar")));
        bar::color_bar(cx, &mut child, histogram.as_ref());
        if let Some(histogram) = &histogram {
            bar::offer_range(cx, ui, area, histogram);
        }
    }
}

/// One picture. Returns its histogram, where it has values.
fn finger_image(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, pane: Pane, finger: PadId) -> Option<Histogram> {
    let state = cx.state;
    match pane {
        Pane::GelSlim => {
            let gelslim = results::gelslim(state, finger);
            let image: Lookup<'_, RgbGrid> = match state.settings.gel {
                GelView::Difference => gelslim.and_then(Absent::NoGelSlim, |g| Some(&g.difference)),
                GelView::Raw => gelslim.and_then(Absent::OnlyDifference, |g| g.images.as_ref().map(|i| &i.raw)),
                GelView::Reference => {
                    gelslim.and_then(Absent::OnlyDifference, |g| g.images.as_ref().map(|i| &i.reference))
                }
            };
            gel_image(cx, ui, pane, finger, image);
            None
        }
        Pane::Predicted => match results::preview(state, finger) {
            Some(preview) => preview_image(cx, ui, finger, preview),
            None => match results::predicted_color(state, finger) {
                Some(picture) => {
                    gel_image(cx, ui, pane, finger, picture);
                    None
                }
                None => {
                    depth_pane(cx, ui, memory, pane, finger, results::imprint(state, ImprintSource::Predicted, finger))
                }
            },
        },
        _ => depth_pane(cx, ui, memory, pane, finger, results::imprint(state, ImprintSource::Measured, finger)),
    }
}

/// Choice of the GelSlim image.
fn choose_gel(cx: &mut Cx<'_>, ui: &mut Ui) {
    let now = cx.state.settings.gel;
    ui.horizontal(|ui| {
        ui.set_height(24.0);
        ui.add_space(4.0);
        let combo = ComboBox::from_id_salt("gel").width(0.0).selected_text(RichText::new(now.name()).size(SMALL));
        let (name, said) = (("GelSlim image", now.tooltip()), |view: &GelView| (view.name(), view.tooltip()));
        if let Some(view) = choose(ui, combo, name, Some(&now), GelView::iter(), said) {
            cx.push(prefer(move |s| s.gel = view));
        }
    });
}

/// Placeholder for a picture: the one before, dimmed, while the next is on its way; else a sentence.
pub(crate) fn placeholder<T: ?Sized>(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    slot: (Pane, PadId),
    lookup: Lookup<'_, T>,
    size: [usize; 2],
) {
    match lookup {
        Lookup::Ready(_) | Lookup::Stale(_) | Lookup::Waiting => {
            let rect = ui.available_rect_before_wrap();
            ui.painter().rect_filled(rect, 0.0, cx.p.canvas);
            if let Some(picture) = cx.shared.textures.last(slot) {
                let gel = slot.0 == Pane::GelSlim;
                let view = if gel { cx.shared.views.gel } else { cx.shared.views.bubble };
                let map = CanvasMap::new(rect, size, view, gel && cx.state.rig().turned());
                ui.painter_at(rect).image(picture.texture.id(), map.image_rect, map.uv(), Color32::from_gray(110));
            }
            let font = FontId::proportional(12.0);
            ui.painter_at(rect).text(rect.center(), Align2::CENTER_CENTER, "Loading…", font, cx.p.weak);
        }
        Lookup::Failed(err) => failed(cx, ui, err),
        Lookup::Absent(absent) => absent_text(cx, ui, absent),
    }
}

/// A failure in words, with the way to try again.
pub(crate) fn failed(cx: &mut Cx<'_>, ui: &mut Ui, err: &TaskError) {
    let why = match &err.hint {
        Some(hint) => format!("{}\n{hint}", err.why),
        None => err.why.clone(),
    };
    let again = Action::RunPose.behind("Computes it again");
    if empty::show(ui, &format!("{} failed", err.what), &why, Some(("Try again", &again))) {
        cx.push(TasksCommand::Retry);
    }
}

/// Buttons that read a CAD file in the units that fit it, where that is what failed; `place` tells them apart.
pub(crate) fn unit_buttons(cx: &mut Cx<'_>, ui: &mut Ui, offer: &UnitOffer, place: &str) {
    for (unit, length) in &offer.units {
        let says = offer.says.as_ref().map_or(String::new(), |says| format!(", which now says {says}"));
        let tip = format!(
            "Makes {} {length} long. Writes unit.txt beside the STL{says}; it holds for all models of that folder",
            offer.tool
        );
        let button = Button::new(RichText::new(format!("Read it as {}", unit.name())).size(SMALL));
        let button = ui.add(button.min_size(vec2(0.0, 16.0)));
        let name = format!("Read {} as {}, {place}", offer.tool, unit.name());
        if button.accessible_name(name).on_hover_text(tip).clicked() {
            let (tool, replacing) = (offer.tool.clone(), offer.says.clone());
            cx.push(LibraryCommand::ReadToolAs { tool, unit: *unit, replacing });
        }
    }
}

/// Sentence that says what is missing, and the action that brings it.
pub(crate) fn absent_text(cx: &mut Cx<'_>, ui: &mut Ui, absent: Absent) {
    // A prediction on its way shows how far it is, where it will appear.
    if absent == Absent::NoPrediction
        && let Some((_, task)) = cx.state.tasks.any_generating()
    {
        let (fraction, text) = (task.progress.fraction(), task.progress.text.clone());
        let rect = ui.available_rect_before_wrap();
        ui.painter().rect_filled(rect, 0.0, cx.p.canvas);
        let width = (rect.width() - 32.0).clamp(40.0, 220.0);
        let inner = Rect::from_center_size(rect.center(), vec2(width, 40.0));
        ui.scope_builder(UiBuilder::new().max_rect(inner), |ui| {
            ui.label(crate::ui::parts::theme::caption("Generating", cx.p));
            crate::ui::parts::widget::progress::bar(ui, width, fraction, &text);
        });
        ui.advance_cursor_after_rect(rect);
        return;
    }
    let what = absent.text();
    let button = absent.action().filter(|a| a.command(cx.state).is_some());
    let why = match absent {
        Absent::NoPrediction if button.is_none() => results::can_generate(cx.state).err().map_or("", |why| why.text()),
        Absent::NoGenerator => "Choose a model in Generate, or put one into assets/models.",
        _ => "",
    };
    let text = button.map(|a: Action| (a.behind(a.name()), a));
    let shown = text.as_ref().map(|(text, a)| (text.as_str(), a.tooltip()));
    if empty::show(ui, what, why, shown)
        && let Some((_, action)) = text
    {
        cx.act(action);
    }
}

/// The canvas of a picture of `size` pixels, moved together with all others of its sensor.
pub(crate) fn canvas(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    sensor: SensorKind,
    label: &str,
    size: [usize; 2],
    primary: Primary,
) -> CanvasOutput {
    let color = sensor == SensorKind::Color;
    let rotated = color && cx.state.rig().turned();
    let view = if color { &mut cx.shared.views.gel } else { &mut cx.shared.views.bubble };
    ImageCanvas { label, size, rotated, primary, background: cx.p.canvas }.show(ui, view)
}

/// Paints an imprint in the colors of all; its histogram. It is made again where its recipe changes.
pub(crate) fn paint_depth(
    cx: &mut Cx<'_>,
    ui: &Ui,
    output: &CanvasOutput,
    (slot, recipe): (impl Hash, impl Hash),
    depth: &DepthMap,
    tint: Color32,
) -> Option<Histogram> {
    let squares = shows_squares(&output.map, ui.pixels_per_point());
    let (map, range) = (map_of(cx.state), range_of(cx.state));
    let key = (recipe, map, range.lo.to_bits(), range.hi.to_bits());
    let make = || (depth_image(depth, map, range), Histogram::of(depth.as_slice()));
    let picture = cx.shared.textures.get(ui.ctx(), slot, key, squares, make);
    output.paint(picture.texture.id(), tint);
    picture.histogram.clone()
}

fn gel_image(cx: &mut Cx<'_>, ui: &mut Ui, pane: Pane, finger: PadId, lookup: Lookup<'_, RgbGrid>) {
    let Some(image) = lookup.shown() else {
        let size = usual_size(cx, SensorKind::Color);
        return placeholder(cx, ui, (pane, finger), lookup, size);
    };
    let Some(touch) = cx.state.touch_key(finger) else { return };
    let label = format!("{} {}", pane.title(), cx.state.finger_name(finger));
    let output = canvas(cx, ui, SensorKind::Color, &label, image.size(), Primary::Pan);
    let squares = shows_squares(&output.map, ui.pixels_per_point());
    let recipe = results::chosen(cx.state, finger).filter(|_| pane == Pane::Predicted);
    let shown = cx.state.settings.gel;
    let picture = cx.shared.textures.get(ui.ctx(), (pane, finger), (touch, pane, shown, recipe), squares, || {
        let picture = if pane == Pane::Predicted || shown == GelView::Difference {
            picture::difference(image)
        } else {
            picture::plain(image)
        };
        (picture_image(&picture), None)
    });
    output.paint(picture.texture.id(), Color32::WHITE);
    if let Some(px) = output.hovered {
        let value = output.map.pixel(px).and_then(|(x, y)| image.get(x, y));
        if let (Some(v), Some((x, y))) = (value, output.map.pixel(px)) {
            cx.shared.readout = Some(format!(
                "{} {} ({x}, {y})   R {:.1}  G {:.1}  B {:.1} of 255",
                pane.title(),
                cx.state.finger_name(finger),
                v[0],
                v[1],
                v[2]
            ));
        }
        if let Some(link) = Link::of(&cx.state.rig(), finger) {
            hover(cx, finger, link.depth_from_color(px, image.size()));
        }
    }
    if let Some(point) = cx.state.selection.hover.filter(|h| h.finger == finger)
        && let Some(link) = Link::of(&cx.state.rig(), finger)
    {
        let px = link.color_from_depth(point.at_px, image.size());
        if output.map.contains(px) {
            output.crosshair(px, Color32::WHITE);
        }
    }
    output.caption(Align2::LEFT_TOP, &finger_text(cx.state, finger), ON_IMAGE);
}

/// Text over pictures: always light, on a dark shade.
pub(crate) const ON_IMAGE: Color32 = Color32::from_gray(235);

/// `right` where the pane could be either finger's.
pub(crate) fn finger_text(state: &State, finger: PadId) -> String {
    let mut text = format!("{} finger", state.finger_name(finger));
    if let Some(first) = text.get_mut(0..1) {
        first.make_ascii_uppercase();
    }
    if state.fingers().len() > 1 && finger == state.selection.finger {
        text.push_str(", active");
    }
    text
}

/// Tells the other panes where the pointer is.
pub(crate) fn hover(cx: &mut Cx<'_>, finger: PadId, at_px: [f32; 2]) {
    cx.shared.hover_claimed = true;
    let hover = Some(Hover { finger, at_px });
    if cx.state.selection.hover != hover {
        cx.push(ViewCommand::HoverPixel(hover));
    }
}

fn depth_pane(
    cx: &mut Cx<'_>,
    ui: &mut Ui,
    memory: &mut Memory,
    pane: Pane,
    finger: PadId,
    lookup: Lookup<'_, DepthMap>,
) -> Option<Histogram> {
    let Some(depth) = lookup.shown() else {
        let size = usual_size(cx, SensorKind::Depth);
        placeholder(cx, ui, (pane, finger), lookup, size);
        return None;
    };
    let stale = matches!(lookup, Lookup::Stale(_));
    let source = if pane == Pane::Predicted { ImprintSource::Predicted } else { ImprintSource::Measured };
    // The recipe of what is shown: the picture is made again when it changes, and only then.
    let recipe = results::imprint_key(cx.state, source, finger).ok()?;
    let paintable = cx.state.selection.panes.contains(&Pane::Masks)
        && cx.state.settings.mask.tool != MaskTool::Pan
        && cx.state.document.is_editable(cx.state.pair_name());
    let primary = if paintable { Primary::Caller } else { Primary::Pan };
    let label = format!("{} {}", pane.title(), cx.state.finger_name(finger));
    let output = canvas(cx, ui, SensorKind::Depth, &label, depth.size(), primary);
    let tint = if stale { Color32::from_gray(130) } else { Color32::WHITE };
    let histogram = paint_depth(cx, ui, &output, ((pane, finger), &recipe), depth, tint);
    if !paint::is_bared(ui) {
        paint::mask(cx, ui, memory, &output, source, finger);
    }
    window(cx, &output, finger);
    if let Some(px) = output.hovered {
        readout(cx, &output, pane, finger, depth, px);
        hover(cx, finger, px);
    }
    if let Some(point) = cx.state.selection.hover.filter(|h| h.finger == finger)
        && !(paintable && output.hovered.is_some())
    {
        output.crosshair(point.at_px, Color32::WHITE);
    }
    // The point that was read in 3D stays marked.
    if let Some(picked) = cx.state.workbench.picked.filter(|p| p.finger == finger && p.source == source) {
        let mark = output.map.to_screen(picked.pixel.map(f32::from));
        output.painter.circle_stroke(mark, 6.0, eframe::egui::Stroke::new(3.0, Color32::from_black_alpha(140)));
        output.painter.circle_stroke(mark, 6.0, eframe::egui::Stroke::new(1.5, cx.p.accent));
    }
    if paintable {
        let on_top = output.response.contains_pointer() || output.response.is_pointer_button_down_on();
        let easel = Easel {
            map: output.map,
            painter: &output.painter,
            response: &output.response,
            on_top: on_top && !output.panning,
            source,
            finger,
            in_3d: false,
            radius_px: cx.state.settings.mask.radius_px,
        };
        pen::follow(cx, ui, (&mut memory.painting, (pane, finger)), &easel, |at_px, erase, _| {
            Some(LabelsCommand::BeginStroke { finger, source, at_px, erase })
        });
    }
    output.caption(Align2::LEFT_BOTTOM, &source_note(cx.state), crate::ui::parts::theme::DARK.caution);
    output.caption(Align2::LEFT_TOP, &finger_text(cx.state, finger), ON_IMAGE);
    histogram
}

/// A prediction on its way, in the colors and the place of the result: nothing can be painted or measured on it.
fn preview_image(cx: &mut Cx<'_>, ui: &mut Ui, finger: PadId, preview: &Arc<Preview>) -> Option<Histogram> {
    let pane = Pane::Predicted;
    let label = format!("{} {}, preview", pane.title(), cx.state.finger_name(finger));
    let depth = &preview.picture.depth;
    let output = canvas(cx, ui, SensorKind::Depth, &label, depth.size(), Primary::Pan);
    let recipe = (&preview.recipe, preview.picture.step);
    let histogram = paint_depth(cx, ui, &output, ((pane, finger), recipe), depth, Color32::WHITE);
    window(cx, &output, finger);
    if let Some(px) = output.hovered {
        readout(cx, &output, pane, finger, depth, px);
        hover(cx, finger, px);
    }
    output.caption(Align2::LEFT_TOP, &finger_text(cx.state, finger), ON_IMAGE);
    let text = format!("preview, step {} of {}", preview.picture.step, preview.picture.of);
    output.caption(Align2::RIGHT_TOP, &text, crate::ui::parts::theme::DARK.caution);
    histogram
}

/// The window of the GelSlim on an imprint, where it is shown.
pub(crate) fn window(cx: &Cx<'_>, output: &CanvasOutput, finger: PadId) {
    if let Some(link) = Link::of(&cx.state.rig(), finger).filter(|_| cx.state.settings.footprint_visible) {
        output.dashed_rect(link.window, Color32::from_gray(235));
    }
}

/// The value under the pointer, in millimeters.
fn readout(cx: &mut Cx<'_>, output: &CanvasOutput, pane: Pane, finger: PadId, depth: &DepthMap, px: [f32; 2]) {
    let Some((x, y)) = output.map.pixel(px) else { return };
    let Some(v) = depth.get(x, y).copied() else { return };
    let name = pane.title();
    let note = scale_note(cx.state);
    let note = if note.is_empty() { String::new() } else { format!(" ({note})") };
    let value = if v.is_finite() { format!("{}{note}", units::text_mm(f64::from(v))) } else { "no measurement".into() };
    cx.shared.readout = Some(format!("{name} {} ({x}, {y})   {value}", cx.state.finger_name(finger)));
}

/// The small square in the color of a side, beside the pane's title.
pub(crate) fn side_mark(ui: &mut Ui, p: &Palette, source: ImprintSource) {
    let (rect, _) = ui.allocate_exact_size(vec2(8.0, 8.0), eframe::egui::Sense::hover());
    ui.painter().rect_filled(rect, 2.0, side_color(p, source));
}
