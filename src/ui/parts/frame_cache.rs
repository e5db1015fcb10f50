//! The window's picture, kept from frame to frame: only what changed is painted into it.
//!
//! The toolkit paints the whole window for every move of the pointer. A graphics card does not notice; a program that
//! draws (remote desktops, virtual machines) spends up to a fifth of a second on it. So there the triangles of a frame
//! are compared with those of the frame before, tile by tile: a tile whose triangles are the same, in the same order and
//! over unchanged textures, has the same pixels. The others are painted into a picture that stays, and the window shows
//! that one picture.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use eframe::egui::epaint::{ClippedPrimitive, ClippedShape, ImageData, Primitive, Vertex, WHITE_UV};
use eframe::egui::{
    Color32, Context, FullOutput, Mesh, PaintCallbackInfo, Plugin, Pos2, Rect, Shape, TextureFilter, TextureId,
    ViewportId, pos2, vec2,
};
use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, RenderState};

use crate::gpu::raster::{Corner, Fill, FramePicture, Raster, Run};
use crate::gpu::{Gpu, GpuError, wgpu};

/// Side of a tile, physical pixels.
const TILE: u32 = 32;
/// Rectangles that are painted in one frame; of more the one around them is.
const RECTS: usize = 64;
/// Triangles around which at least so many pixels lie are painted by their kind; smaller ones all alike, which is less
/// to switch between.
const LARGE_PX: f32 = 4096.0;

/// Paints what changed. A plugin of the toolkit: it takes each frame's shapes and textures and gives one picture back.
pub(crate) struct FrameCache {
    gpu: Gpu,
    format: wgpu::TextureFormat,
    raster: Raster,
    picture: Option<Arc<FramePicture>>,
    /// Changes of each texture so far.
    versions: BTreeMap<TextureId, u64>,
    /// Of each tile the hash of all triangles that touch it.
    tiles: Vec<u64>,
    /// Pixels painted so far.
    pub painted: u64,
}

/// A triangle of a primitive.
struct Triangle {
    primitive: usize,
    /// Places in the primitive's vertices.
    corners: [u32; 3],
    /// Around it, within its clip rectangle; physical pixels.
    bounds: Rect,
    fill: Fill,
}

/// A rectangle of tiles: columns and rows from `min` to before `max`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Block {
    min: [u32; 2],
    max: [u32; 2],
}

impl Block {
    fn join(self, other: Self) -> Self {
        Self {
            min: [self.min[0].min(other.min[0]), self.min[1].min(other.min[1])],
            max: [self.max[0].max(other.max[0]), self.max[1].max(other.max[1])],
        }
    }
}

/// The kept picture on the window.
struct Shown(Arc<FramePicture>);

impl CallbackTrait for Shown {
    fn paint(&self, _: PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, _: &CallbackResources) {
        self.0.copy(pass);
    }
}

impl FrameCache {
    /// Installs itself in `ctx`; returns whether it did: only where a program draws and the window has plain bytes.
    ///
    /// # Errors
    /// The device's refusal: then the toolkit paints the window as before.
    pub(crate) fn install(ctx: &Context, window: &RenderState) -> Result<bool, GpuError> {
        let format = window.target_format;
        let plain = matches!(format, wgpu::TextureFormat::Rgba8Unorm | wgpu::TextureFormat::Bgra8Unorm);
        let gpu = Gpu::new(&window.adapter, window.device.clone(), window.queue.clone());
        if !gpu.software || !plain {
            return Ok(false);
        }
        let mut raster = Raster::new(&gpu, format)?;
        raster.prove(&gpu, format)?;
        let (versions, tiles) = (BTreeMap::new(), Vec::new());
        ctx.add_plugin(Self { gpu, format, raster, picture: None, versions, tiles, painted: 0 });
        Ok(true)
    }

    /// Shows `view`, which a 3D view draws, where the toolkit shows `texture`.
    pub(crate) fn show(&mut self, texture: TextureId, view: &wgpu::TextureView) {
        self.raster.show(&self.gpu, key(texture), view);
        self.touch(texture);
    }

    /// Says that a texture has another picture now.
    pub(crate) fn touch(&mut self, texture: TextureId) {
        *self.versions.entry(texture).or_default() += 1;
    }

