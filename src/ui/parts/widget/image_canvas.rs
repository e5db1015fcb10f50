//! One picture in a pane: pan, zoom and cross-hair, shared with the other pictures of its group.

use eframe::egui::text::{LayoutJob, TextWrapping};
use eframe::egui::{
    self, Color32, CursorIcon, Key, Painter, PointerButton, Pos2, Rect, Response, Role, Sense, Stroke, TextureId, Ui,
    Vec2, WidgetInfo, pos2, vec2,
};

with_defaults! {
    /// Part of an image that is seen. Shared by all canvases of a group, whatever their sizes.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub(crate) struct ViewTransform {
        /// The point of the image in the middle of the pane, as a share of its width and height.
        pub center: [f32; 2] = [0.5, 0.5],
        /// Magnification; 1 fits the image to the pane.
        pub zoom: f32 = 1.0,
    }
}

impl ViewTransform {
    /// Keeps the image where it can be found again.
    fn clamp(&mut self) {
        self.zoom = if self.zoom.is_finite() { self.zoom.clamp(0.25, 64.0) } else { 1.0 };
        for c in &mut self.center {
            *c = if c.is_finite() { c.clamp(-0.2, 1.2) } else { 0.5 };
        }
    }
}

/// Between image pixels and the screen. (0, 0) is the center of the top-left pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CanvasMap {
    /// Rectangle of the whole image on the screen, points.
    pub image_rect: Rect,
    /// Points per image pixel.
    pub scale: f32,
    /// True where the image is shown rotated by 180 degrees.
    pub rotated: bool,
    /// Columns and rows.
    pub size: [usize; 2],
}

impl CanvasMap {
    /// The place of `view` of an image of `size` pixels in `rect`.
    pub(crate) fn new(rect: Rect, size: [usize; 2], view: ViewTransform, rotated: bool) -> Self {
        let image = vec2(size[0].max(1) as f32, size[1].max(1) as f32);
        let fit = (rect.width() / image.x).min(rect.height() / image.y).max(1e-3);
        let scale = fit * view.zoom;
        let offset = vec2(view.center[0] - 0.5, view.center[1] - 0.5) * image * scale;
        let image_rect = Rect::from_center_size(rect.center() - offset, image * scale);
        Self { image_rect, scale, rotated, size }
    }

    /// The screen position of an image pixel.
    pub(crate) fn to_screen(self, px: [f32; 2]) -> Pos2 {
        let p = vec2(px[0] + 0.5, px[1] + 0.5) * self.scale;
        if self.rotated { self.image_rect.max - p } else { self.image_rect.min + p }
    }

    /// The image pixel at a screen position; may lie outside the image.
    pub(crate) fn to_image(self, pos: Pos2) -> [f32; 2] {
        let p = if self.rotated { self.image_rect.max - pos } else { pos - self.image_rect.min } / self.scale;
        [p.x - 0.5, p.y - 0.5]
    }

    /// True where the pixel lies in the image.
    pub(crate) fn contains(&self, px: [f32; 2]) -> bool {
        px[0] >= -0.5 && px[1] >= -0.5 && px[0] < self.size[0] as f32 - 0.5 && px[1] < self.size[1] as f32 - 0.5
    }

    /// The column and row of a position in the image.
    pub(crate) fn pixel(&self, px: [f32; 2]) -> Option<(usize, usize)> {
        self.contains(px).then(|| (px[0].round().max(0.0) as usize, px[1].round().max(0.0) as usize))
    }

    /// The corners of the texture at the corners of the image.
    pub(crate) fn uv(&self) -> Rect {
        let [from, to] = if self.rotated { [1.0, 0.0] } else { [0.0, 1.0] };
        Rect::from_min_max(pos2(from, from), pos2(to, to))
    }
}

/// Use of the primary button on a canvas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Primary {
    /// Moves the image.
    Pan,
    /// Is left to the caller (painting); Space held still moves the image.
    Caller,
}

/// A picture to be shown.
pub(crate) struct ImageCanvas<'a> {
    /// The name for screen readers and tests.
    pub label: &'a str,
    /// Columns and rows of the picture.
    pub size: [usize; 2],
    /// True where it is shown rotated by 180 degrees.
    pub rotated: bool,
    /// Use of the primary button.
    pub primary: Primary,
    /// Behind the picture.
    pub background: Color32,
}

