//! The renderer on a real or software adapter: properties of single pixels, never whole pictures.

#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "helpers of tests, too")]

mod looks;

use std::sync::Arc;

use futures_lite::future::block_on;
use glam::{DAffine3, DVec2, DVec3};
use touch2touch::gpu::context::COLOR_FORMAT;
use touch2touch::gpu::edges::EdgeStyle;
use touch2touch::gpu::lines::{LinesItem, LinesStyle, Segment};
use touch2touch::gpu::mesh::{Look, MeshItem, MeshStyle, Shading};
use touch2touch::gpu::pipelines::Pipelines;
use touch2touch::gpu::points::{CloudItem, CloudStyle, PointColors, PointSize};
use touch2touch::gpu::raster::Raster;
use touch2touch::gpu::scene::{SceneData, SceneRenderer};
use touch2touch::gpu::target::{Picture, Target};
use touch2touch::gpu::view::{Camera, Part};
use touch2touch::gpu::{Gpu, GpuError, guides, wgpu};
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::frames::CameraPreset;
use touch2touch_core::mesh::TriMesh;

use crate::support;

const SIZE: [u32; 2] = [320, 240];
const BACKGROUND: [u8; 3] = [26, 28, 33];

/// One view, ready to draw.
struct View {
    gpu: Gpu,
    renderer: SceneRenderer,
    target: Target,
    camera: Camera,
}

impl View {
    /// With the smoothest edges that the adapter can draw.
    fn new() -> Option<Self> {
        Some(Self::on(support::gpu()?.smooth()))
    }

    fn on(gpu: Gpu) -> Self {
        let pipelines = Arc::new(Pipelines::new(&gpu).unwrap());
        let renderer = SceneRenderer::new(&gpu, pipelines).unwrap();
        let target = Target::new(&gpu, SIZE).unwrap();
        Self { gpu, renderer, target, camera: Camera::default() }
    }

    fn render(&mut self, scene: &SceneData) -> bool {
        let part = Part::whole(self.target.size());
        self.renderer.render(&self.gpu, scene, (&self.camera, part), &self.target).unwrap()
    }

    fn picture(&mut self, scene: &SceneData) -> Picture {
        self.render(scene);
        self.target.read(&self.gpu).unwrap()
    }

    /// The pixel that shows a point in the world.
    fn pixel(&self, p: DVec3) -> [u32; 2] {
        let (px, _) = self.camera.project(p, self.target.size()).unwrap();
        [px.x as u32, px.y as u32]
    }
}

fn scene() -> SceneData {
    SceneData { background: BACKGROUND.map(|b| f32::from(b) / 255.0), ..SceneData::default() }
}

fn cloud(points: &[DVec3], colors: &[[u8; 3]], size: PointSize) -> CloudItem {
    CloudItem {
        name: "cloud".into(),
        revision: 0,
        points: points.into(),
        colors: PointColors::PerPoint(colors.into()),
        style: CloudStyle { size, ..CloudStyle::default() },
    }
}

