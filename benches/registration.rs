#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a bench prints its table")]
//! Time and error of the registration engines side by side: `cargo bench --no-default-features [-- FOLDER]`.
//!
//! FOLDER holds cases in the form of the reference grasps (`case_*.npz`, `tool_NN.stl`); without one, the folder
//! `pose-cases` of the reference data is used.

#[allow(dead_code, clippy::unwrap_used, reason = "shared with the tests, which use more of it")]
#[path = "../tests/support.rs"]
mod support;

use std::path::PathBuf;
use std::time::Instant;

use glam::DVec2;
use touch2touch::domain::align::{AlignConfig, AlignReport, DistanceField, LabIcpConfig, align, lab_icp};
use touch2touch::domain::mesh::MeshDistance;
use touch2touch::domain::pose::{FingerInput, ToolModel, contact_cloud};
use touch2touch::domain::units::angle_error;
use touch2touch::io::stl;

/// Milliseconds that `f` takes, the shortest of a few runs, and its result.
fn timed<T>(runs: usize, mut f: impl FnMut() -> T) -> (f64, T) {
    let mut best = f64::INFINITY;
    let mut last = None;
    for _ in 0..runs {
        let begin = Instant::now();
        last = Some(std::hint::black_box(f()));
        best = best.min(begin.elapsed().as_secs_f64() * 1e3);
    }
    (best, last.expect("at least one run"))
}

fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q).round() as usize]
}

fn main() {
    let folder = std::env::args().skip(1).find(|a| !a.starts_with("--")).map(PathBuf::from);
    let Some(folder) = folder.or_else(|| support::shared().map(|s| s.join("pose-cases"))) else { return };
    let cases: Vec<_> = support::cases::case_files(&folder).iter().map(|p| support::cases::read_case(p)).collect();
    let tools: Vec<ToolModel> = (0..=cases.iter().map(|c| c.tool).max().unwrap_or(0))
        .map(|i| {
            let mesh = stl::read(&folder.join(format!("tool_{i:02}.stl"))).expect("the tool's STL").mesh;
            let (field, _) = timed(3, || DistanceField::from_mesh(&mesh).expect("a field"));
            let (distance, _) = timed(3, || MeshDistance::new(&mesh).expect("a distance"));
            println!(
                "tool {i:2}: {:6} triangles, field {field:5.1} ms, surface {distance:5.1} ms",
                mesh.triangles.len()
            );
            ToolModel::new(mesh).expect("a usable tool")
        })
        .collect();

    let mut lift_ms = Vec::new();
    let clouds: Vec<Vec<DVec2>> = cases
        .iter()
        .map(|case| {
            let fingers = [0, 1].map(|f| {
                Some(FingerInput { imprint: &case.imprints[f], camera: &case.cameras[f], mask: Some(&case.masks[f]) })
            });
            let (ms, cloud) = timed(5, || contact_cloud(&fingers).expect("a cloud").yz());
            lift_ms.push(ms);
            cloud
        })
        .collect();
    println!("depth and mask to points: median {:.3} ms", quantile(&mut lift_ms, 0.5));

    let default = AlignConfig::default();
    type Solve<'a> = Box<dyn Fn(&[DVec2], &ToolModel) -> AlignReport + 'a>;
    let engines: [(&str, usize, Solve<'_>); 2] = [
        ("distance-field", 9, Box::new(|points, tool| align(points, &tool.field, &default).expect("a pose"))),
        (
            "lab-icp",
            1,
            Box::new(|points, tool| lab_icp(points, &tool.model_points, &LabIcpConfig::default()).expect("a pose")),
        ),
    ];
    println!(
        "{:15} {:>9} {:>9} {:>8} {:>8} {:>6} {:>6} {:>9}",
        "engine", "median ms", "p95 ms", "mean °", "median °", "<5 %", "<10 %", "look-ups"
    );
    for (name, runs, solve) in &engines {
        let (mut ms, mut errors, mut lookups) = (vec![], vec![], vec![]);
        for (case, points) in cases.iter().zip(&clouds) {
            let (time, report) = timed(*runs, || solve(points, &tools[case.tool]));
            ms.push(time);
            lookups.push(report.lookups as f64);
            errors.push(angle_error(report.grasp_from_object.theta_rad, case.theta_rad).to_degrees());
        }
        let within = |limit: f64| errors.iter().filter(|e| **e <= limit).count() as f64 / errors.len() as f64 * 100.0;
        println!(
            "{name:15} {:9.3} {:9.3} {:8.2} {:8.2} {:6.1} {:6.1} {:9.0}",
            quantile(&mut ms.clone(), 0.5),
            quantile(&mut ms, 0.95),
            errors.iter().sum::<f64>() / errors.len() as f64,
            quantile(&mut errors.clone(), 0.5),
            within(5.0),
            within(10.0),
            quantile(&mut lookups, 0.5),
        );
    }
}
