//! `touch2touch-bench dataset`: how long a whole data set takes on all cores.

use std::time::Instant;

use clap::Args;
use glam::DVec3;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

use super::{Machine, contact_points};
use touch2touch::headless::JsonArgs;
use touch2touch::headless::{Output, VerbResult};
use touch2touch_core::align::{Contacts, PadImage};
use touch2touch_core::catalog;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::metrics::AngleSummary;
use touch2touch_core::pose::{Registration, register};
use touch2touch_core::rig::lab;
use touch2touch_core::sample::DepthCamera;
use touch2touch_core::sim::{self, SimConfig, Spoil, spoil_mask};
use touch2touch_core::tool::ToolModel;
use touch2touch_core::units::angle_error;

/// Pairs that are prepared, then timed, at a time: their cameras must fit into memory.
const CHUNK: usize = 504;
/// Largest turn and shift of each pair from the grasp it was made from.
const JITTER_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;
const JITTER_M: f64 = 1e-3;

/// Arguments of `bench dataset`.
#[derive(Debug, Args)]
pub(super) struct DatasetArgs {
    /// Pairs in all; the lab's data set has 12 tools with 2688 grasps each.
    #[arg(long, default_value_t = 32_256, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pairs: u32,
    /// Grasps that are simulated for each of the 12 tools; the pairs are moved copies of them.
    #[arg(long, default_value_t = 28, value_parser = clap::value_parser!(u32).range(1..=2688))]
    grasps: u32,
    /// Seed of grasps, noise, masks and movements.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The registration.
    #[arg(long, default_value_t = Registration::default())]
    engine: Registration,
    #[command(flatten)]
    json: JsonArgs,
}

/// A simulated grasp.
struct Grasp {
    tool: usize,
    imprints: [DepthMap; 2],
    cameras: [DepthCamera; 2],
    masks: [Mask; 2],
    truth: PlanarPose,
}

/// A pair of the data set: a grasp seen from cameras that stand a little elsewhere.
struct Pair<'a> {
    grasp: &'a Grasp,
    cameras: [DepthCamera; 2],
    points: Vec<DVec3>,
    truth: PlanarPose,
}

#[derive(Serialize)]
struct Stage {
    /// Wall-clock seconds for all pairs on all threads.
    seconds: f64,
    pairs_per_second: f64,
    #[serde(flatten)]
    angles: AngleSummary,
}

#[derive(Serialize)]
struct Report {
    machine: Machine,
    engine: String,
    pairs: usize,
    tools: usize,
    /// Grasps that were simulated; the pairs are moved copies.
    simulated: usize,
    /// Building all tool models, seconds on all threads.
    tools_seconds: f64,
    /// Contact points to pose, without the imprints: by the mask alone.
    points_to_pose: Stage,
    /// Imprints, cameras and masks of both fingers to pose.
    depth_to_pose: Stage,
    /// Work that the times leave out.
    excluded: &'static str,
    /// Origin of the pairs.
    made: String,
}

pub(super) fn run(args: &DatasetArgs) -> VerbResult {
    let machine = Machine::now();
    let specs = catalog::tools();
    let begin = Instant::now();
    let tools: Vec<ToolModel> = specs.par_iter().map(|t| ToolModel::new(t.mesh())).collect::<Result<_, _>>()?;
    let tools_seconds = begin.elapsed().as_secs_f64();

    let count = specs.len() * args.grasps as usize;
    let output = Output::new(args.json.common(), "simulating", count);
    let grasps: Vec<Grasp> = (0..count)
        .into_par_iter()
        .map(|i| {
            output.step(&specs[i % specs.len()].name);
            grasp(i, args.seed)
        })
        .collect::<anyhow::Result<_>>()?;

    let pairs = args.pairs as usize;
    let (mut points_seconds, mut depth_seconds) = (0.0, 0.0);
    let (mut points_errors, mut depth_errors) = (Vec::with_capacity(pairs), Vec::with_capacity(pairs));
    for start in (0..pairs).step_by(CHUNK) {
        output.set(start, pairs);
        let chunk: Vec<Pair<'_>> = (start..pairs.min(start + CHUNK))
            .into_par_iter()
            .map(|i| pair(&grasps[i % count], i, args.seed))
            .collect::<anyhow::Result<_>>()?;
        let begin = Instant::now();
        let errors: Vec<f64> = chunk
            .par_iter()
            .map(|p| {
                let report = register(&p.points, &tools[p.grasp.tool], args.engine, false);
                report.map_or(f64::NAN, |r| angle_error(r.grasp_from_object.theta_rad, p.truth.theta_rad))
            })
            .collect();
        points_seconds += begin.elapsed().as_secs_f64();
        points_errors.extend(errors);
        let begin = Instant::now();
        let errors: Vec<f64> = chunk
            .par_iter()
            .map(|p| {
                let points = contact_points(&p.grasp.imprints, &p.cameras, &p.grasp.masks).unwrap_or_default();
                let image =
                    |f: usize| PadImage { imprint: &p.grasp.imprints[f], camera: &p.cameras[f], predicted: false };
                let contacts = Contacts { points: &points, images: &[image(0), image(1)] };
                let report = register(contacts, &tools[p.grasp.tool], args.engine, false);
                report.map_or(f64::NAN, |r| angle_error(r.grasp_from_object.theta_rad, p.truth.theta_rad))
            })
            .collect();
        depth_seconds += begin.elapsed().as_secs_f64();
        depth_errors.extend(errors);
    }
    let stage = |seconds: f64, errors: &[f64]| Stage {
        seconds,
        pairs_per_second: pairs as f64 / seconds,
        angles: AngleSummary::from_errors(errors),
    };
    let report = Report {
        machine,
        engine: args.engine.to_string(),
        pairs,
        tools: tools.len(),
        simulated: count,
        tools_seconds,
        points_to_pose: stage(points_seconds, &points_errors),
        depth_to_pose: stage(depth_seconds, &depth_errors),
        excluded: "reading files, simulating, finding the mask",
        made: format!(
            "{count} simulated grasps with spoilt masks, taken in turn; each time both cameras are moved by a random \
             turn of up to {:.0}° and a shift of up to {:.0} mm in the plane, so that no two pairs have the same points",
            JITTER_RAD.to_degrees(),
            JITTER_M * 1e3
        ),
    };
    args.json.write(&report)?;
    output.finish(&report, || text(&report))?;
    Ok(true)
}

