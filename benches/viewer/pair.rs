//! One picture of a pair as a 3D pane shows it: model, dashed outline, veil, floor and shadow, with 50,000 points.

use std::sync::Arc;
use std::time::Instant;

use glam::{DAffine3, DVec2, DVec3};
use touch2touch::gpu::mesh::{Look, MeshItem, MeshStyle, Shading};
use touch2touch::gpu::pipelines::Pipelines;
use touch2touch::gpu::scene::{SceneData, SceneRenderer};
use touch2touch::gpu::target::Target;
use touch2touch::gpu::view::Camera;
use touch2touch::gpu::{Gpu, GpuError, wgpu};
use touch2touch::spatial::{FILLED, focus, items};
use touch2touch_core::mesh::TriMesh;

use super::{FRAMES, SIZE, quantile, sheet};

/// A wavy membrane of 88 x 70 corners, as wide as a bubble.
fn membrane() -> TriMesh {
    let (columns, rows) = (88_u32, 70_u32);
    let at = |i: u32, n: u32| (f64::from(i) / f64::from(n) - 0.5) * 0.08;
    let vertices = (0..rows).flat_map(|v| (0..columns).map(move |u| (at(u, columns), at(v, rows))));
    let vertices = vertices.map(|(y, z)| DVec3::new(0.012 + 0.004 * (60.0 * y).sin() * (50.0 * z).cos(), y, z));
    let cells = (0..rows - 1).flat_map(|v| (0..columns - 1).map(move |u| v * columns + u));
    let triangles = cells.flat_map(|i| [[i, i + columns, i + 1], [i + 1, i + columns, i + columns + 1]]);
    TriMesh { vertices: vertices.collect(), triangles: triangles.collect() }
}

/// A tool of two bars.
fn tool() -> TriMesh {
    let mut mesh = TriMesh::default();
    for turn in [0.35_f64, -0.35] {
        let first = mesh.vertices.len() as u32;
        for i in 0..8_u32 {
            let side = |bit: u32, half: f64| if i >> bit & 1 == 1 { half } else { -half };
            let p = DVec3::new(side(0, 0.01), side(1, 0.004), side(2, 0.03));
            mesh.vertices.push(DAffine3::from_rotation_x(turn).transform_point3(p));
        }
        for [a, b, c, d] in [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] {
            mesh.triangles.extend([[first + a, first + b, first + c], [first + a, first + c, first + d]]);
        }
    }
    mesh
}

fn scene() -> SceneData {
    let (ground, ink) = ([0.05; 3], [0.6; 3]);
    let tool = Arc::new(tool());
    let model = |name: &str, style: MeshStyle| MeshItem {
        name: name.into(),
        revision: 0,
        mesh: tool.clone(),
        shading: Shading::Smooth,
        values: Arc::default(),
        style,
    };
    let pose = DAffine3::from_rotation_x(0.05);
    let solid = MeshStyle {
        look: Look::Solid,
        edges: Some(items::model_edges([0.7; 3], ground)),
        ..items::outline(pose, [0.7; 3], 1.0, 1.2)
    };
    SceneData {
        clouds: vec![sheet(50_000)],
        meshes: vec![
            items::membrane("right", (0, Arc::new(membrane())), [0.3, 0.6, 0.9], 0.4),
            model("CAD", solid),
            model("true", items::truth(DAffine3::IDENTITY, [0.95; 3], 1.0, 1.2)),
        ],
        lines: items::guides(ground, ink, 0).into(),
        floor: Some(items::floor(ground, ink)),
        eye_dome: true,
        ..SceneData::default()
    }
}

/// Prints the time of a picture at rest and while the camera moves, which the window draws at half the size where a program
/// draws; returns it for the file.
pub(crate) fn pair(gpu: &Gpu) -> Result<serde_json::Value, GpuError> {
    let pipelines = Arc::new(Pipelines::new(gpu)?);
    let mut renderer = SceneRenderer::new(gpu, pipelines)?;
    let mut scene = scene();
    let mut camera = Camera::default();
    camera.frame(&focus(&scene), FILLED);
    let mut figures = Vec::new();
    for moving in [false, true] {
        scene.moving = moving;
        let size = if moving && gpu.software { SIZE.map(|n| n.div_ceil(2)) } else { SIZE };
        let target = Target::new(gpu, size)?;
        let mut times = Vec::with_capacity(FRAMES);
        for _ in 0..=FRAMES {
            camera.orbit(DVec2::new(7.0, 1.0));
            let start = Instant::now();
            renderer.render(gpu, &scene, &camera, &target)?;
            if let Err(error) = gpu.device.poll(wgpu::PollType::wait_indefinitely()) {
                eprintln!("waiting for the device: {error}");
            }
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
        // The first one sends everything.
        times.remove(0);
        figures.push(quantile(&mut times, 0.5));
    }
    let [still, moving] = [figures[0], figures[1]];
    println!("a pair with 50 000 points: {still:.1} ms at rest, {moving:.1} ms moving ({:.0}/s)", 1e3 / moving);
    Ok(serde_json::json!({ "still_ms": still, "moving_ms": moving, "moving_fps": 1e3 / moving }))
}
