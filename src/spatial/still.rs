//! Stills: a pair drawn off the screen, in parts where a texture cannot be as large as the picture.

use std::sync::Arc;

use crate::gpu::mesh::{Look, MeshItem, MeshStyle, Shading};
use crate::gpu::pipelines::Pipelines;
use crate::gpu::points::{PointColors, PointSize};
use crate::gpu::scene::{SceneData, SceneRenderer};
use crate::gpu::target::{Picture, Target};
use crate::gpu::view::{Camera, Part};
use crate::gpu::{Gpu, GpuError};
use crate::spatial::{FILLED, focus, items};
use touch2touch_core::colormap::Range;
use touch2touch_core::grid::Grid;
use touch2touch_core::picture::{mean_of_squares, unmultiplied};
use touch2touch_pipeline::compare::deviation::DISTANCE_MAP;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::still::space::{Ground, InSpace, SpacePicture, SpaceSide, SpaceView};

const WHAT: &str = "3D picture";
/// The smaller side of a 3D pane on a screen, pixels: lines, dashes and points of a still are as wide in relation to it.
const SCREEN_PX: f32 = 460.0;
/// Samples of a still along each side of a pixel, on top of the device's own.
const FINE: u32 = 2;
/// Widest still that gets them; larger ones have pixels enough.
const MOST_FINE_PX: u32 = 2048;
/// Largest texture that is drawn at once, pixels along one side: a software device has a gigabyte of them to fill.
const MOST_TEXTURE_PX: u32 = 4096;
/// Diameter of a contact point, meters.
const POINT_M: f32 = 0.000_4;
/// Opacity of a membrane.
const VEIL: f32 = 0.42;

/// Colors of a still, sRGB 0..1.
struct StillColors {
    ground: [f32; 3],
    ink: [f32; 3],
    /// Ink that hardly differs from the ground: grid and floor.
    weak: [f32; 3],
    measured: [f32; 3],
    predicted: [f32; 3],
    contact: [f32; 3],
    model: [f32; 3],
}

/// A color of 8 bits.
const fn rgb(r: u8, g: u8, b: u8) -> [f32; 3] {
    [r as f32 / 255.0, g as f32 / 255.0, b as f32 / 255.0]
}

impl StillColors {
    fn of(ground: Ground) -> Self {
        let contact = rgb(0xff, 0x4f, 0xb8);
        match ground {
            Ground::White | Ground::Transparent => Self {
                ground: [1.0; 3],
                ink: rgb(0x18, 0x1c, 0x22),
                weak: rgb(0x8a, 0x92, 0x9c),
                measured: rgb(0x3f, 0x9d, 0xd8),
                predicted: rgb(0xe8, 0x85, 0x2e),
                contact,
                model: rgb(0xd2, 0xd6, 0xd6),
            },
            Ground::Black => Self {
                ground: [0.0; 3],
                ink: rgb(0xf2, 0xf4, 0xf6),
                weak: rgb(0x6e, 0x76, 0x80),
                measured: rgb(0x56, 0xb4, 0xe9),
                predicted: rgb(0xf5, 0x93, 0x3d),
                contact,
                model: rgb(0xc4, 0xca, 0xc8),
            },
        }
    }

    fn side(&self, source: ImprintSource) -> [f32; 3] {
        match source {
            ImprintSource::Measured => self.measured,
            ImprintSource::Predicted => self.predicted,
        }
    }
}

