//! `touch2touch-bench verdict`: signs of a fault that need no truth, each as a detector, on fresh grasps with faults drawn in.

use clap::Args;
use glam::{DAffine3, DVec3};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use strum::IntoEnumIterator as _;

use super::Machine;
use super::figures::quantile;
use super::registration::{images, points};
use super::rows::position_error_mm;
use touch2touch::headless::{JsonArgs, Output, VerbResult};
use touch2touch_core::align::{Ask, Contacts, Evidence, Scene};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::pose::{Registration, RegistrationChoice, ToolModel};
use touch2touch_core::units::angle_error;
use touch2touch_work::io::cases::{self, Case};

/// Arguments of `bench verdict`.
#[derive(Debug, Args)]
pub(super) struct VerdictArgs {
    /// Grasps; each is tried with every fault.
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    count: u32,
    /// Seed of grasps, noise, masks and faults.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The registration.
    #[arg(long, default_value_t = Registration::default())]
    engine: Registration,
    #[command(flatten)]
    json: JsonArgs,
}

/// Fault of a touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, strum::EnumIter, strum::Display)]
#[serde(rename_all = "snake_case")]
enum Fault {
    /// None: the mask is spoilt as a learned one is.
    #[strum(to_string = "none")]
    None,
    /// The CAD model of another tool.
    #[strum(to_string = "wrong tool")]
    WrongTool,
    /// The CAD model ten times too large, or too small.
    #[strum(to_string = "wrong unit")]
    WrongUnit,
    /// The CAD model mirrored.
    #[strum(to_string = "mirrored model")]
    Mirrored,
    /// A disc of foreign contact in both masks.
    #[strum(to_string = "blob in the mask")]
    Blob,
    /// Half of each mask is gone.
    #[strum(to_string = "half of the mask")]
    Half,
    /// The imprints of the fingers are swapped.
    #[strum(to_string = "swapped fingers")]
    Swapped,
    /// One camera is turned by 10 to 20 degrees.
    #[strum(to_string = "turned camera")]
    Turned,
    /// One finger shows the free membrane.
    #[strum(to_string = "blank finger")]
    Blank,
    /// One finger's imprint is that of another grasp.
    #[strum(to_string = "other pair's imprint")]
    OtherPair,
}

/// A touch with a fault, as it is registered.
struct Trial {
    case: Case,
    /// The model that is registered: one of the tools, or a model that is none.
    model: Model,
}

enum Model {
    Tool(usize),
    Changed(TriMesh),
}

impl Trial {
    fn new(fault: Fault, case: &Case, other: &Case, meshes: &[TriMesh], rng: &mut ChaCha8Rng) -> Self {
        let mut case = case.clone();
        let mut model = Model::Tool(case.tool);
        let finger = rng.random_range(0..2usize);
        match fault {
            Fault::None => {}
            Fault::WrongTool => {
                model = Model::Tool((case.tool + rng.random_range(1..meshes.len())) % meshes.len());
            }
            Fault::WrongUnit => {
                let scale = if rng.random() { 10.0 } else { 0.1 };
                let mut mesh = meshes[case.tool].clone();
                mesh.vertices.iter_mut().for_each(|v| *v *= scale);
                model = Model::Changed(mesh);
            }
            Fault::Mirrored => {
                let mut mesh = meshes[case.tool].clone();
                mesh.vertices.iter_mut().for_each(|v| v.y = -v.y);
                mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
                model = Model::Changed(mesh);
            }
            Fault::Blob => {
                for mask in &mut case.masks {
                    let [width, height] = mask.size();
                    let middle = [rng.random_range(0..width) as f64, rng.random_range(0..height) as f64];
                    for y in 0..height {
                        for x in 0..width {
                            mask[(x, y)] |= (x as f64 - middle[0]).hypot(y as f64 - middle[1]) < 14.0;
                        }
                    }
                }
            }
            Fault::Half => {
                let angle: f64 = rng.random_range(0.0..std::f64::consts::TAU);
                for mask in &mut case.masks {
                    let mut marked: Vec<(usize, usize)> = (0..mask.height())
                        .flat_map(|y| (0..mask.width()).map(move |x| (x, y)))
                        .filter(|at| mask[*at])
                        .collect();
                    let along = |&(x, y): &(usize, usize)| x as f64 * angle.cos() + y as f64 * angle.sin();
                    marked.sort_by(|a, b| along(a).total_cmp(&along(b)));
                    for at in &marked[marked.len() / 2..] {
                        mask[*at] = false;
                    }
                }
            }
            Fault::Swapped => {
                case.imprints.reverse();
                case.masks.reverse();
            }
            Fault::Turned => {
                let turn: f64 = rng.random_range(10f64..20.0) * if rng.random() { 1.0 } else { -1.0 };
                let camera = &mut case.cameras[finger].grasp_from_camera;
                *camera = DAffine3::from_axis_angle(DVec3::X, turn.to_radians()) * *camera;
            }
            Fault::Blank => {
                case.imprints[finger] = case.imprints[finger].map(|_| 0.0);
                case.masks[finger] = case.masks[finger].map(|_| false);
            }
            Fault::OtherPair => {
                case.imprints[finger] = other.imprints[finger].clone();
                case.masks[finger] = other.masks[finger].clone();
            }
        }
        Self { case, model }
    }
}

