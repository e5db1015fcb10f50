//! The pen: what the pointer draws on masks, on an image or on the points of a 3D view, and what shows of it on the way.

use eframe::egui::{
    Align2, Color32, CursorIcon, Event, FontId, Key, Modifiers, Painter, PointerButton, Pos2, Response, Stroke, Ui,
    Vec2, vec2,
};
use glam::DVec2;

use super::cx::Cx;
use super::theme::{IGNORED, PROPOSED};
use super::widget::image_canvas::CanvasMap;
use crate::app::command::{LabelsCommand, ViewCommand};
use crate::app::keys::ImprintSource;
use crate::app::labels::Stroke as Drawn;
use crate::app::settings::{MaskTool, prefer};
use touch2touch_core::label::{DrawTool, Paint};
use touch2touch_core::rig::PadId;

/// Picture on the screen that is drawn on.
pub(crate) struct Easel<'a> {
    /// Mapping between the pixels of the picture and the screen.
    pub map: CanvasMap,
    /// Draws within it.
    pub painter: &'a Painter,
    /// Response of the picture to the pointer.
    pub response: &'a Response,
    /// True where a press here is meant for it.
    pub on_top: bool,
    /// The imprint that is drawn on.
    pub source: ImprintSource,
    /// The finger that is drawn on: in a 3D view the one that the pointer means.
    pub finger: PadId,
    /// True for a picture of points in space.
    pub in_3d: bool,
    /// Half the width of the brush here, pixels of the picture.
    pub radius_px: f32,
}

impl Easel<'_> {
    /// True where a stroke is drawn here.
    fn has(&self, stroke: &Drawn) -> bool {
        let same = stroke.drawing.sight.is_some() == self.in_3d && stroke.source == self.source;
        same && (self.in_3d || stroke.place.pad == self.finger)
    }
}

/// Walks every pointer event of the frame: at a low frame rate one frame holds many moves, and a drawing must follow
/// all of them. `held` is what the pen draws on now, `this` this easel's name in it. `begin` makes the command of a press at
/// a place of the picture that removes or not, with keys held; `None` where such a press is not the pen's.
pub(crate) fn follow<K: Copy + PartialEq>(
    cx: &mut Cx<'_>,
    ui: &Ui,
    (held, this): (&mut Option<K>, K),
    easel: &Easel<'_>,
    begin: impl Fn([f32; 2], bool, Modifiers) -> Option<LabelsCommand>,
) {
    let tool = cx.state.settings.mask.tool;
    let events = ui.input(|i| i.events.clone());
    // A polygon that was given up elsewhere, by a key or by drawing there.
    if *held == Some(this)
        && tool == MaskTool::Polygon
        && !cx.state.document.stroke.as_ref().is_some_and(|s| easel.has(s))
    {
        *held = None;
    }
    for event in events {
        match event {
            Event::PointerButton { pos, button, pressed: true, modifiers }
                if matches!(button, PointerButton::Primary | PointerButton::Secondary)
                    && easel.on_top
                    && easel.painter.clip_rect().contains(pos) =>
            {
                let at_px = easel.map.to_image(pos);
                let erase = button == PointerButton::Secondary || modifiers.ctrl || modifiers.command;
                let Some(command) = begin(at_px, erase, modifiers) else { continue };
                if *held != Some(this) && cx.state.selection.finger != easel.finger {
                    // Whoever clicks beside what is worked on wants to work there: nothing is painted by it.
                    cx.push(ViewCommand::SelectFinger(easel.finger));
                } else if held.is_none() {
                    *held = Some(this);
                    cx.push(command);
                } else if *held == Some(this) && tool == MaskTool::Polygon {
                    if closes(cx, easel, pos) {
                        *held = None;
                        cx.push(LabelsCommand::Close);
                    } else {
                        cx.push(LabelsCommand::Corner(at_px));
                    }
                }
            }
            Event::Key { key: Key::Backspace, pressed: true, modifiers, .. }
                if *held == Some(this)
                    && tool == MaskTool::Polygon
                    && modifiers.is_none()
                    && !ui.ctx().egui_wants_keyboard_input() =>
            {
                cx.push(LabelsCommand::Undo);
            }
            Event::PointerMoved(pos) if *held == Some(this) => {
                cx.push(LabelsCommand::StrokeTo(easel.map.to_image(pos)));
            }
            Event::PointerButton { pressed: false, .. } | Event::PointerGone
                if *held == Some(this) && tool != MaskTool::Polygon =>
            {
                *held = None;
                cx.push(LabelsCommand::EndStroke);
            }
            _ => {}
        }
    }
    way(cx, easel);
    if let Some(pos) = easel.response.hover_pos() {
        let (scroll, alt) = ui.input(|i| {
            let scroll = if i.modifiers.shift { i.smooth_scroll_delta() } else { vec2(0.0, 0.0) };
            (scroll, if i.modifiers.alt { i.pointer.delta().x } else { 0.0 })
        });
        let amount = (scroll.x + scroll.y) * 0.005 + alt * 0.01;
        if amount != 0.0 {
            cx.push(prefer(move |s| s.mask.radius_px *= amount.exp()));
        }
        let ctrl = ui.input(|i| i.modifiers.ctrl || i.pointer.secondary_down());
        let erase = (tool == MaskTool::Eraser) != ctrl;
        if matches!(tool, MaskTool::Brush | MaskTool::Eraser) {
            brush_cursor(easel.painter, pos, easel.radius_px * easel.map.scale, erase, Color32::WHITE);
            ui.ctx().set_cursor_icon(CursorIcon::None);
        } else {
            ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        }
    }
}