/// Events on a canvas, and what is needed to draw on it.
pub(crate) struct CanvasOutput {
    /// The pane's response.
    pub response: Response,
    /// Between pixels and the screen.
    pub map: CanvasMap,
    /// The position under the pointer, in image pixels, where it lies in the image.
    pub hovered: Option<[f32; 2]>,
    /// Draws within the pane.
    pub painter: Painter,
    /// True where the view was changed: the caller may have to store it.
    pub panning: bool,
}

impl ImageCanvas<'_> {
    /// Takes all the space left in `ui`, moves `view` by what the pointer does, and paints the background.
    /// The caller then paints the picture with [`CanvasOutput::paint`] and what lies over it.
    pub(crate) fn show(self, ui: &mut Ui, view: &mut ViewTransform) -> CanvasOutput {
        let size = ui.available_size().max(Vec2::splat(8.0));
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        let label = self.label.to_owned();
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &label));

        let space = ui.input(|i| i.key_down(Key::Space)) && !ui.ctx().egui_wants_keyboard_input();
        let pan = response.dragged_by(PointerButton::Middle)
            || (response.dragged_by(PointerButton::Primary) && (space || self.primary == Primary::Pan));
        if pan {
            let map = CanvasMap::new(rect, self.size, *view, self.rotated);
            let moved = response.drag_delta() / map.image_rect.size().max(Vec2::splat(1.0));
            view.center = [view.center[0] - moved.x, view.center[1] - moved.y];
        }
        if response.contains_pointer() {
            // Wheel, pinch and Ctrl + wheel all zoom at the pointer; Shift + wheel is the brush's.
            let (scroll, pinch, shift) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta(), i.modifiers.shift));
            let factor = if shift { 1.0 } else { pinch * (scroll * 0.005).exp() };
            if factor != 1.0
                && let Some(pos) = ui.input(|i| i.pointer.hover_pos())
            {
                let before = CanvasMap::new(rect, self.size, *view, false);
                let share = (pos - before.image_rect.min) / before.image_rect.size().max(Vec2::splat(1.0));
                view.zoom *= factor;
                view.clamp();
                let after = CanvasMap::new(rect, self.size, *view, false);
                let drift = after.image_rect.min + share * after.image_rect.size() - pos;
                let drift = drift / after.image_rect.size().max(Vec2::splat(1.0));
                view.center = [view.center[0] + drift.x, view.center[1] + drift.y];
            }
            // Where the primary button paints, two quick dabs are no double-click.
            if self.primary == Primary::Pan && response.double_clicked() {
                *view = ViewTransform::default();
            }
            if pan || space {
                ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
            } else if self.primary == Primary::Pan {
                ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
            }
        }
        view.clamp();
        let map = CanvasMap::new(rect, self.size, *view, self.rotated);
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 0.0, self.background);
        let hovered = response.hover_pos().map(|pos| map.to_image(pos)).filter(|px| map.contains(*px));
        CanvasOutput { response, map, hovered, painter, panning: pan || space }
    }
}

/// True where pixels are large enough on screen to be shown as squares.
pub(crate) fn shows_squares(map: &CanvasMap, pixels_per_point: f32) -> bool {
    map.scale * pixels_per_point >= 4.0
}

impl CanvasOutput {
    /// Paints a texture over the whole image.
    pub(crate) fn paint(&self, texture: TextureId, tint: Color32) {
        self.painter.image(texture, self.map.image_rect, self.map.uv(), tint);
    }

    /// Paints a cross-hair through an image position: thin, with a gap so that the pixel stays visible.
    pub(crate) fn crosshair(&self, px: [f32; 2], color: Color32) {
        let c = self.map.to_screen(px);
        let rect = self.painter.clip_rect();
        if !rect.contains(c) {
            return;
        }
        let gap = 5.0;
        for (width, color) in [(3.0, Color32::from_black_alpha(90)), (1.0, color)] {
            let stroke = Stroke::new(width, color);
            self.painter.hline(rect.left()..=c.x - gap, c.y, stroke);
            self.painter.hline(c.x + gap..=rect.right(), c.y, stroke);
            self.painter.vline(c.x, rect.top()..=c.y - gap, stroke);
            self.painter.vline(c.x, c.y + gap..=rect.bottom(), stroke);
        }
    }