/// A registered trial.
#[derive(Clone, Debug, Serialize)]
struct Row {
    case: usize,
    fault: Fault,
    stratum: String,
    tool: usize,
    /// Error of the angle, degrees; none without a pose.
    error_deg: Option<f64>,
    position_mm: Option<f64>,
    /// Share of the used points within the narrowest kernel; none without a pose, as what follows.
    inlier_share: Option<f64>,
    evidence: Option<Evidence>,
    /// Reason why there is no pose.
    why: Option<String>,
}

/// Sign of a fault.
struct Sign {
    name: &'static str,
    /// Value in a row, greater where it speaks against the pose.
    of: fn(&Row) -> Option<f64>,
}

/// The signs; the bands are those of [`Evidence`].
const SIGNS: &[Sign] = &[
    Sign { name: "few inliers", of: |row| Some(-row.inlier_share?) },
    Sign { name: "contact off the tool", of: |row| Some(1.0 - row.evidence?.on_tool) },
    Sign { name: "1.5-8 mm: not explained", of: |row| Some(-row.evidence?.membrane?[0].explained) },
    Sign { name: "1-3 mm: not explained", of: |row| Some(-row.evidence?.membrane?[1].explained) },
    Sign { name: "1-3 mm: foreign", of: |row| Some(row.evidence?.membrane?[1].foreign) },
    Sign { name: "1-3 mm: missing", of: |row| Some(row.evidence?.membrane?[1].missing) },
    Sign { name: "1-3 mm: residual", of: |row| Some(row.evidence?.membrane?[1].noise_m) },
    Sign { name: "0.7-2 mm: not explained", of: |row| Some(-row.evidence?.membrane?[2].explained) },
];

/// Share of false alarms at which signs are compared.
const FALSE_ALARMS: f64 = 0.02;

/// A sign alone, as a detector.
#[derive(Debug, Serialize)]
struct SignRow {
    sign: &'static str,
    /// Value that all but [`FALSE_ALARMS`] of the good poses stay below: right ones (within 5 degrees) without a fault.
    limit: Option<f64>,
    /// For each fault the share of trials beyond it or without a pose, percent.
    told: Vec<(Fault, f64)>,
}

/// A fault, and what registration makes of it.
#[derive(Debug, Serialize)]
struct FaultRow {
    fault: Fault,
    trials: usize,
    no_pose: usize,
    within_5: usize,
}

#[derive(Serialize)]
struct Report {
    machine: Machine,
    engine: String,
    faults: Vec<FaultRow>,
    signs: Vec<SignRow>,
    rows: Vec<Row>,
}

fn of_fault(rows: &[Row], fault: Fault) -> impl Iterator<Item = &Row> {
    rows.iter().filter(move |row| row.fault == fault)
}

fn is_right(row: &Row) -> bool {
    row.error_deg.is_some_and(|error| error.abs() <= 5.0)
}

fn signs(rows: &[Row]) -> Vec<SignRow> {
    let one = |&Sign { name, of }: &Sign| {
        let good = of_fault(rows, Fault::None).filter(|row| is_right(row)).filter_map(of);
        let limit = quantile(good, 1.0 - FALSE_ALARMS);
        let beyond = |row: &&Row| of(row).zip(limit).is_none_or(|(value, limit)| value > limit);
        let told = |fault| {
            let (all, told) = (of_fault(rows, fault).count(), of_fault(rows, fault).filter(beyond).count());
            (fault, 100.0 * told as f64 / all.max(1) as f64)
        };
        SignRow { sign: name, limit, told: Fault::iter().filter(|fault| *fault != Fault::None).map(told).collect() }
    };
    SIGNS.iter().map(one).collect()
}

