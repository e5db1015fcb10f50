//! Small pictures of depth in panes that show several.

use std::hash::Hash;

use eframe::egui::{Color32, Painter, Pos2, Rect, pos2};

use super::cx::Cx;
use super::widget::texture::depth_image;
use crate::domain::colormap::{ColorMap, Range};
use crate::domain::grid::DepthMap;

/// Draws one into `rect`; made again only where `recipe` (what it shows) or its colors changed.
pub(super) fn depth(
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