    /// Sends new and changed textures to the device.
    fn take_textures(&mut self, output: &mut FullOutput) {
        let mut set: Vec<_> = output.textures_delta.set.drain().collect();
        set.sort_by_key(|(id, _)| *id);
        for (id, deltas) in set {
            for delta in deltas {
                // The toolkit's own texture only gains glyphs as long as it is not sent whole.
                if delta.pos.is_none() || id != TextureId::default() {
                    self.touch(id);
                }
                let ImageData::Color(image) = &delta.image;
                let size = image.size.map(|s| s as u32);
                let rgba: Vec<u8> = image.pixels.iter().flat_map(|p| p.to_array()).collect();
                match delta.pos {
                    None => {
                        let nearest = delta.options.magnification == TextureFilter::Nearest;
                        self.raster.set(&self.gpu, key(id), size, &rgba, nearest);
                    }
                    Some(place) => {
                        if !self.raster.set_part(&self.gpu, key(id), place.map(|p| p as u32), size, &rgba) {
                            log::error!("a part of texture {id:?} came before the whole");
                        }
                    }
                }
            }
        }
    }

    /// The picture of this size; a new one, and every tile to be painted, if there is none.
    fn picture(&mut self, size: [u32; 2]) -> Arc<FramePicture> {
        match &self.picture {
            Some(picture) if picture.size == size => picture.clone(),
            _ => {
                self.tiles.clear();
                let picture = Arc::new(self.raster.picture(&self.gpu, size, self.format));
                self.picture = Some(picture.clone());
                picture
            }
        }
    }
}

/// The toolkit's name of a texture as the raster's.
fn key(id: TextureId) -> u64 {
    match id {
        TextureId::Managed(n) => 2 * n,
        TextureId::User(n) => 2 * n + 1,
    }
}

impl Plugin for FrameCache {
    fn debug_name(&self) -> &'static str {
        "FrameCache"
    }

    fn output_hook(&mut self, ctx: &Context, output: &mut FullOutput) {
        if ctx.viewport_id() != ViewportId::ROOT {
            return;
        }
        self.take_textures(output);
        let ppp = output.pixels_per_point;
        let rect = ctx.viewport_rect();
        let limit = self.gpu.device.limits().max_texture_dimension_2d as f32;
        let size = [rect.width(), rect.height()].map(|s| (s * ppp).round().clamp(0.0, limit) as u32);
        let primitives = ctx.tessellate(std::mem::take(&mut output.shapes), ppp);
        if size[0] > 0 && size[1] > 0 {
            let picture = self.picture(size);
            let grid = size.map(|s| s.div_ceil(TILE));
            let triangles = triangles(&primitives, ppp, size);
            let tiles = tiles(&primitives, &triangles, &self.versions, grid);
            let blocks = blocks(grid, |tile| self.tiles.get(tile).is_none_or(|old| *old != tiles[tile]));
            let mut jobs = FrameMesh { ppp, size, ..FrameMesh::default() };
            for block in &blocks {
                let [x0, y0] = block.min.map(|v| v * TILE);
                let [x1, y1] = [0, 1].map(|axis| (block.max[axis] * TILE).min(size[axis]));
                self.painted += u64::from(x1 - x0) * u64::from(y1 - y0);
                let part = Rect::from_min_max(pos2(x0 as f32, y0 as f32), pos2(x1 as f32, y1 as f32));
                jobs.ground(part);
                jobs.within(&primitives, &triangles, part);
            }
            self.tiles = tiles;
            if !jobs.runs.is_empty()
                && let Err(error) = self.raster.paint(&self.gpu, &picture, &jobs.corners, &jobs.indices, &jobs.runs)
            {
                log::error!("{error}");
                self.tiles.clear();
            }
            let whole = Rect::from_min_size(Pos2::ZERO, vec2(size[0] as f32, size[1] as f32) / ppp);
            let shown = Callback::new_paint_callback(whole, Shown(picture));
            output.shapes.push(ClippedShape::new(whole, Shape::Callback(shown)));
        }
        let mut freed: Vec<_> = output.textures_delta.free.drain().collect();
        freed.sort();
        for id in freed {
            // Its version stays: the name may be given again.
            self.raster.free(key(id));
        }
    }
}