    /// Paints a dashed rectangle given by its center and size in image pixels.
    pub(crate) fn dashed_rect(&self, [cx, cy, w, h]: [f64; 4], color: Color32) {
        let corner = |sx: f64, sy: f64| self.map.to_screen([(cx + sx * w * 0.5) as f32, (cy + sy * h * 0.5) as f32]);
        let path = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0)];
        let dark = Stroke::new(2.5, Color32::from_black_alpha(120));
        self.painter.extend(egui::Shape::dashed_line(&path, dark, 6.0, 4.0));
        self.painter.extend(egui::Shape::dashed_line(&path, Stroke::new(1.25, color), 6.0, 4.0));
    }

    /// Paints segments along rows and columns, given in pixel-corner coordinates (see [`super::texture::outline`]), as
    /// lines of whole pixels of the screen.
    ///
    /// One mesh of rectangles: an outline has thousands of sides, and is painted anew at every move of a stroke.
    pub(crate) fn segments(&self, segments: &[[[f32; 2]; 2]], color: Color32, width: f32) {
        let corner = |p: [f32; 2]| self.map.to_screen([p[0] - 0.5, p[1] - 0.5]);
        let per_point = self.painter.pixels_per_point();
        let wide = (width * per_point).round().max(1.0);
        // The middle of a line of an odd number of pixels is the middle of a pixel.
        let snap = |v: f32| ((v * per_point - 0.5 * wide).round()) / per_point;
        let mut mesh = egui::Mesh::default();
        for [a, b] in segments {
            let around = Rect::from_two_pos(corner(*a), corner(*b));
            let min = pos2(snap(around.min.x), snap(around.min.y));
            let max = pos2(snap(around.max.x), snap(around.max.y)) + Vec2::splat(wide / per_point);
            let line = Rect::from_min_max(min, max);
            if line.intersects(self.painter.clip_rect()) {
                mesh.add_colored_rect(line, color);
            }
        }
        if !mesh.is_empty() {
            self.painter.add(mesh);
        }
    }

    /// Writes a caption into a corner of the pane, on a shade that keeps it readable over any picture.
    pub(crate) fn caption(&self, corner: egui::Align2, text: &str, color: Color32) {
        if text.is_empty() {
            return;
        }
        let rect = self.painter.clip_rect().shrink(6.0);
        let mut job = LayoutJob::simple_singleline(text.to_owned(), egui::FontId::proportional(11.0), color);
        job.wrap = TextWrapping::truncate_at_width(rect.width());
        let galley = self.painter.layout_job(job);
        let place = corner.align_size_within_rect(galley.size(), rect);
        self.painter.rect_filled(place.expand2(vec2(4.0, 2.0)), 3.0, Color32::from_black_alpha(150));
        self.painter.galley(place.min, galley, color);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_survive_the_way_to_the_screen_and_back() {
        let rect = Rect::from_min_size(pos2(30.0, 20.0), vec2(300.0, 200.0));
        for rotated in [false, true] {
            let view = ViewTransform { center: [0.3, 0.8], zoom: 3.0 };
            let map = CanvasMap::new(rect, [175, 140], view, rotated);
            for px in [[0.0, 0.0], [12.0, 99.5], [174.0, 139.0]] {
                let back = map.to_image(map.to_screen(px));
                assert!((back[0] - px[0]).abs() < 1e-3 && (back[1] - px[1]).abs() < 1e-3, "{px:?} {back:?}");
            }
        }
    }

    #[test]
    fn rotation_swaps_the_corners() {
        let rect = Rect::from_min_size(pos2(0.0, 0.0), vec2(175.0, 140.0));
        let map = CanvasMap::new(rect, [175, 140], ViewTransform::default(), true);
        assert_eq!(map.to_screen([0.0, 0.0]), pos2(174.5, 139.5));
        assert_eq!(map.pixel([174.4, 0.0]), Some((174, 0)));
        assert_eq!(map.pixel([174.6, 0.0]), None);
    }
}
