//! The mask on an image, and the pen on it.

use eframe::egui::{Align2, Color32, CursorIcon, Event, FontId, Key, PointerButton, Pos2, Stroke, Ui, Vec2, vec2};

use super::{CONTACT, GHOST, IGNORED, Memory, PROPOSED};
use crate::app::command::{LabelsCommand, SettingsCommand, ViewCommand};
use crate::app::keys::{ImprintSource, MaskVersion};
use crate::app::pane::Pane;
use crate::app::settings::MaskTool;
use crate::domain::label::{DrawTool, Paint};
use crate::domain::rig::PadId;
use crate::ui::cx::Cx;
use crate::ui::widget::brush_cursor;
use crate::ui::widget::image_canvas::CanvasOutput;
use crate::ui::widget::texture::{dashes, mask_image, outline};

/// The mask in force as a veil with an outline, or the outline alone.
pub(super) fn mask(
    cx: &mut Cx<'_>,
    ui: &Ui,
    memory: &mut Memory,
    output: &CanvasOutput,
    source: ImprintSource,
    finger: PadId,
) {
    let settings = &cx.state.settings;
    if !settings.mask_visible || ui.input(|i| i.key_down(Key::X)) && !ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let Ok(in_force) = cx.state.mask_in_force(source, finger) else { return };
    let key: (&MaskVersion, _) = (&in_force.version, cx.state.imprint_key(source, finger).ok());
    // Where nobody paints the data itself is what counts: the outline says enough.
    let veiled = !settings.mask_outline && !cx.state.shows_influence(source);
    if veiled && cx.state.selection.panes.contains(&Pane::Masks) {
        let mask = in_force.mask;
        let slot = ("mask", source, finger);
        let texture = cx.shared.textures.mask(ui.ctx(), slot, &key, mask);
        output.paint(texture, CONTACT.gamma_multiply(settings.mask_opacity));
    }
    if let Some(ignored) = cx.state.hand_mask(source, finger).and_then(|hand| hand.marks.ignored()) {
        let slot = ("ignored", source, finger);
        let veil = || (mask_image(ignored, Color32::WHITE), None);
        let picture = cx.shared.textures.get(ui.ctx(), slot, &key, true, veil);
        output.paint(picture.texture.id(), IGNORED.gamma_multiply(settings.mask_opacity));
        let segments = memory.outlines.get(&("ignored", source, finger), &key, || outline(ignored));
        output.segments(segments, IGNORED, 1.25);
    }
    if !settings.mask.gate.is_open() && cx.state.selection.panes.contains(&Pane::Masks) {
        let gate = serde_json::to_string(&settings.mask.gate).unwrap_or_default();
        let key = (gate, key.1.clone(), cx.state.gate_is_known(source, finger));
        let allowed = || cx.state.allowed(source, finger).ok().flatten();
        let segments = memory
            .outlines
            .get(&("gate", source, finger), &key, || allowed().map(|allowed| outline(&allowed)).unwrap_or_default());
        output.segments(segments, Color32::from_gray(190), 1.0);
    }
    if let Some(proposal) = cx.state.shown_proposal(source, finger) {
        let key = cx.state.proposal_key(source, finger).ok();
        let slot = ("proposal", source, finger);
        let veil = || (mask_image(&proposal.mask, Color32::WHITE), None);
        let picture = cx.shared.textures.get(ui.ctx(), slot, &key, true, veil);
        output.paint(picture.texture.id(), PROPOSED.gamma_multiply(0.6 * settings.mask_opacity));
        let segments = memory.outlines.get(&slot, &key, || outline(&proposal.mask));
        output.segments(segments, Color32::from_black_alpha(110), 2.5);
        output.segments(segments, PROPOSED, 1.25);
    }
    if let Some(ghost) = cx.state.ghost(source).filter(|ghost| ghost.finger == finger) {
        let dashes = memory.outlines.get(&("ghost", source, finger), ghost.revision, || dashes(&outline(ghost.mask)));
        output.segments(dashes, Color32::from_black_alpha(140), 2.5);
        output.segments(dashes, GHOST, 1.5);
    }
    let mask = in_force.mask;
    let segments = memory.outlines.get(&("mask", source, finger), &key, || outline(mask));
    output.segments(segments, Color32::from_black_alpha(110), 2.5);
    output.segments(segments, CONTACT, 1.25);
}

