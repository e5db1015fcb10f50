#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a bench prints its table")]
//! Time of frames: `cargo bench --features ui-test --bench viewer [-- --json FILE]`.
//!
//! The whole studio, painted whole and where something changed (`viewer/window.rs`); its memory after paging; and one
//! picture of a 3D view by number of points, still and moving, and of a pair as a pane shows it (`viewer/pair.rs`); strokes from the pointer to the screen, and a thousand pairs
//! paged through (`viewer/labeling.rs`); scores of 32,256 pairs (`viewer/rows.rs`). `-- frames`, `-- memory`, `-- points`, `-- pair`, `-- strokes`, `-- paging`, `-- rows` runs one of them.
//!
//! Still = all points, moving = as many as the renderer allows while the camera moves, unchanged = the same call
//! again: nothing may be drawn. Times include waiting for the device.

#[path = "viewer/labeling.rs"]
mod labeling;
#[path = "viewer/pair.rs"]
mod pair;
#[path = "viewer/rows.rs"]
mod rows;
#[path = "viewer/window.rs"]
mod window;

use std::sync::Arc;
use std::time::Instant;

use glam::{DVec2, DVec3};
use touch2touch::gpu::pipelines::Pipelines;
use touch2touch::gpu::points::{CloudItem, CloudStyle, PointColors, PointSize};
use touch2touch::gpu::scene::{SceneData, SceneRenderer};
use touch2touch::gpu::target::Target;
use touch2touch::gpu::view::Camera;
use touch2touch::gpu::{Gpu, GpuError, wgpu};

/// A 3D pane on a full-HD screen.
const SIZE: [u32; 2] = [1000, 760];
/// Pictures per figure.
const FRAMES: usize = 20;

/// A wavy sheet of about `count` points with a value each, as large as a bubble.
fn sheet(count: usize) -> CloudItem {
    let side = (count as f64).sqrt().round() as usize;
    let at = |i: usize| (i as f64 / side as f64 - 0.5) * 0.08;
    let points: Vec<DVec3> = (0..side * side)
        .map(|i| {
            let (y, z) = (at(i % side), at(i / side));
            DVec3::new(0.01 * (60.0 * y).sin() * (50.0 * z).cos(), y, z)
        })
        .collect();
    let values: Vec<f32> = points.iter().map(|p| (p.x * 50.0 + 0.5) as f32).collect();
    CloudItem {
        name: "sheet".into(),
        revision: count as u64,
        points: points.into(),
        colors: PointColors::Scalar(values.into()),
        style: CloudStyle { size: PointSize::Meters(0.000_3), ..CloudStyle::default() },
    }
}

fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q).round() as usize]
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let gpu = match Gpu::headless() {
        Ok(gpu) => gpu,
        Err(error) => {
            eprintln!("left out: {error}");
            return Ok(());
        }
    };
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let json = words.iter().position(|word| word == "--json").and_then(|at| words.get(at + 1));
    let parts = ["memory", "frames", "strokes", "paging", "rows", "pair", "points"];
    let asked: Vec<&str> = parts.into_iter().filter(|part| words.iter().any(|word| word == part)).collect();
    let mut report = serde_json::Map::new();
    report.insert("adapter".into(), gpu.adapter.clone().into());
    // Memory first: what the others leave behind would count.
    for part in if asked.is_empty() { parts.to_vec() } else { asked } {
        let found = match part {
            "memory" => window::memory()?,
            "frames" => window::frames()?,
            "strokes" => labeling::strokes()?,
            "paging" => labeling::paging()?,
            "rows" => rows::rows()?,
            "pair" => pair::pair(&gpu)?,
            _ => points(&gpu)?,
        };
        report.insert(part.into(), found);
    }
    if let Some(path) = json {
        std::fs::write(path, serde_json::to_string_pretty(&report)?)?;
    }
    Ok(())
}

/// Prints the table of 3D pictures; returns it for the file.
fn points(gpu: &Gpu) -> Result<serde_json::Value, GpuError> {
    let mut rows = Vec::new();
    let pipelines = Arc::new(Pipelines::new(gpu)?);
    println!("{}, {} x {} pixels, {FRAMES} pictures each", gpu.adapter, SIZE[0], SIZE[1]);
    println!(
        "{:>9} {:>10} {:>16} {:>16} {:>9} {:>9} {:>13}",
        "points", "upload ms", "still ms (p95)", "moving ms (p95)", "moving/s", "drawn", "unchanged ms"
    );
    for count in [50_000, 200_000, 1_000_000] {
        let mut renderer = SceneRenderer::new(gpu, pipelines.clone())?;
        let target = Target::new(gpu, SIZE)?;
        let mut camera = Camera::default();
        let mut scene = SceneData { clouds: vec![sheet(count)], ..SceneData::default() };
        let points = scene.clouds[0].points.len();
        if let Some(bounds) = scene.bounds() {
            camera.fit(bounds, SIZE);
        }
        let mut picture = |scene: &SceneData, camera: &Camera| -> Result<(f64, bool), GpuError> {
            let start = Instant::now();
            let drawn = renderer.render(gpu, scene, camera, &target)?;
            // A device that is lost shows in the next call.
            if let Err(error) = gpu.device.poll(wgpu::PollType::wait_indefinitely()) {
                eprintln!("waiting for the device: {error}");
            }
            Ok((start.elapsed().as_secs_f64() * 1e3, drawn))
        };
        let (first, _) = picture(&scene, &camera)?;
        let mut figures = Vec::new();
        for moving in [false, true] {
            scene.moving = moving;
            let mut times = Vec::with_capacity(FRAMES);
            for _ in 0..FRAMES {
                camera.orbit(DVec2::new(7.0, 1.0));
                times.push(picture(&scene, &camera)?.0);
            }
            figures.push([quantile(&mut times, 0.5), quantile(&mut times, 0.95)]);
        }
        let (unchanged, drawn) = picture(&scene, &camera)?;
        assert!(!drawn, "a picture that did not change was drawn again");
        let budget = renderer.moving_points as usize;
        let shown = points.div_ceil(points.div_ceil(budget.max(1)).max(1));
        let [still, moving] = [figures[0], figures[1]];
        let text = |[half, most]: [f64; 2]| format!("{half:.1} ({most:.1})");
        println!(
            "{points:>9} {first:>10.1} {:>16} {:>16} {:>9.0} {shown:>9} {unchanged:>13.3}",
            text(still),
            text(moving),
            1e3 / moving[0]
        );
        rows.push(serde_json::json!({
            "points": points, "upload_ms": first, "still_ms": still[0], "moving_ms": moving[0],
            "moving_fps": 1e3 / moving[0], "drawn": shown, "unchanged_ms": unchanged,
        }));
    }
    Ok(rows.into())
}