/// All triangles that can be seen, in the order in which they are painted.
fn triangles(primitives: &[ClippedPrimitive], ppp: f32, size: [u32; 2]) -> Vec<Triangle> {
    let screen = Rect::from_min_size(Pos2::ZERO, vec2(size[0] as f32, size[1] as f32));
    let mut all = Vec::new();
    for (index, job) in primitives.iter().enumerate() {
        let clip = in_pixels(job.clip_rect, ppp).intersect(screen);
        // The studio's 3D views are pictures: nothing in it paints by itself.
        let Primitive::Mesh(mesh) = &job.primitive else { continue };
        if !clip.is_positive() {
            continue;
        }
        let key = key(mesh.texture_id);
        for corners in mesh.indices.chunks_exact(3) {
            let corners = [corners[0], corners[1], corners[2]];
            let Some(three) = vertices(mesh, corners) else { continue };
            let bounds = Rect::from_points(&three.map(|v| v.pos * ppp)).intersect(clip);
            // What has no area within its clip rectangle is not seen.
            if !bounds.is_positive() {
                continue;
            }
            let one_color = mesh.texture_id == TextureId::default() && three.iter().all(|v| v.uv == WHITE_UV);
            let fill = if one_color && bounds.area() >= LARGE_PX { Fill::Flat } else { Fill::Textured(key) };
            all.push(Triangle { primitive: index, corners, bounds, fill });
        }
    }
    all
}

/// A rectangle in whole physical pixels, rounded as the toolkit rounds its clip rectangles.
fn in_pixels(rect: Rect, ppp: f32) -> Rect {
    Rect::from_min_max((rect.min * ppp).round(), (rect.max * ppp).round())
}

/// The corners of a triangle; `None` where the mesh does not have them.
fn vertices(mesh: &Mesh, corners: [u32; 3]) -> Option<[Vertex; 3]> {
    let at = |i: u32| mesh.vertices.get(i as usize).copied();
    Some([at(corners[0])?, at(corners[1])?, at(corners[2])?])
}

/// The hash of what touches each tile, row by row.
fn tiles(
    primitives: &[ClippedPrimitive],
    triangles: &[Triangle],
    versions: &BTreeMap<TextureId, u64>,
    grid: [u32; 2],
) -> Vec<u64> {
    let mut tiles = vec![0; (grid[0] * grid[1]) as usize];
    for of_one in triangles.chunk_by(|a, b| a.primitive == b.primitive) {
        let (seed, vertices) = hashes(&primitives[of_one[0].primitive], versions);
        for triangle in of_one {
            let corner = |i: u32| vertices.get(i as usize).copied().unwrap_or_default();
            let hash = triangle.corners.iter().fold(seed, |sum, i| mix(sum, corner(*i)));
            let b = triangle.bounds;
            let [x0, y0] = [b.min.x, b.min.y].map(|v| (v / TILE as f32).floor().max(0.0) as u32);
            let [x1, y1] = [b.max.x, b.max.y].map(|v| (v / TILE as f32).ceil() as u32);
            for y in y0..y1.min(grid[1]) {
                for x in x0..x1.min(grid[0]) {
                    let tile = &mut tiles[(y * grid[0] + x) as usize];
                    *tile = mix(*tile, hash);
                }
            }
        }
    }
    tiles
}

/// The hash of a primitive's clip rectangle and texture, and of each of its vertices.
fn hashes(job: &ClippedPrimitive, versions: &BTreeMap<TextureId, u64>) -> (u64, Vec<u64>) {
    let Primitive::Mesh(mesh) = &job.primitive else { return (0, Vec::new()) };
    let mut hasher = DefaultHasher::new();
    let clip = job.clip_rect;
    [clip.min.x, clip.min.y, clip.max.x, clip.max.y].map(f32::to_bits).hash(&mut hasher);
    (mesh.texture_id, versions.get(&mesh.texture_id)).hash(&mut hasher);
    let vertex = |v: &Vertex| {
        let words = [v.pos.x, v.pos.y, v.uv.x, v.uv.y].map(f32::to_bits);
        let start = u64::from(u32::from_le_bytes(v.color.to_array()));
        words.into_iter().fold(start, |sum, word| mix(sum, u64::from(word)))
    };
    (hasher.finish(), mesh.vertices.iter().map(vertex).collect())
}

