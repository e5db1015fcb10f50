//! `touch2touch-bench verdict`: the verdict without the truth as a detector of faults that are drawn into known grasps.

use std::path::PathBuf;

use clap::Args;
use glam::{DAffine3, DVec3};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use strum::IntoEnumIterator as _;

use super::Machine;
use super::registration::{Masks, OF_CASES, images, masks, points};
use crate::json::JsonArgs;
use touch2touch::headless::{ModelArgs, Output, VerbResult};
use touch2touch_bench::known::{Case, CaseSet, Suite};
use touch2touch_core::align::{AlignReport, Ask, Contacts};
use touch2touch_core::catalog::ToolSpec;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::pose::{Registration, ToolModel, register_with};
use touch2touch_core::units::angle_error;
use touch2touch_core::verdict::{Grade, Verdict};
use touch2touch_core::which_tool::which_tool;

/// Arguments of `bench verdict`.
#[derive(Debug, Args)]
pub(super) struct VerdictArgs {
    /// Grasps; each is tried with every fault.
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    count: u32,
    /// Seed of grasps, noise, masks and faults.
    #[arg(long, default_value_t = 1)]
    simulation_seed: u64,
    /// Folder of known grasps (`touch2touch-bench cases` writes one) in place of fresh ones.
    #[arg(long, conflicts_with = "count")]
    cases: Option<PathBuf>,
    /// Contact masks of the folder's grasps: `spoilt` (as a learned mask has them), `clean`, `unet` (by the mask model), `threshold=MM`.
    #[arg(long, default_value_t = Masks::Spoilt, requires = "cases")]
    masks: Masks,
    #[command(flatten)]
    model: ModelArgs,
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
struct Row {
    fault: Fault,
    /// Error of the angle, degrees; none without a pose.
    error_deg: Option<f64>,
    verdict: Option<Verdict>,
}

/// A fault, and what registration and verdict make of it.
#[derive(Debug, Serialize)]
struct FaultRow {
    fault: Fault,
    trials: usize,
    no_pose: usize,
    within_5: usize,
    /// Trials whose pose is doubted (check or wrong), or that have none, percent. Without a fault: of the right poses, which
    /// are the false alarms.
    told: f64,
    /// Trials whose pose is called wrong, or that have none, percent; likewise.
    wrong: f64,
}

impl FaultRow {
    fn new(rows: &[Row], fault: Fault) -> Self {
        let all: Vec<&Row> = of_fault(rows, fault).collect();
        let count = |of: &dyn Fn(&Row) -> bool| all.iter().filter(|row| of(row)).count();
        let judged = |row: &&&Row| fault != Fault::None || is_right(row);
        let percent = |grade: Grade| {
            let told = |row: &&&Row| row.verdict.as_ref().is_none_or(|verdict| verdict.grade >= grade);
            let (told, of) = (all.iter().filter(judged).filter(told).count(), all.iter().filter(judged).count());
            100.0 * told as f64 / of.max(1) as f64
        };
        Self {
            fault,
            trials: all.len(),
            no_pose: count(&|row| row.error_deg.is_none()),
            within_5: count(&is_right),
            told: percent(Grade::Check),
            wrong: percent(Grade::Wrong),
        }
    }
}

#[derive(Serialize)]
struct Report {
    machine: Machine,
    engine: String,
    faults: Vec<FaultRow>,
    /// Grasps of which all tools of the source are tried and the right one comes first, percent.
    named: f64,
}

fn of_fault(rows: &[Row], fault: Fault) -> impl Iterator<Item = &Row> {
    rows.iter().filter(move |row| row.fault == fault)
}

fn is_right(row: &Row) -> bool {
    row.error_deg.is_some_and(|error| error.abs() <= 5.0)
}

fn text(report: &Report) -> String {
    let mut text = format!(
        "{}\n{}\n\n{:22} {:>6} {:>8} {:>7} {:>10} {:>9}\n",
        report.machine.text(),
        report.engine,
        "fault",
        "trials",
        "no pose",
        "<=5°",
        "doubted %",
        "wrong %"
    );
    for row in &report.faults {
        text += &format!(
            "{:22} {:>6} {:>8} {:>7} {:>10.1} {:>9.1}\n",
            row.fault.to_string(),
            row.trials,
            row.no_pose,
            row.within_5,
            row.told,
            row.wrong
        );
    }
    text += &format!(
        "\n{:.1} % of the grasps name their tool when all are tried\nof the first row only the right poses count: they are the false alarms\n",
        report.named,
    );
    text
}

/// Source of the grasps; the `tool` of each is a position among the meshes.
enum Source {
    Fresh(Suite),
    Known(Vec<Case>),
}

impl Source {
    /// The source with the meshes of its tools.
    fn new(args: &VerdictArgs) -> anyhow::Result<(Self, Vec<TriMesh>)> {
        let Some(folder) = &args.cases else {
            let suite = Suite::new(args.count as usize, args.simulation_seed);
            let meshes = suite.tools().iter().map(ToolSpec::mesh).collect();
            return Ok((Self::Fresh(suite), meshes));
        };
        let mut set = CaseSet::open(folder)?;
        let masks = masks(&set, args.masks, &args.model)?;
        let numbers: Vec<usize> = set.tools.keys().copied().collect();
        anyhow::ensure!(numbers.len() > 1 && set.cases.len() > 1, "two cases and two tools are the least that will do");
        for ((_, case), masks) in set.cases.iter_mut().zip(masks) {
            case.masks = masks;
            case.tool = numbers.iter().position(|number| *number == case.tool).unwrap_or(0);
        }
        Ok((Self::Known(set.cases.into_iter().map(|(_, case)| case).collect()), set.tools.into_values().collect()))
    }