fn text(report: &Report) -> String {
    let mut text = format!(
        "{}\n{}\n\n{:22} {:>6} {:>8} {:>7}\n",
        report.machine.text(),
        report.engine,
        "fault",
        "trials",
        "no pose",
        "<=5°"
    );
    for row in &report.faults {
        text += &format!("{:22} {:>6} {:>8} {:>7}\n", row.fault.to_string(), row.trials, row.no_pose, row.within_5);
    }
    text += &format!(
        "\npercent beyond the limit that {} % of the good poses pass, by each sign alone\n",
        100.0 * FALSE_ALARMS
    );
    for row in &report.signs {
        let told: Vec<String> = row.told.iter().map(|(fault, share)| format!("{fault} {share:.0}")).collect();
        text += &format!("{:24} {}\n", row.sign, told.join(" | "));
    }
    text
}

pub(super) fn run(args: &VerdictArgs) -> VerbResult {
    let tools = cases::simulated_tools();
    let meshes = cases::simulated_meshes();
    let count = args.count as usize;
    let output = Output::new(args.json.common(), "judging", count);
    let models: Vec<ToolModel> = meshes.iter().map(|m| ToolModel::new(m.clone())).collect::<Result<_, _>>()?;
    let make = |i: usize| cases::simulated(i, count, args.seed, &tools);
    let one = |i: usize| -> Vec<Row> {
        let (case, other) = (make(i), make((i + 1) % count));
        output.step(&tools[case.tool].name);
        Fault::iter()
            .map(|fault| {
                let mut rng = ChaCha8Rng::seed_from_u64(args.seed.wrapping_mul(7919).wrapping_add(i as u64));
                rng.set_stream(fault as u64);
                let trial = Trial::new(fault, &case, &other, &meshes, &mut rng);
                row(i, fault, &trial, &models, args.engine)
            })
            .collect()
    };
    let rows: Vec<Row> = (0..count).into_par_iter().flat_map_iter(one).collect();
    let fault = |fault| {
        let no_pose = |row: &&Row| row.error_deg.is_none();
        FaultRow {
            fault,
            trials: of_fault(&rows, fault).count(),
            no_pose: of_fault(&rows, fault).filter(no_pose).count(),
            within_5: of_fault(&rows, fault).filter(|row| is_right(row)).count(),
        }
    };
    let report = Report {
        machine: Machine::now(),
        engine: args.engine.to_string(),
        faults: Fault::iter().map(fault).collect(),
        signs: signs(&rows),
        rows,
    };
    args.json.write(&report)?;
    output.finish(&report, || text(&report))?;
    Ok(true)
}

fn row(i: usize, fault: Fault, trial: &Trial, models: &[ToolModel], engine: Registration) -> Row {
    let case = &trial.case;
    let changed;
    let tool = match &trial.model {
        Model::Tool(number) => Ok(&models[*number]),
        Model::Changed(mesh) => {
            changed = ToolModel::new(mesh.clone());
            changed.as_ref().map_err(ToString::to_string)
        }
    };
    let images = images(case);
    let points = points(case, &case.masks).unwrap_or_default();
    let scene = Scene::new(Contacts { points: &points, images: &images });
    let method = RegistrationChoice::from(engine).method();
    let found = tool.and_then(|tool| Ok((tool, method.run(&scene, tool, Ask::default()).map_err(|e| e.to_string())?)));
    let mut row = Row {
        case: i,
        fault,
        stratum: case.stratum.to_string(),
        tool: case.tool,
        error_deg: None,
        position_mm: None,
        inlier_share: None,
        evidence: None,
        why: found.as_ref().err().cloned(),
    };
    let Ok((tool, report)) = found else { return row };
    let (pose, truth) = (report.grasp_from_object, case.grasp_from_object);
    row.error_deg = Some(angle_error(pose.theta_rad, truth.theta_rad).to_degrees());
    row.position_mm = Some(position_error_mm(pose, truth));
    row.inlier_share = Some(report.inlier_share);
    row.evidence = Some(Evidence::at(&scene, tool, pose));
    row
}
