//! Open3D and small_gicp on the same points, by a script that is part of this program.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context as _, ensure};
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::figures::{Outcome, Summary};
use super::rows::{EngineRow, Prepared, offset, position_error_mm};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::units::angle_error;
use touch2touch_pipeline::io::pt::Tensor;
use touch2touch_pipeline::io::{files, npz};

const SCRIPT: &str = include_str!("../../../benches/peers.py");
/// Surface points of a tool: as many as the lab's loop compares with.
const MODEL_POINTS: usize = 5000;

/// Results of the libraries that Python had.
pub(super) struct Peers {
    pub(super) rows: Vec<EngineRow>,
    /// Versions, and libraries that are missing.
    pub(super) notes: Vec<String>,
}

#[derive(Serialize)]
struct Request {
    /// Number of the case and of its tool.
    cases: Vec<[usize; 2]>,
}

#[derive(Deserialize)]
struct Reply {
    versions: BTreeMap<String, String>,
    missing: BTreeMap<String, String>,
    rows: Vec<Row>,
}

#[derive(Deserialize)]
struct Row {
    name: String,
    label: String,
    /// One per case asked for.
    poses: Vec<Found>,
}

#[derive(Deserialize)]
struct Found {
    /// `null`, as the rest, where the library gave no pose.
    theta_rad: Option<f64>,
    y_m: Option<f64>,
    z_m: Option<f64>,
    ms: Option<f64>,
    cpu_ms: Option<f64>,
}

/// Runs the script on the cases at the positions `chosen`.
///
/// # Errors
/// If Python cannot be started or has no numpy, or the script fails.
pub(super) fn run(
    python: &Path,
    cases: &[Prepared],
    tools: &BTreeMap<usize, TriMesh>,
    chosen: &[usize],
) -> anyhow::Result<Peers> {
    let folder = tempfile::tempdir()?;
    let mut arrays = Vec::new();
    let flat = |points: &[DVec3]| points.iter().flat_map(|p| p.to_array()).collect::<Vec<f64>>();
    for &i in chosen {
        let points = &cases[i].points;
        arrays.push((format!("points_{i}"), Tensor::f64(&[points.len(), 3], flat(points))));
    }
    for (number, mesh) in tools {
        let points = mesh.sample_surface(MODEL_POINTS, 0);
        arrays.push((format!("model_{number}"), Tensor::f64(&[points.len(), 3], flat(&points))));
    }
    let named: Vec<(&str, Tensor)> = arrays.iter().map(|(name, tensor)| (name.as_str(), tensor.clone())).collect();
    npz::write(&folder.path().join("request.npz"), &named)?;
    let request = Request { cases: chosen.iter().map(|&i| [i, cases[i].tool]).collect() };
    std::fs::write(folder.path().join("request.json"), serde_json::to_string(&request)?)?;
    let script = folder.path().join("peers.py");
    std::fs::write(&script, SCRIPT)?;
    let mut command = Command::new(python);
    // One thread, as the engines that they are compared with.
    for variable in ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"] {
        command.env(variable, "1");
    }
    let done = command
        .arg(&script)
        .arg(folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("{} cannot be started", python.display()))?
        .wait_with_output()?;
    let said = String::from_utf8_lossy(&done.stderr);
    ensure!(done.status.success(), "{}: {}", python.display(), said.lines().last().unwrap_or("it failed"));
    let reply = files::read(&folder.path().join("reply.json"), files::SMALL).context("the script wrote no answer")?;
    let reply: Reply = serde_json::from_slice(&reply).context("the script's answer")?;
    let mut notes = Vec::new();
    for (library, version) in &reply.versions {
        notes.push(format!("{library} {version}: n = {}", chosen.len()));
    }
    for (library, reason) in &reply.missing {
        notes.push(format!("{library} was not run: {reason}"));
    }
    let rows = reply.rows.into_iter().map(|row| engine_row(row, cases, chosen)).collect::<anyhow::Result<_>>()?;
    Ok(Peers { rows, notes })
}

fn engine_row(row: Row, cases: &[Prepared], chosen: &[usize]) -> anyhow::Result<EngineRow> {
    ensure!(row.poses.len() == chosen.len(), "{}: {} answers for {} cases", row.name, row.poses.len(), chosen.len());
    let (mut error_deg, mut ms) = (vec![None; cases.len()], vec![None; cases.len()]);
    let mut offset_mm = vec![None; cases.len()];
    let mut outcomes = Vec::new();
    for (answer, &i) in row.poses.iter().zip(chosen) {
        let case = &cases[i];
        let number = |v: Option<f64>| v.unwrap_or(f64::NAN);
        let pose = PlanarPose { theta_rad: number(answer.theta_rad), y_m: number(answer.y_m), z_m: number(answer.z_m) };
        let truth = case.truth_near(pose);
        let error = angle_error(pose.theta_rad, truth.theta_rad).to_degrees();
        (error_deg[i], ms[i]) = (Some(error).filter(|e| e.is_finite()), answer.ms);
        offset_mm[i] = answer.theta_rad.map(|_| offset(pose, truth));
        outcomes.push(Outcome {
            stratum: case.stratum,
            straight: case.straight,
            error_deg: error,
            position_mm: position_error_mm(pose, truth),
            ms: number(answer.ms),
        });
    }
    let cpu: Vec<f64> = row.poses.iter().filter_map(|p| p.cpu_ms).collect();
    Ok(EngineRow {
        name: row.name,
        label: row.label,
        peer: true,
        summary: Summary::new(&outcomes),
        cpu_mean_ms: (!cpu.is_empty()).then(|| cpu.iter().sum::<f64>() / cpu.len() as f64),
        error_deg,
        ms,
        reliability: None,
        offset_mm,
    })
}
