//! The mask on an image, and the pen on it.

use eframe::egui::{Color32, CursorIcon, Event, Key, PointerButton, TextureId, Ui, vec2};

use super::{CONTACT, Memory};
use crate::app::command::{LabelsCommand, SettingsCommand, ViewCommand};
use crate::app::keys::{ImprintSource, MaskVersion};
use crate::app::pane::Pane;
use crate::app::settings::MaskTool;
use crate::domain::rig::PadId;
use crate::ui::cx::Cx;
use crate::ui::widget::brush_cursor;
use crate::ui::widget::image_canvas::CanvasOutput;
use crate::ui::widget::texture::{mask_image, outline};

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
    if !settings.mask_outline && cx.state.selection.panes.contains(&Pane::Masks) {
        let mask = in_force.mask;
        let slot = ("mask", source, finger);
        let picture = cx.shared.textures.get(ui.ctx(), slot, &key, true, || (mask_image(mask, Color32::WHITE), None));
        let texture: TextureId = picture.texture.id();
        output.paint(texture, CONTACT.gamma_multiply(settings.mask_opacity));
    }
    let mask = in_force.mask;
    let segments = memory.outlines.get(&("mask", source, finger), &key, || outline(mask));
    output.segments(segments, Color32::from_black_alpha(110), 2.5);
    output.segments(segments, CONTACT, 1.25);
}

/// Walks every pointer event of the frame: at a low frame rate one frame holds many moves, and a stroke must follow
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
    for event in events {
        match event {
            Event::PointerButton { pos, button, pressed: true, modifiers }
                if matches!(button, PointerButton::Primary | PointerButton::Secondary)
                    && on_top
                    && !output.panning
                    && memory.painting.is_none()
                    && output.painter.clip_rect().contains(pos) =>
            {
                let erase = button == PointerButton::Secondary || modifiers.ctrl || modifiers.command;
                memory.painting = Some(here);
                if cx.state.selection.finger != finger {
                    cx.push(ViewCommand::SelectFinger(finger));
                }
                let at_px = output.map.to_image(pos);
                cx.push(LabelsCommand::BeginStroke { finger, source, at_px, erase });
            }
            Event::PointerMoved(pos) if memory.painting == Some(here) => {
                cx.push(LabelsCommand::StrokeTo(output.map.to_image(pos)));
            }
            Event::PointerButton { pressed: false, .. } | Event::PointerGone if memory.painting == Some(here) => {
                memory.painting = None;
                cx.push(LabelsCommand::EndStroke);
            }
            _ => {}
        }
    }
    if let Some(pos) = output.response.hover_pos() {
        let scroll = ui.input(|i| if i.modifiers.shift { i.smooth_scroll_delta() } else { vec2(0.0, 0.0) });
        let amount = scroll.x + scroll.y;
        let radius = cx.state.settings.mask.radius_px;
        if amount != 0.0 {
            cx.push(SettingsCommand::SetBrushRadius(radius * (amount * 0.005).exp()));
        }
        let ctrl = ui.input(|i| i.modifiers.ctrl || i.pointer.secondary_down());
        let erase = (tool == MaskTool::Eraser) != ctrl;
        brush_cursor::paint(output, output.map.to_image(pos), radius, erase, Color32::WHITE);
        ui.ctx().set_cursor_icon(CursorIcon::None);
    }
}