/// A square of side `2 * half` in the plane through `center` that faces `normal`.
fn square(center: DVec3, normal: DVec3, half: f64) -> TriMesh {
    let (u, v) = normal.any_orthonormal_pair();
    let corner = |a: f64, b: f64| center + (u * a + v * b) * half;
    TriMesh {
        vertices: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

fn mesh_item(mesh: TriMesh, style: MeshStyle) -> MeshItem {
    MeshItem {
        name: "mesh".into(),
        revision: 0,
        mesh: Arc::new(mesh),
        shading: Shading::Smooth,
        values: Arc::default(),
        style,
    }
}

/// Pixels that are not background.
fn inked(picture: &Picture) -> Vec<[u32; 2]> {
    let [w, h] = picture.size;
    let all = (0..h).flat_map(|y| (0..w).map(move |x| [x, y]));
    all.filter(|[x, y]| picture.rgb(*x, *y) != Some(BACKGROUND)).collect()
}

#[test]
fn a_point_appears_at_its_pixel_in_its_color_and_size() {
    let Some(mut view) = View::new() else { return };
    for orthographic in [false, true] {
        for preset in [None, Some(CameraPreset::Left), Some(CameraPreset::Top)] {
            view.camera = Camera { orthographic, ..Camera::default() };
            if let Some(preset) = preset {
                view.camera.look_from(preset);
            }
            let world_from_points = DAffine3::from_translation(DVec3::new(0.001, 0.008, -0.006));
            let p = DVec3::new(0.004, 0.003, 0.002);
            let mut item = cloud(&[DVec3::NAN, p], &[[255, 0, 0], [10, 200, 90]], PointSize::Px(9.0));
            item.revision = u64::from(orthographic) * 10 + preset.map_or(0, |p| 1 + p as u64);
            item.style.world_from_points = world_from_points;
            let picture = view.picture(&SceneData { clouds: vec![item], ..scene() });
            let (at, _) = view.camera.project(world_from_points.transform_point3(p), SIZE).unwrap();
            assert_eq!(picture.rgb(at.x as u32, at.y as u32), Some([10, 200, 90]));
            let ink = inked(&picture);
            // A disc of 9 px has 63.6 px; multisampling and its rim give or take a ring of pixels.
            assert!((50..=90).contains(&ink.len()), "{}", ink.len());
            let center = ink.iter().fold(DVec2::ZERO, |s, [x, y]| s + DVec2::new(f64::from(*x), f64::from(*y)));
            let center = center / ink.len() as f64 + 0.5;
            assert!((center - at).length() < 0.6, "{center} for {at}");
        }
    }
}

#[test]
fn a_solid_mesh_hides_what_is_behind_and_an_xray_does_not() {
    let Some(mut view) = View::new() else { return };
    let back = view.camera.axes()[2];
    let behind = cloud(&[back * -0.01], &[[255, 0, 0]], PointSize::Px(9.0));
    let before = cloud(&[back * 0.01], &[[255, 0, 0]], PointSize::Px(9.0));
    let style = MeshStyle { color: [0.2, 0.4, 0.9], ..MeshStyle::default() };
    let wall = mesh_item(square(DVec3::ZERO, back, 0.02), style);
    let [x, y] = view.pixel(DVec3::ZERO);
    let look = |view: &mut View, cloud: &CloudItem, revision, mesh: MeshItem| {
        let clouds = vec![CloudItem { revision, ..cloud.clone() }];
        view.picture(&SceneData { clouds, meshes: vec![mesh], ..scene() }).rgb(x, y).unwrap()
    };
    let [r, g, b] = look(&mut view, &behind, 1, wall.clone());
    assert!(b > 150 && r < 80 && g < b, "the wall: {r} {g} {b}");
    assert_eq!(look(&mut view, &before, 2, wall.clone()), [255, 0, 0]);
    let xray = MeshItem { style: MeshStyle { opacity: 0.3, look: Look::XRay, ..style }, ..wall.clone() };
    let [r, _, b] = look(&mut view, &behind, 3, xray.clone());
    assert!(r > 150 && b > 20, "the point through the wall: {r} {b}");
    let half = MeshItem { style: MeshStyle { opacity: 0.5, ..style }, ..wall.clone() };
    let [r, _, b] = look(&mut view, &behind, 4, half);
    assert!((90..170).contains(&r) && b > 60, "tinted: {r} {b}");
    // Moved away by its pose alone.
    let moved = MeshStyle { world_from_mesh: DAffine3::from_translation(back * -0.05), ..style };
    assert_eq!(look(&mut view, &behind, 5, MeshItem { style: moved, ..wall }), [255, 0, 0]);
}

#[test]
fn grid_and_axes_are_where_they_belong() {
    let Some(mut view) = View::new() else { return };
    let lines = |name: &str, segments: Vec<Segment>, overlay| LinesItem {
        name: name.into(),
        revision: 0,
        segments: segments.into(),
        style: LinesStyle { width_px: 3.0, overlay, ..LinesStyle::default() },
    };
    let floor = DVec3::new(0.0, 0.0, 0.02);
    let mut scene = SceneData {
        lines: vec![
            lines("grid", guides::grid(floor, [DVec3::X, DVec3::Y], 0.01, 2, [200; 3]), false),
            lines("axes", guides::axes(DVec3::ZERO, 0.02), false),
        ],
        ..scene()
    };
    let picture = view.picture(&scene);
    for axis in 0..3 {
        let [x, y] = view.pixel(DVec3::AXES[axis] * 0.01);
        let [r, g, b, _] = guides::AXIS_COLORS[axis];
        assert_eq!(picture.rgb(x, y), Some([r, g, b]));
    }
    for p in [DVec3::new(0.013, 0.01, 0.02), DVec3::new(-0.02, -0.007, 0.02)] {
        let [x, y] = view.pixel(p);
        assert_ne!(picture.rgb(x, y), Some(BACKGROUND), "a grid line");
    }
    let [x, y] = view.pixel(DVec3::new(0.015, 0.005, 0.02));
    assert_eq!(picture.rgb(x, y), Some(BACKGROUND), "inside a cell");
    // Lines hide behind a mesh, overlay lines do not.
    let back = view.camera.axes()[2];
    scene.meshes =
        vec![mesh_item(square(back * 0.04, back, 0.01), MeshStyle { color: [0.0; 3], ..Default::default() })];
    let at = |picture: &Picture, p| {
        let [x, y] = view.camera.project(p, SIZE).map(|(px, _)| [px.x as u32, px.y as u32]).unwrap();
        picture.rgb(x, y).unwrap()
    };
    let (x_axis, whole) = (DVec3::X * 0.004, Part::whole(SIZE));
    view.renderer.render(&view.gpu, &scene, (&view.camera, whole), &view.target).unwrap();
    let [r, g, b] = at(&view.target.read(&view.gpu).unwrap(), x_axis);
    assert!(r == g && g == b && r < 80, "the black mesh and what it mirrors: {r} {g} {b}");
    scene.lines[1].style.overlay = true;
    view.renderer.render(&view.gpu, &scene, (&view.camera, whole), &view.target).unwrap();
    assert_eq!(at(&view.target.read(&view.gpu).unwrap(), x_axis), [226, 88, 80]);
}

#[test]
fn the_color_maps_of_gpu_and_cpu_are_the_same() {
    let Some(mut view) = View::new() else { return };
    view.camera.orthographic = true;
    view.camera.look_from(CameraPreset::Front);
    let mut values: Vec<f32> = (0..=60).map(|i| -0.02 + 0.04 * i as f32 / 60.0).collect();
    values.extend([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1.0]);
    let place = |i: usize| {
        let [column, row] = [i % 10, i / 10].map(|n| n as f64);
        DVec3::new((column - 4.5) * 0.004, 0.0, (row - 3.0) * 0.004)
    };
    let points: Arc<[DVec3]> = (0..values.len()).map(place).collect();
    for (revision, (map, range)) in [
        (ColorMap::Viridis, Range { lo: -0.02, hi: 0.02 }),
        (ColorMap::Diverging, Range::symmetric(0.015)),
        (ColorMap::Gray, Range { lo: -0.01, hi: 0.02 }),
        (ColorMap::Viridis, Range { lo: 0.01, hi: 0.01 }),
        (ColorMap::Viridis, Range { lo: f32::NAN, hi: 0.01 }),
    ]
    .into_iter()
    .enumerate()
    {
        let item = CloudItem {
            name: "scale".into(),
            revision: revision as u64,
            points: points.clone(),
            colors: PointColors::Scalar(values.clone().into()),
            style: CloudStyle { map, range, size: PointSize::Px(7.0), ..CloudStyle::default() },
        };
        let picture = view.picture(&SceneData { clouds: vec![item], ..scene() });
        for (i, value) in values.iter().enumerate() {
            let [x, y] = view.pixel(place(i));
            let (gpu, cpu) = (picture.rgb(x, y).unwrap(), map.rgb8(range.unit(*value)));
            for (a, b) in gpu.iter().zip(cpu) {
                // One step: the device may round a half to the other side.
                assert!(a.abs_diff(b) <= 1, "{map:?} {value}: {gpu:?} on the GPU, {cpu:?} on the CPU");
            }
        }
    }
}

#[test]
fn an_unchanged_scene_costs_nothing_and_each_change_costs_what_it_must() {
    let Some(mut view) = View::new() else { return };
    let mut data = SceneData {
        clouds: vec![cloud(&[DVec3::ZERO], &[[255; 3]], PointSize::Px(5.0))],
        meshes: vec![mesh_item(square(DVec3::ZERO, DVec3::X, 0.01), MeshStyle::default())],
        lines: vec![LinesItem {
            name: "axes".into(),
            revision: 0,
            segments: guides::axes(DVec3::ZERO, 0.01).into(),
            style: LinesStyle::default(),
        }],
        ..scene()
    };
    let step = |view: &mut View, data: &SceneData| {
        let before = view.renderer.counters();
        let drawn = view.render(data);
        let after = view.renderer.counters();
        let did = [after.uploads - before.uploads, after.uniforms - before.uniforms, after.renders - before.renders];
        assert_eq!(drawn, did[2] == 1);
        did
    };
    assert_eq!(step(&mut view, &data), [3, 4, 1], "the first picture sends everything");
    assert_eq!(step(&mut view, &data), [0, 0, 0]);
    assert_eq!(step(&mut view, &data.clone()), [0, 0, 0], "an equal scene made anew is the same scene");
    view.camera.orbit(DVec2::new(5.0, 0.0));
    assert_eq!(step(&mut view, &data), [0, 1, 1], "the camera alone");
    data.meshes[0].style.world_from_mesh = DAffine3::from_rotation_x(0.1);
    assert_eq!(step(&mut view, &data), [0, 1, 1], "a pose moves a mesh without sending it again");
    data.clouds[0].style.color = [0.5; 3];
    assert_eq!(step(&mut view, &data), [0, 1, 1], "a color");
    data.clouds[0].revision = 1;
    assert_eq!(step(&mut view, &data), [1, 0, 1], "new points");
    data.moving = true;
    assert_eq!(step(&mut view, &data), [0, 0, 0], "few enough points to draw them all while moving");
    data.background = [0.0; 3];
    assert_eq!(step(&mut view, &data), [0, 0, 1]);
    assert!(!view.target.resize(&view.gpu, SIZE).unwrap());
    assert_eq!(step(&mut view, &data), [0, 0, 0]);
    assert!(view.target.resize(&view.gpu, [100, 80]).unwrap());
    assert_eq!(step(&mut view, &data), [0, 1, 1], "another size");
    data.meshes.clear();
    assert_eq!(step(&mut view, &data), [0, 0, 1], "a mesh less");
    assert_eq!(step(&mut view, &data), [0, 0, 0]);
}

#[test]
fn empty_and_impossible_input_is_a_picture_or_an_error_not_a_panic() {
    let Some(mut view) = View::new() else { return };
    let nothing = cloud(&[], &[], PointSize::Px(f32::NAN));
    let mut bad = cloud(&[DVec3::splat(f64::INFINITY), DVec3::ZERO], &[], PointSize::Px(5.0));
    bad.name = "bad".into();
    let empty_mesh = mesh_item(TriMesh::default(), MeshStyle::default());
    let picture = view.picture(&SceneData { clouds: vec![nothing, bad], meshes: vec![empty_mesh], ..scene() });
    let [x, y] = view.pixel(DVec3::ZERO);
    assert_eq!(picture.rgb(x, y), Some([107; 3]), "a point without a color is drawn as NaN");
    view.target.resize(&view.gpu, [0, 0]).unwrap();
    assert_eq!(view.target.size(), [1, 1]);
    assert_eq!(view.picture(&scene()).rgba.len(), 4);
}

#[test]
fn a_device_without_storage_buffers_paints_the_window_and_says_what_the_3d_views_lack() {
    let Some(_adapter) = support::gpu() else { return };
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let (adapter, device, queue) = block_on(async {
        let adapter = instance.request_adapter(&wgpu::RequestAdapterOptions::default()).await.unwrap();
        // What the toolkit asks a GL driver for.
        let required_limits = wgpu::Limits::downlevel_webgl2_defaults();
        let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
        let (device, queue) = adapter.request_device(&descriptor).await.unwrap();
        (adapter, device, queue)
    });
    let gpu = Gpu::new(&adapter, device, queue);
    Raster::new(&gpu, COLOR_FORMAT).unwrap().prove(&gpu, COLOR_FORMAT).unwrap();
    let why = Pipelines::new(&gpu).unwrap_err();
    assert!(matches!(&why, GpuError::NoStorage { .. }), "{why}");
    assert!(why.to_string().contains("mesa-vulkan-drivers"), "{why}");
}

/// A sphere around the origin; its corners are shared.
fn sphere(radius: f64, rings: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    let around = 2 * rings;
    for i in 0..=rings {
        let (sp, cp) = (std::f64::consts::PI * f64::from(i) / f64::from(rings)).sin_cos();
        for j in 0..around {
            let (st, ct) = (std::f64::consts::TAU * f64::from(j) / f64::from(around)).sin_cos();
            mesh.vertices.push(DVec3::new(sp * ct, sp * st, cp) * radius);
        }
    }
    for i in 0..rings {
        for j in 0..around {
            let at = |i: u32, j: u32| i * around + j % around;
            mesh.triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            mesh.triangles.push([at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]);
        }
    }
    mesh
}

/// sRGB to light and back.
fn encoded(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

fn decoded(srgb: f64) -> f64 {
    if srgb <= 0.040_45 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

/// The unit vector from a point towards the eye.
fn to_eye(camera: &Camera, p: DVec3) -> DVec3 {
    if camera.orthographic { camera.axes()[2] } else { (camera.eye() - p).normalize() }
}

/// Towards the key light.
fn key_light(camera: &Camera) -> DVec3 {
    let [right, up, back] = camera.axes();
    (back + 0.55 * up - 0.45 * right).normalize()
}

/// Twin of the function in `shaders/common/light.wgsl`.
fn light_on(normal: DVec3, camera: &Camera) -> f64 {
    let facing = normal.dot(key_light(camera));
    let key = ((facing + 0.2) / 1.2).clamp(0.0, 1.0);
    let above = 0.5 + 0.5 * normal.dot(camera.axes()[1]);
    0.14 + 0.20 * above * above + 0.62 * key.powf(1.5) + 0.08 * (-facing).clamp(0.0, 1.0)
}

/// Twin of the function in `shaders/common/light.wgsl`.
fn gloss_on(normal: DVec3, to_eye: DVec3, camera: &Camera) -> f64 {
    let halfway = normal.dot((key_light(camera) + to_eye).normalize()).clamp(0.0, 1.0);
    0.03 * halfway.powi(8) + 0.11 * halfway.powi(40)
}

#[test]
fn a_sphere_is_shaded_as_the_light_says() {
    let Some(mut view) = View::new() else { return };
    let style = MeshStyle { color: [0.8, 0.5, 0.3], ..MeshStyle::default() };
    for (revision, orthographic) in [(1, true), (2, false)] {
        view.camera = Camera { orthographic, ..Camera::default() };
        let item = MeshItem { revision, ..mesh_item(sphere(0.02, 64), style) };
        let picture = view.picture(&SceneData { meshes: vec![item], ..scene() });
        let [right, up, back] = view.camera.axes();
        let mut brightest = (0u8, 0.0);
        for (a, b) in [(0.0, 0.0), (-0.5, 0.5), (0.5, 0.3), (0.4, -0.6), (-0.2, -0.7)] {
            let normal: DVec3 = (right * a + up * b + back * (1.0f64 - a * a - b * b).sqrt()).normalize();
            let [x, y] = view.pixel(normal * 0.02);
            let light = light_on(normal, &view.camera);
            let gloss = gloss_on(normal, to_eye(&view.camera, normal * 0.02), &view.camera);
            let found = picture.rgb(x, y).unwrap();
            for (channel, color) in style.color.into_iter().enumerate() {
                let wanted = 255.0 * encoded(decoded(f64::from(color)) * light + gloss);
                // A pixel of the sphere spans a degree or two.
                assert!((f64::from(found[channel]) - wanted).abs() < 6.0, "{a} {b}: {found:?}, {wanted} ({light})");
            }
            if found[0] > brightest.0 {
                brightest = (found[0], a);
            }
        }
        assert!(brightest.1 < 0.0, "the key light comes from the left");
    }
}

#[test]
fn distances_on_a_surface_have_the_colors_of_their_cpu_twin() {
    let Some(mut view) = View::new() else { return };
    let back = view.camera.axes()[2];
    let range = Range { lo: -0.001, hi: 0.001 };
    let map = ColorMap::Diverging;
    for (revision, value) in [(1, -0.0012f32), (2, -0.0005), (3, 0.0), (4, 0.0004), (5, 0.002), (6, f32::NAN)] {
        let mesh = square(DVec3::ZERO, back, 0.02);
        let style = MeshStyle { color: [0.5; 3], map, range, ..MeshStyle::default() };
        let values: Arc<[f32]> = vec![value; mesh.vertices.len()].into();
        let item = MeshItem { revision, values, ..mesh_item(mesh, style) };
        let [x, y] = view.pixel(DVec3::ZERO);
        let found = view.picture(&SceneData { meshes: vec![item], ..scene() }).rgb(x, y).unwrap();
        let light = light_on(back, &view.camera);
        let gloss = gloss_on(back, back, &view.camera);
        let (color, light, gloss) = match value.is_nan() {
            true => ([0.5; 3], light, gloss),
            false => (map.rgb(range.unit(value)), 0.5 + 0.5 * light, 0.0),
        };
        for (found, color) in found.into_iter().zip(color) {
            let wanted = 255.0 * encoded(decoded(f64::from(color)) * light + gloss);
            assert!((f64::from(found) - wanted).abs() < 3.0, "{value}: {found} {wanted}");
        }
    }
}

#[test]
fn an_outline_shows_edges_alone_and_faintly_what_is_behind() {
    let Some(mut view) = View::new() else { return };
    let back = view.camera.axes()[2];
    let edges = EdgeStyle { color: [0.0, 1.0, 0.0], opacity: 1.0, width_px: 3.0, creases: true, dash_px: 0.0 };
    let style = MeshStyle { look: Look::Outline, edges: Some(edges), ..MeshStyle::default() };
    let item = MeshItem { name: "outline".into(), ..mesh_item(square(DVec3::ZERO, back, 0.02), style) };
    let (v, _) = back.any_orthonormal_pair();
    let [inside, on] = [view.pixel(DVec3::ZERO), view.pixel(v * 0.02)];
    let alone = view.picture(&SceneData { meshes: vec![item.clone()], ..scene() });
    assert_eq!(alone.rgb(inside[0], inside[1]), Some(BACKGROUND), "no face");
    assert_eq!(alone.rgb(on[0], on[1]), Some([0, 255, 0]), "an edge");
    let wall = MeshStyle { color: [0.6; 3], ..MeshStyle::default() };
    let wall = MeshItem { name: "wall".into(), ..mesh_item(square(back * 0.01, back, 0.05), wall) };
    let meshes = vec![wall, item];
    let hidden = view.picture(&SceneData { meshes: meshes.clone(), ..scene() }).rgb(on[0], on[1]).unwrap();
    assert!(hidden[1] > hidden[0] + 20 && hidden[0] > 40, "faint: {hidden:?}");
    let with_depth = view.picture(&SceneData { meshes, eye_dome: true, ..scene() }).rgb(on[0], on[1]).unwrap();
    assert_eq!(with_depth, hidden, "the same in the picture of two passes");
    // A ball has its silhouette, and no edge of its facets.
    let ball = MeshItem { name: "ball".into(), ..mesh_item(sphere(0.02, 48), style) };
    let ball = view.picture(&SceneData { meshes: vec![ball], ..scene() });
    assert_eq!(ball.rgb(inside[0], inside[1]), Some(BACKGROUND));
    let ring = inked(&ball).len();
    assert!((150..2500).contains(&ring), "{ring} pixels of a ring");
}