/// Everything that a still shows; with `distance_m` in the colors of distances, which end there.
fn scene(pair: &InSpace, ground: Ground, distance_m: Option<f64>) -> SceneData {
    let colors = StillColors::of(ground);
    let mut scene = SceneData {
        background: colors.ground,
        transparent: ground == Ground::Transparent,
        eye_dome: true,
        ..SceneData::default()
    };
    let both = pair.sides.len() > 1;
    for side in &pair.sides {
        let color = if both { colors.side(side.source) } else { colors.contact };
        for (pad, points) in side.contact.entries() {
            let name = format!("{} {}", pair.rig.pad_key(pad), side.source.key());
            let mut item = items::contact(&name, (0, points.clone()), color, PointSize::Meters(POINT_M));
            let values = side.deviation.as_ref().and_then(|found| found.points.get(pad));
            if let Some((values, reach)) = values.zip(distance_m) {
                let colors = PointColors::Scalar(values.as_slice().into());
                items::paint_points(&mut item, colors, DISTANCE_MAP, Range::symmetric(reach as f32));
            }
            scene.clouds.push(item);
        }
    }
    // Two membranes of one finger would hide each other.
    for side in pair.sides.iter().take(1) {
        for (pad, mesh) in side.membranes.entries() {
            let name = pair.rig.pad_key(pad);
            scene.meshes.push(items::membrane(&name, (0, mesh.clone()), colors.side(side.source), VEIL));
        }
    }
    models(pair, &colors, distance_m, &mut scene);
    let floor = items::floor(colors.ground, colors.weak);
    scene.floor = Some(match ground {
        Ground::Transparent => crate::gpu::floor::Floor { opacity: 0.0, ..floor },
        _ => floor,
    });
    if ground != Ground::Transparent {
        let [grid, _] = items::guides(colors.ground, colors.weak, 0);
        scene.lines.push(grid);
    }
    scene
}

/// The model where the first side has it, as outlines where else it could be.
fn models(pair: &InSpace, colors: &StillColors, distance_m: Option<f64>, scene: &mut SceneData) {
    let Some(mesh) = &pair.model else { return };
    let item = |name: &str, style: MeshStyle| MeshItem {
        name: name.into(),
        revision: 0,
        mesh: mesh.clone(),
        shading: Shading::Smooth,
        values: Arc::default(),
        style,
    };
    for (i, SpaceSide { source, pose, deviation, .. }) in pair.sides.iter().enumerate() {
        let Some(world_from_mesh) = pose.as_ref().map(|pose| pose.grasp_from_object.to_affine()) else { continue };
        let name = format!("CAD {}", source.key());
        if i > 0 {
            scene.meshes.push(item(&name, items::outline(world_from_mesh, colors.side(*source), 1.0, 1.6)));
            continue;
        }
        let style = MeshStyle {
            color: colors.model,
            look: Look::Solid,
            edges: Some(items::model_edges(colors.model, colors.ground)),
            ..items::outline(world_from_mesh, colors.model, 1.0, 1.2)
        };
        let mut model = item(&name, style);
        if let Some((found, reach)) = deviation.as_ref().zip(distance_m) {
            let painted = (Arc::new(found.surface.mesh.clone()), found.surface.values.as_slice().into());
            items::model_by_distance(&mut model, (0, painted), reach as f32);
        }
        scene.meshes.push(model);
    }
    if let Some(truth) = pair.truth {
        scene.meshes.push(item("CAD true", items::truth(truth.to_affine(), colors.ink, 0.9, 1.2)));
    }
}

/// A pair on a device of its own, which takes its geometry once.
pub struct Still {
    gpu: Gpu,
    renderer: SceneRenderer,
    target: Target,
    scene: SceneData,
    camera: Camera,
    size: [u32; 2],
}

impl Still {
    /// Frames a pair.
    ///
    /// # Errors
    /// If there is no device, or it cannot draw.
    pub fn new(pair: &InSpace, view: &SpaceView) -> Result<Self, TaskError> {
        let scene = scene(pair, view.ground, view.distance_m);
        let (yaw_rad, pitch_rad) = (view.angles.yaw_deg.to_radians(), view.angles.pitch_deg.to_radians());
        let mut camera = Camera { yaw_rad, pitch_rad, ..Camera::default() };
        camera.frame(&focus(&scene), FILLED);
        Self::of_scene(scene, camera, view.size_px).map_err(failed)
    }