/// Two numbers into one; the order counts.
fn mix(a: u64, b: u64) -> u64 {
    let m = (a.rotate_left(23) ^ b).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    m ^ (m >> 29)
}

/// Rectangles around all tiles that changed: runs of a row, joined with the same run of the row above.
fn blocks(grid: [u32; 2], changed: impl Fn(usize) -> bool) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for y in 0..grid[1] {
        let mut x = 0;
        while x < grid[0] {
            if !changed((y * grid[0] + x) as usize) {
                x += 1;
                continue;
            }
            let start = x;
            while x < grid[0] && changed((y * grid[0] + x) as usize) {
                x += 1;
            }
            let run = Block { min: [start, y], max: [x, y + 1] };
            match blocks.iter_mut().find(|b| b.max[1] == y && b.min[0] == start && b.max[0] == x) {
                Some(above) => above.max[1] = y + 1,
                None => blocks.push(run),
            }
        }
    }
    match blocks.iter().copied().reduce(Block::join) {
        Some(around) if blocks.len() > RECTS => vec![around],
        _ => blocks,
    }
}

/// Mesh that is sent to the device for one frame.
#[derive(Default)]
struct FrameMesh {
    ppp: f32,
    size: [u32; 2],
    corners: Vec<Corner>,
    indices: Vec<u32>,
    runs: Vec<Run>,
}

impl FrameMesh {
    /// A place on the window, points, in clip space.
    fn corner(&mut self, v: Vertex) -> u32 {
        let at = [
            2.0 * v.pos.x * self.ppp / self.size[0] as f32 - 1.0,
            1.0 - 2.0 * v.pos.y * self.ppp / self.size[1] as f32,
        ];
        self.corners.push(Corner { at, uv: [v.uv.x, v.uv.y], color: v.color.to_array() });
        self.corners.len() as u32 - 1
    }

    /// A triangle, in the run before where that is of its kind.
    fn triangle(&mut self, corners: [u32; 3], clip: Rect, fill: Fill) {
        let scissor = [clip.min.x, clip.min.y, clip.width(), clip.height()].map(|v| v.max(0.0) as u32);
        let start = self.indices.len() as u32;
        self.indices.extend(corners);
        match self.runs.last_mut() {
            Some(run) if run.scissor == scissor && run.fill == fill => run.indices.end = start + 3,
            _ => self.runs.push(Run { scissor, indices: start..start + 3, fill }),
        }
    }

    /// Paints the ground of `part` (physical pixels) over what was there before.
    fn ground(&mut self, part: Rect) {
        let places = [part.left_top(), part.right_top(), part.right_bottom(), part.left_bottom()];
        let [a, b, c, d] =
            places.map(|p| self.corner(Vertex { pos: p / self.ppp, uv: WHITE_UV, color: Color32::BLACK }));
        self.triangle([a, b, c], part, Fill::Flat);
        self.triangle([a, c, d], part, Fill::Flat);
    }

    /// `triangles` as far as they lie in `part` (physical pixels).
    fn within(&mut self, primitives: &[ClippedPrimitive], triangles: &[Triangle], part: Rect) {
        for these in triangles.chunk_by(|a, b| a.primitive == b.primitive) {
            let job = &primitives[these[0].primitive];
            let clip = in_pixels(job.clip_rect, self.ppp).intersect(part);
            let Primitive::Mesh(mesh) = &job.primitive else { continue };
            if !clip.is_positive() {
                continue;
            }
            let mut places = vec![u32::MAX; mesh.vertices.len()];
            for triangle in these.iter().filter(|t| t.bounds.intersects(part)) {
                let corners = triangle.corners.map(|i| {
                    if places[i as usize] == u32::MAX {
                        places[i as usize] = self.corner(mesh.vertices[i as usize]);
                    }
                    places[i as usize]
                });
                self.triangle(corners, clip, triangle.fill);
            }
        }
    }
}