/// True where a click ends the polygon: on its first corner, or a second time on its last.
fn closes(cx: &Cx<'_>, easel: &Easel<'_>, pos: Pos2) -> bool {
    const NEAR: f32 = 6.0;
    let Some(stroke) = &cx.state.document.stroke else { return false };
    // The last point follows the pointer.
    let corners = &stroke.drawing.points[..stroke.drawing.points.len() - 1];
    let near = |corner: Option<&[f32; 2]>| corner.is_some_and(|c| easel.map.to_screen(*c).distance(pos) < NEAR);
    corners.len() > 2 && (near(corners.first()) || near(corners.last()))
}

/// The way of a drawing that is no brush, and where a hand may change the mask.
fn way(cx: &Cx<'_>, easel: &Easel<'_>) {
    let drawn = cx.state.document.stroke.as_ref().filter(|stroke| easel.has(stroke));
    let Some(drawing) = drawn.map(|stroke| &stroke.drawing) else { return };
    let at = |p: &[f32; 2]| easel.map.to_screen(*p);
    let color = match drawing.paint {
        Paint::Contact => Color32::WHITE,
        Paint::LetThrough => PROPOSED,
        Paint::Free => Color32::from_rgb(255, 120, 90),
        Paint::Ignore => IGNORED,
    };
    let mut line: Vec<Pos2> = match (drawing.tool, drawing.points.as_slice()) {
        (DrawTool::Wand { .. }, [a, ..]) => {
            let mm = drawing.tolerance_m().map_or(f32::NAN, |m| m * 1e3);
            let text = format!("±{mm:.2} mm of this depth");
            let place = at(a) + vec2(10.0, -10.0);
            for (shift, color) in [(vec2(1.0, 1.0), Color32::BLACK), (Vec2::ZERO, color)] {
                easel.painter.text(place + shift, Align2::LEFT_BOTTOM, &text, FontId::proportional(12.0), color);
            }
            return;
        }
        (tool, points) => {
            let points: Vec<DVec2> = points.iter().map(|p| DVec2::new(p[0].into(), p[1].into())).collect();
            tool.outline(&points).iter().map(|p| at(&p.as_vec2().to_array())).collect()
        }
    };
    let Some(first) = line.first().copied() else { return };
    line.push(first);
    easel.painter.line(line.clone(), Stroke::new(2.5, Color32::from_black_alpha(120)));
    easel.painter.line(line, Stroke::new(1.25, color));
}

/// Paints the circle that a stroke at `center` would cover, of a radius in points.
fn brush_cursor(painter: &Painter, center: Pos2, radius: f32, erase: bool, color: Color32) {
    // A brush smaller than a point would vanish: never draw it smaller than its own stroke.
    let radius = radius.max(2.0);
    painter.circle_stroke(center, radius, Stroke::new(3.0, Color32::from_black_alpha(140)));
    painter.circle_stroke(center, radius, Stroke::new(1.25, color));
    if erase {
        let arm = radius.clamp(3.0, 6.0) * 0.7;
        painter.hline(center.x - arm..=center.x + arm, center.y, Stroke::new(1.5, color));
    }
}