    /// On the best device that there is, without a window.
    ///
    /// # Errors
    /// If there is none, or it cannot draw.
    pub fn of_scene(mut scene: SceneData, camera: Camera, size: [u32; 2]) -> Result<Self, GpuError> {
        scene.unit_px = fine(size) as f32 * size[0].min(size[1]) as f32 / SCREEN_PX;
        let gpu = Gpu::headless()?.smooth();
        let renderer = SceneRenderer::new(&gpu, Arc::new(Pipelines::new(&gpu)?))?;
        let target = Target::new(&gpu, [1, 1])?;
        Ok(Self { gpu, renderer, target, scene, camera, size })
    }

    /// Draws it, turned about the vertical after it was framed.
    ///
    /// # Errors
    /// If the device fails.
    pub fn turned(&mut self, turned_deg: f64) -> Result<SpacePicture, TaskError> {
        let camera = Camera { yaw_rad: self.camera.yaw_rad + turned_deg.to_radians(), ..self.camera };
        let drawn = self.picture(&camera).map_err(failed)?;
        let [width, height] = drawn.size.map(|n| n as usize);
        let pixels = Grid::from_vec(width, height, unmultiplied(&drawn.rgba));
        let pixels = pixels.map_err(|err| TaskError::from_error(WHAT, &err))?;
        Ok(SpacePicture { pixels, px_per_m: camera.px_per_m(self.size) })
    }

    /// Draws it from a camera: premultiplied, as the device has it.
    ///
    /// # Errors
    /// If the device fails.
    pub fn picture(&mut self, camera: &Camera) -> Result<Picture, GpuError> {
        let Self { gpu, renderer, target, scene, size, .. } = self;
        let fine = fine(*size);
        let whole = size.map(|n| n * fine);
        // What shades a pixel from around it must not end at the border of a part.
        let margin = ((0.1 * f64::from(whole[0].min(whole[1]))).ceil() as u32).next_multiple_of(fine);
        let texture = MOST_TEXTURE_PX.min(gpu.device.limits().max_texture_dimension_2d);
        // What fits is one part.
        let inner = match whole[0].max(whole[1]) <= texture {
            true => texture,
            false => (texture.saturating_sub(2 * margin).max(256) / fine) * fine,
        };
        let mut out = Picture { size: *size, rgba: vec![0; size[0] as usize * size[1] as usize * 4] };
        for top in (0..whole[1]).step_by(inner as usize) {
            for left in (0..whole[0]).step_by(inner as usize) {
                let at = [left, top].map(|n| n.saturating_sub(margin));
                let end: [u32; 2] = std::array::from_fn(|i| ([left, top][i] + inner + margin).min(whole[i]));
                let part = Part { of: whole, at, size: [end[0] - at[0], end[1] - at[1]] };
                target.resize(gpu, part.size)?;
                renderer.render(gpu, scene, (camera, part), target)?;
                lay(&mut out, &target.read(gpu)?, part, ([left, top], inner), fine);
            }
        }
        Ok(out)
    }
}

fn failed(err: GpuError) -> TaskError {
    TaskError::new(WHAT, err.to_string())
}

/// Samples along each side of a pixel of a still of this size.
fn fine(size: [u32; 2]) -> u32 {
    if size[0].max(size[1]) <= MOST_FINE_PX { FINE } else { 1 }
}

/// Takes the inner pixels of a part over, each the mean of `fine` x `fine`.
fn lay(out: &mut Picture, drawn: &Picture, part: Part, (corner, inner): ([u32; 2], u32), fine: u32) {
    let [width, height] = out.size;
    let from = corner.map(|n| n / fine);
    let to = [(corner[0] + inner).div_ceil(fine).min(width), (corner[1] + inner).div_ceil(fine).min(height)];
    let pixels = mean_of_squares(&drawn.rgba, drawn.size[0] as usize, fine as usize);
    let row = (drawn.size[0] / fine) as usize * 4;
    let [left, top] = [0, 1].map(|i| (from[i] - part.at[i] / fine) as usize);
    let bytes = (to[0] - from[0]) as usize * 4;
    for y in from[1]..to[1] {
        let at = (y as usize * width as usize + from[0] as usize) * 4;
        let start = (top + (y - from[1]) as usize) * row + left * 4;
        out.rgba[at..at + bytes].copy_from_slice(&pixels[start..start + bytes]);
    }
}