/// Walks every pointer event of the frame: at a low frame rate one frame holds many moves, and a drawing must follow
/// all of them.
pub(super) fn stroke(
    cx: &mut Cx<'_>,
    ui: &Ui,
    memory: &mut Memory,
    output: &CanvasOutput,
    (pane, source, finger): (Pane, ImprintSource, PadId),
) {
    let here = (pane, finger);
    let tool = cx.state.settings.mask.tool;
    let events = ui.input(|i| i.events.clone());
    let on_top = output.response.contains_pointer() || output.response.is_pointer_button_down_on();
    // A polygon that was given up elsewhere, by a key.
    if memory.painting == Some(here) && cx.state.document.stroke.is_none() && tool == MaskTool::Polygon {
        memory.painting = None;
    }
    for event in events {
        match event {
            Event::PointerButton { pos, button, pressed: true, modifiers }
                if matches!(button, PointerButton::Primary | PointerButton::Secondary)
                    && on_top
                    && !output.panning
                    && output.painter.clip_rect().contains(pos) =>
            {
                let at_px = output.map.to_image(pos);
                if cx.state.selection.finger != finger {
                    // Whoever clicks beside what is worked on wants to work there: nothing is painted by it.
                    cx.push(ViewCommand::SelectFinger(finger));
                } else if memory.painting.is_none() {
                    let erase = button == PointerButton::Secondary || modifiers.ctrl || modifiers.command;
                    memory.painting = Some(here);
                    cx.push(LabelsCommand::BeginStroke { finger, source, at_px, erase });
                } else if memory.painting == Some(here) && tool == MaskTool::Polygon {
                    if closes(cx, output, pos) {
                        memory.painting = None;
                        cx.push(LabelsCommand::EndStroke);
                    } else {
                        cx.push(LabelsCommand::Corner(at_px));
                    }
                }
            }
            Event::PointerMoved(pos) if memory.painting == Some(here) => {
                cx.push(LabelsCommand::StrokeTo(output.map.to_image(pos)));
            }
            Event::PointerButton { pressed: false, .. } | Event::PointerGone
                if memory.painting == Some(here) && tool != MaskTool::Polygon =>
            {
                memory.painting = None;
                cx.push(LabelsCommand::EndStroke);
            }
            _ => {}
        }
    }
    way(cx, output, (source, finger));
    if let Some(pos) = output.response.hover_pos() {
        let (scroll, alt) = ui.input(|i| {
            let scroll = if i.modifiers.shift { i.smooth_scroll_delta() } else { vec2(0.0, 0.0) };
            (scroll, if i.modifiers.alt { i.pointer.delta().x } else { 0.0 })
        });
        let radius = cx.state.settings.mask.radius_px;
        let amount = (scroll.x + scroll.y) * 0.005 + alt * 0.01;
        if amount != 0.0 {
            cx.push(SettingsCommand::SetBrushRadius(radius * amount.exp()));
        }
        let ctrl = ui.input(|i| i.modifiers.ctrl || i.pointer.secondary_down());
        let erase = (tool == MaskTool::Eraser) != ctrl;
        if matches!(tool, MaskTool::Brush | MaskTool::Eraser) {
            brush_cursor::paint(output, output.map.to_image(pos), radius, erase, Color32::WHITE);
            ui.ctx().set_cursor_icon(CursorIcon::None);
        } else {
            ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        }
    }
}

/// Whether a click ends the polygon: on its first corner, or a second time on its last.
fn closes(cx: &Cx<'_>, output: &CanvasOutput, pos: Pos2) -> bool {
    const NEAR: f32 = 6.0;
    let Some(stroke) = &cx.state.document.stroke else { return false };
    // The last point follows the pointer.
    let corners = &stroke.drawing.points[..stroke.drawing.points.len() - 1];
    let near = |corner: Option<&[f32; 2]>| corner.is_some_and(|c| output.map.to_screen(*c).distance(pos) < NEAR);
    corners.len() > 2 && (near(corners.first()) || near(corners.last()))
}

/// The way of a drawing that is no brush, and where a hand may change the mask.
fn way(cx: &Cx<'_>, output: &CanvasOutput, (source, finger): (ImprintSource, PadId)) {
    let drawn = cx.state.document.stroke.as_ref().filter(|s| s.source == source && s.place.pad == finger);
    let Some(drawing) = drawn.map(|stroke| &stroke.drawing) else { return };
    let at = |p: &[f32; 2]| output.map.to_screen(*p);
    let color = match drawing.paint {
        Paint::Contact => Color32::WHITE,
        Paint::LetThrough => PROPOSED,
        Paint::Free => Color32::from_rgb(255, 120, 90),
        Paint::Ignore => IGNORED,
    };
    let mut line: Vec<Pos2> = match (drawing.tool, drawing.points.as_slice()) {
        (DrawTool::Lasso | DrawTool::Polygon, points) => points.iter().map(at).collect(),
        (DrawTool::Rectangle, [a, .., b]) => [*a, [b[0], a[1]], *b, [a[0], b[1]]].iter().map(at).collect(),
        (DrawTool::Wand { .. }, [a, ..]) => {
            let mm = drawing.tolerance_m().map_or(f32::NAN, |m| m * 1e3);
            let text = format!("within {mm:.2} mm of this depth");
            let place = at(a) + vec2(10.0, -10.0);
            for (shift, color) in [(vec2(1.0, 1.0), Color32::BLACK), (Vec2::ZERO, color)] {
                output.painter.text(place + shift, Align2::LEFT_BOTTOM, &text, FontId::proportional(12.0), color);
            }
            return;
        }
        _ => return,
    };
    line.extend(line.first().copied());
    output.painter.line(line.clone(), Stroke::new(2.5, Color32::from_black_alpha(120)));
    output.painter.line(line, Stroke::new(1.25, color));
}
