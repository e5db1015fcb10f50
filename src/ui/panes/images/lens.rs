//! The lens: what is under the pointer, magnified, beside it.

use eframe::egui::{Align2, Color32, Mesh, Pos2, Rect, Shape, Stroke, StrokeKind, TextureId, pos2, vec2};

use super::Memory;
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::settings::MaskTool;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::CONTACT;
use crate::ui::parts::widget::image_canvas::{CanvasMap, CanvasOutput};
use crate::ui::parts::widget::texture::outline;
use touch2touch_core::rig::PadId;

/// Magnification over the picture.
const TIMES: f32 = 8.0;
/// Side of the lens, points.
const SIDE: f32 = 152.0;
/// At least so many pixels are seen across it: where the picture itself is that large, there is no lens.
const LEAST_PX: f32 = 7.0;

/// The place of the lens of a pointer at `pos` in `area`, and its points per pixel; `None` where it would show no more.
/// `scale`: points per pixel of the picture.
fn place(area: Rect, pos: Pos2, scale: f32) -> Option<(Rect, f32)> {
    let magnified = (TIMES * scale).min(SIDE / LEAST_PX);
    if magnified <= scale || area.width() < 1.5 * SIDE || area.height() < SIDE {
        return None;
    }
    // Right above the pointer, on the other side of it where there is no room.
    let gap = 18.0;
    let x = if pos.x + gap + SIDE <= area.right() { pos.x + gap } else { pos.x - gap - SIDE };
    let y = if pos.y - gap - SIDE >= area.top() { pos.y - gap - SIDE } else { pos.y + gap };
    let [x, y] = [(x, area.left(), area.right()), (y, area.top(), area.bottom())]
        .map(|(place, low, high)| place.clamp(low, (high - SIDE).max(low)));
    Some((Rect::from_min_size(pos2(x, y), vec2(SIDE, SIDE)), magnified))
}

/// Magnifies the picture that is shown (`texture`, as it lies on the graphics card) with the outline of the mask, the brush
/// and a mark on the pixel under the pointer.
pub(super) fn show(
    cx: &Cx<'_>,
    memory: &mut Memory,
    output: &CanvasOutput,
    texture: TextureId,
    (source, finger, paintable): (ImprintSource, PadId, bool),
) {
    let (Some(center), Some(pos)) = (output.hovered, output.response.hover_pos()) else { return };
    let Some((rect, scale)) = place(output.painter.clip_rect(), pos, output.map.scale) else { return };
    let size = output.map.size;
    let [width, height] = size.map(|side| side as f32);
    let corner = rect.center() - vec2(center[0] + 0.5, center[1] + 0.5) * scale;
    let map = CanvasMap {
        image_rect: Rect::from_min_size(corner, vec2(width, height) * scale),
        scale,
        rotated: output.map.rotated,
        size,
    };
    let painter = output.painter.with_clip_rect(rect.intersect(output.painter.clip_rect()));
    painter.rect_filled(rect, 0.0, cx.p.canvas);
    // Each pixel takes the color in its middle, so that it is a square however the texture is filtered.
    let mut mesh = Mesh::with_texture(texture);
    let reach = (0.5 * SIDE / scale).ceil() as i32 + 1;
    let [at_x, at_y] = center.map(|v| v.round() as i32);
    for (x, y) in (at_y - reach..=at_y + reach).flat_map(|y| (at_x - reach..=at_x + reach).map(move |x| (x, y))) {
        if x < 0 || y < 0 || x as usize >= size[0] || y as usize >= size[1] {
            continue;
        }
        let middle = map.to_screen([x as f32, y as f32]);
        let uv = pos2((x as f32 + 0.5) / width, (y as f32 + 0.5) / height);
        let square = Rect::from_center_size(middle, vec2(scale, scale));
        mesh.add_rect_with_uv(square, Rect::from_min_max(uv, uv), Color32::WHITE);
    }
    painter.add(Shape::mesh(mesh));
    let lens = CanvasOutput {
        response: output.response.clone(),
        map,
        hovered: output.hovered,
        painter: painter.clone(),
        panning: false,
    };
    if let (true, Ok(mask)) = (cx.state.settings.mask_visible, results::mask_in_force(cx.state, source, finger)) {
        let key = (&mask.version, results::imprint_key(cx.state, source, finger).ok());
        let segments = memory.outlines.get(&("mask", source, finger), &key, || outline(mask.mask));
        lens.segments(segments, Color32::from_black_alpha(140), 3.5);
        lens.segments(segments, CONTACT, 1.75);
    }
    let pixel = Rect::from_center_size(map.to_screen([at_x as f32, at_y as f32]), vec2(scale, scale));
    painter.rect_stroke(pixel, 0.0, Stroke::new(1.0, Color32::WHITE), StrokeKind::Middle);
    let mask = &cx.state.settings.mask;
    if paintable && matches!(mask.tool, MaskTool::Brush | MaskTool::Eraser) {
        painter.circle_stroke(rect.center(), mask.radius_px * scale, Stroke::new(1.25, Color32::WHITE));
    }
    output.painter.rect_stroke(rect, 2.0, Stroke::new(1.5, cx.p.accent), StrokeKind::Inside);
    let text = format!("{:.0} x", scale / output.map.scale);
    lens.caption(Align2::RIGHT_BOTTOM, &text, Color32::from_gray(235));
}
