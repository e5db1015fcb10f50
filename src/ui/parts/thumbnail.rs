//! Small pictures of depth in panes that show several.

use std::hash::Hash;

use eframe::egui::{Color32, Painter, Pos2, Rect, Response, pos2};

use super::cx::Cx;
use super::widget::texture::depth_image;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::units;

/// Draws one into `rect`; made again only where `recipe` (what it shows) or its colors changed.
pub(crate) fn depth(
    cx: &mut Cx<'_>,
    painter: &Painter,
    rect: Rect,
    slot: impl Hash,
    recipe: impl Hash,
    (image, map, range): (&DepthMap, ColorMap, Range),
) {
    let key = (recipe, map, range.lo.to_bits(), range.hi.to_bits());
    let texture = cx.shared.textures.get(painter.ctx(), slot, key, false, || (depth_image(image, map, range), None));
    painter.image(texture.texture.id(), rect, Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)), Color32::WHITE);
}

/// Says the value under the pointer in the status bar.
pub(crate) fn readout(cx: &mut Cx<'_>, response: &Response, name: &str, image: &DepthMap) {
    let Some(pos) = response.hover_pos() else { return };
    let share = (pos - response.rect.min) / response.rect.size();
    let [w, h] = image.size();
    let (x, y) = ((share.x * w as f32) as usize, (share.y * h as f32) as usize);
    if let Some(value) = image.get(x, y).filter(|v| v.is_finite()) {
        cx.shared.readout = Some(format!("{name} ({x}, {y})   {}", units::text_mm(f64::from(*value))));
    }
}