    fn count(&self) -> usize {
        match self {
            Self::Fresh(suite) => suite.count(),
            Self::Known(cases) => cases.len(),
        }
    }

    fn case(&self, i: usize) -> Case {
        match self {
            Self::Fresh(suite) => suite.case(i),
            Self::Known(cases) => cases[i].clone(),
        }
    }
}

pub(super) fn run(args: &VerdictArgs) -> VerbResult {
    let (source, meshes) = Source::new(args)?;
    let count = source.count();
    let output = Output::new(args.json.common(), "judging", count);
    let models: Vec<ToolModel> = meshes.iter().map(|m| ToolModel::new(m.clone())).collect::<Result<_, _>>()?;
    let (seed, engine) = (args.simulation_seed, args.engine);
    let one = |i: usize| -> Vec<Row> {
        let (case, other) = (source.case(i), source.case((i + 1) % count));
        output.step(&i.to_string());
        Fault::iter()
            .map(|fault| {
                let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(7919).wrapping_add(i as u64));
                rng.set_stream(fault as u64);
                let trial = Trial::new(fault, &case, &other, &meshes, &mut rng);
                row(fault, &trial, &models, engine)
            })
            .collect()
    };
    let rows: Vec<Row> = (0..count).into_par_iter().flat_map_iter(one).collect();
    let named = (0..count).into_par_iter().map(|i| is_named(&source.case(i), &models, engine)).filter(|named| *named);
    let report = Report {
        machine: Machine::now(),
        engine: args.engine.to_string(),
        faults: Fault::iter().map(|fault| FaultRow::new(&rows, fault)).collect(),
        named: 100.0 * named.count() as f64 / count.max(1) as f64,
    };
    args.json.write(&report)?;
    output.finish(&report, || text(&report))?;
    Ok(true)
}

/// True where the tool of a grasp comes first when all are tried.
fn is_named(case: &Case, models: &[ToolModel], engine: Registration) -> bool {
    let names: Vec<String> = (0..models.len()).map(|number| number.to_string()).collect();
    let images = images(case);
    let points = points(case, &case.masks).unwrap_or_default();
    let contacts = Contacts { points: &points, images: &images };
    let method = engine.method();
    let ranked = which_tool(contacts, names.iter().map(String::as_str).zip(models), &*method);
    ranked.first().is_some_and(|first| first.tool == names[case.tool])
}

fn row(fault: Fault, trial: &Trial, models: &[ToolModel], engine: Registration) -> Row {
    let case = &trial.case;
    let changed;
    let tool = match &trial.model {
        Model::Tool(number) => Some(&models[*number]),
        Model::Changed(mesh) => {
            changed = ToolModel::new(mesh.clone()).ok();
            changed.as_ref()
        }
    };
    let images = images(case);
    let points = points(case, &case.masks).unwrap_or_default();
    let contacts = Contacts { points: &points, images: &images };
    let method = engine.method();
    let ask = Ask { evidence: true, ..OF_CASES };
    let found = tool.and_then(|tool| register_with(&*method, contacts, tool, ask).ok());
    let error = |report: &AlignReport| {
        angle_error(report.grasp_from_object.theta_rad, case.grasp_from_object.theta_rad).to_degrees()
    };
    Row { fault, error_deg: found.as_ref().map(error), verdict: found.as_ref().and_then(Verdict::of) }
}