/// Simulated grasp number `i`, of the tools in turn.
fn grasp(i: usize, seed: u64) -> anyhow::Result<Grasp> {
    let tool = i % catalog::tools().len();
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(i as u64));
    let held = sim::random_grasp(rng.random());
    let sample = sim::simulate(&catalog::tools()[tool], held, rng.random(), &SimConfig::default());
    let mask_seed = rng.random();
    let mut parts = Vec::new();
    for finger in lab::PADS {
        let touch = sample.pad(finger).and_then(|t| t.depth());
        let touch = touch.ok_or_else(|| anyhow::anyhow!("the simulator left a finger out"))?;
        let (Some(camera), Some(truth)) = (&touch.camera, &touch.truth) else {
            anyhow::bail!("the simulator left camera or truth out");
        };
        let mask = spoil_mask(&truth.contact, &Spoil::nominal(), finger, mask_seed);
        parts.push((touch.imprint.clone(), camera.clone(), mask));
    }
    let [right, left] = <[_; 2]>::try_from(parts).map_err(|_| anyhow::anyhow!("two fingers"))?;
    Ok(Grasp {
        tool,
        imprints: [right.0, left.0],
        cameras: [right.1, left.1],
        masks: [right.2, left.2],
        truth: sample.grasp_from_object.unwrap_or_default(),
    })
}

fn pair(grasp: &Grasp, i: usize, seed: u64) -> anyhow::Result<Pair<'_>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x9e37_79b9_7f4a_7c15);
    rng.set_stream(i as u64);
    let moved = PlanarPose {
        theta_rad: rng.random_range(-JITTER_RAD..JITTER_RAD),
        y_m: rng.random_range(-JITTER_M..JITTER_M),
        z_m: rng.random_range(-JITTER_M..JITTER_M),
    };
    let cameras = grasp.cameras.clone().map(|mut camera| {
        camera.grasp_from_camera = moved.to_affine() * camera.grasp_from_camera;
        camera
    });
    let place = moved.transform_yz(glam::DVec2::new(grasp.truth.y_m, grasp.truth.z_m));
    let truth = PlanarPose { theta_rad: moved.theta_rad + grasp.truth.theta_rad, y_m: place.x, z_m: place.y };
    let points = contact_points(&grasp.imprints, &cameras, &grasp.masks)?;
    Ok(Pair { grasp, cameras, points, truth })
}

fn text(report: &Report) -> String {
    let line = |name: &str, stage: &Stage| {
        format!(
            "{name}: {:.2} s ({:.0} pairs a second), mean {:.2}°, within 5° {:.1} %\n",
            stage.seconds,
            stage.pairs_per_second,
            stage.angles.mean_deg.unwrap_or(f64::NAN),
            stage.angles.success_5
        )
    };
    format!(
        "{}\n{} pairs of {} tools, {}; {}\nnot in the times: {}\n{} tool models: {:.2} s\n{}{}",
        report.machine.text(),
        report.pairs,
        report.tools,
        report.engine,
        report.made,
        report.excluded,
        report.tools,
        report.tools_seconds,
        line("points to pose", &report.points_to_pose),
        line("depth and mask to pose", &report.depth_to_pose)
    )
}
