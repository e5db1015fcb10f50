//! `touch2touch-bench registration`: every engine on every case, one thread, one table.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context as _;
use clap::Args;
use glam::DVec3;
use serde::Serialize;
use strum::IntoEnumIterator as _;

use super::figures::{Outcome, Summary, quantile};
use super::front::{self, FrontPoint};
use super::reliability::{Reliability, scores};
use super::rows::{EngineRow, Prepared, offset, position_error_mm};
use super::{Machine, contact_points, peers};
use crate::json::{JsonArgs, write};
use touch2touch::headless::says;
use touch2touch::headless::{LimitArgs, ModelArgs, at_least_one};
use touch2touch::headless::{Output, VerbResult};
use touch2touch_bench::known::{Case, CaseSet};
use touch2touch_core::align::{AlignError, AlignReport, Ask, Contacts, LabModel, PadImage};
use touch2touch_core::cloud::CloudError;
use touch2touch_core::field::DistanceField;
use touch2touch_core::grid::Mask;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::pose::{Registration, ToolModel, register, register_with};
use touch2touch_core::rig::Rig;
use touch2touch_core::symmetry::Symmetry;
use touch2touch_core::units::angle_error;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::pairs;
use touch2touch_pipeline::steps::mask::MaskSource;

/// Repetitions of one case go on until this much time is spent, milliseconds, or there are [`MAX_REPETITIONS`].
const REPEAT_MS: f64 = 8.0;
const MAX_REPETITIONS: usize = 15;

/// Arguments of `bench registration`.
#[derive(Debug, Args)]
pub(super) struct RegistrationArgs {
    /// Folder with `case_*.npz` and `tool_KK.stl` (`touch2touch-bench cases` writes one); several with commas, such as one for
    /// each law of the membrane: each has its own table, and its files have its name.
    #[arg(long, required = true, value_delimiter = ',')]
    cases: Vec<PathBuf>,
    #[command(flatten)]
    json: JsonArgs,
    /// Only these engines, separated by commas.
    #[arg(long, value_delimiter = ',')]
    engines: Vec<Registration>,
    /// Contact masks to register: `spoilt` (as a learned mask has them), `clean`, `unet` (by the mask model), `threshold=MM`.
    #[arg(long, default_value_t = Masks::Spoilt)]
    masks: Masks,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    limit: LimitArgs,
    /// Python that may have Open3D and small_gicp; they then run on the same points.
    #[arg(long, default_value = "python3")]
    python: PathBuf,
    /// Cases for the Python peers, spread evenly: each takes about a second per pose.
    #[arg(long, default_value_t = 40, value_parser = at_least_one::<usize>)]
    peer_limit: usize,
    /// Leave the Python peers out.
    #[arg(long)]
    no_peers: bool,
}

/// All cases are from the lab's grid, as a folder of its grasps would say.
pub(super) const OF_CASES: Ask<'static> = Ask { starts: None, record: false, evidence: false, in_lab_grid: true };

/// Which contact masks. As text `spoilt`, `clean`, `unet` or `threshold=MM`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(into = "String")]
pub(super) enum Masks {
    /// As a learned mask has them.
    Spoilt,
    /// As they are.
    Clean,
    /// By the mask model.
    Unet,
    /// All that is pushed in by so many millimeters.
    Threshold(f32),
}

impl std::str::FromStr for Masks {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.strip_prefix("threshold=").map(str::parse)) {
            ("spoilt", _) => Ok(Self::Spoilt),
            ("clean", _) => Ok(Self::Clean),
            ("unet", _) => Ok(Self::Unet),
            (_, Some(Ok(mm))) if (0.0..50.0).contains(&mm) => Ok(Self::Threshold(mm)),
            _ => Err("masks are spoilt, clean, unet or threshold=MM, with less than 50 mm".to_owned()),
        }
    }
}

impl std::fmt::Display for Masks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Spoilt => f.write_str("spoilt"),
            Self::Clean => f.write_str("clean"),
            Self::Unet => f.write_str("unet"),
            Self::Threshold(mm) => write!(f, "threshold={mm}"),
        }
    }
}

impl From<Masks> for String {
    fn from(masks: Masks) -> Self {
        masks.to_string()
    }
}

/// The masks of every case.
pub(super) fn masks(set: &CaseSet, kind: Masks, args: &ModelArgs) -> anyhow::Result<Vec<[Mask; 2]>> {
    let (rig, models) = (Rig::lab(), args.models());
    let model = match kind {
        Masks::Unet => args.mask_model(MaskSource::Unet, &rig)?,
        _ => None,
    };
    let of = |case: &Case| -> anyhow::Result<[Mask; 2]> {
        let mut masks = if kind == Masks::Spoilt { case.masks.clone() } else { case.masks_clean.clone() };
        for (mask, imprint) in masks.iter_mut().zip(&case.imprints) {
            if let Masks::Threshold(mm) = kind {
                *mask = imprint.map(|pushed| pushed.is_finite() && *pushed >= mm / 1e3);
            }
            if let Some(model) = &model {
                *mask = (*models.mask(model, EngineChoice::default(), imprint)?.mask).clone();
            }
        }
        Ok(masks)
    };
    set.cases.iter().map(|(name, case)| of(case).with_context(|| name.clone())).collect()
}

#[derive(Debug, Serialize)]
struct ToolRow {
    tool: usize,
    triangles: usize,
    /// A straight bar, along which a pose is free.
    straight: bool,
    /// Building the distance field, shortest of three.
    field_ms: f64,
    /// Building everything that a tool needs, shortest of three.
    build_ms: f64,
}

#[derive(Debug, Serialize)]
struct Quantiles {
    median_ms: Option<f64>,
    p95_ms: Option<f64>,
}

#[derive(Debug, Serialize)]
struct CaseRow {
    name: String,
    stratum: String,
    tool: usize,
    points: usize,
    truth_deg: f64,
}

#[derive(Debug, Serialize)]
struct Report {
    /// The engine that the studio and `touch2touch pose` use.
    default: String,
    machine: Machine,
    folder: PathBuf,
    masks: Masks,
    /// Depth and mask of both fingers to contact points.
    depth_to_points: Quantiles,
    /// Depth and mask to the pose with the default engine.
    depth_to_pose: Quantiles,
    engines: Vec<EngineRow>,
    /// Time and mean error of each engine; `on_front` where no other is both faster and better.
    front: Vec<FrontPoint>,
    /// Notes on what could not be measured, and why.
    notes: Vec<String>,
    tools: Vec<ToolRow>,
    cases: Vec<CaseRow>,
}

/// Times of one repeated call, milliseconds.
struct Timed<T> {
    median: f64,
    calls: usize,
    value: T,
}

/// Milliseconds that this thread has spent on a processor, where the system tells (Linux). Coarse: a few
/// milliseconds. On a busy machine it says what a call costs, where the clock says how long one waits.
fn thread_cpu_ms() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split(' ').next()?.parse::<f64>().ok()? / 1e6)
}

fn timed<T>(mut f: impl FnMut() -> T) -> Timed<T> {
    let mut run = || {
        let begin = Instant::now();
        let value = std::hint::black_box(f());
        (begin.elapsed().as_secs_f64() * 1e3, value)
    };
    let (first, value) = run();
    let mut all = vec![first];
    let mut spent = first;
    while spent < REPEAT_MS && all.len() < MAX_REPETITIONS {
        let (ms, _) = run();
        spent += ms;
        all.push(ms);
    }
    let median = quantile(all.iter().copied(), 0.5).unwrap_or(first);
    Timed { median, calls: all.len(), value }
}

pub(super) fn run(args: &RegistrationArgs) -> VerbResult {
    let mut names = std::collections::BTreeSet::new();
    if let Some(twice) = args.cases.iter().find(|folder| !names.insert(stem(folder))) {
        anyhow::bail!("two folders are called {}: their files would have one name; rename one of them", stem(twice));
    }
    let sets: Vec<CaseSet> = args.cases.iter().map(|folder| set(folder, args)).collect::<anyhow::Result<_>>()?;
    let engines: Vec<Registration> =
        if args.engines.is_empty() { Registration::iter().collect() } else { args.engines.clone() };
    let cases: usize = sets.iter().map(|set| set.cases.len()).sum();
    let output = Output::new(args.json.common(), "measuring", cases * engines.len());
    let mut reports = Vec::new();
    for (folder, set) in args.cases.iter().zip(&sets) {
        let report = report(folder, set, &engines, args, &output)?;
        if let Some(file) = args.json.file() {
            let file = if sets.len() > 1 { beside(file, &stem(folder), "json") } else { file.to_owned() };
            write(&file, &report)?;
            output.note(&format!("written: {} (pictures beside it)", file.display()));
        }
        reports.push(report);
    }
    let texts = || reports.iter().map(text).collect::<Vec<_>>().join("\n");
    match &reports[..] {
        [report] => output.finish(report, texts)?,
        _ => output.finish(&reports, texts)?,
    }
    Ok(true)
}

/// The cases of a folder that were asked for.
fn set(folder: &Path, args: &RegistrationArgs) -> anyhow::Result<CaseSet> {
    let mut set = CaseSet::open(folder)?;
    let chosen = args.limit.spread(set.cases.len());
    set.cases = chosen.into_iter().map(|i| set.cases[i].clone()).collect();
    Ok(set)
}

/// Name of a file without its ending, or of a folder.
fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// A file beside another, with one more word in its name.
fn beside(file: &Path, word: &str, ending: &str) -> PathBuf {
    file.with_file_name(format!("{}_{word}.{ending}", stem(file)))
}

fn report(
    folder: &Path,
    set: &CaseSet,
    engines: &[Registration],
    args: &RegistrationArgs,
    output: &Output,
) -> anyhow::Result<Report> {
    let machine = Machine::now();
    // One thread, whatever an engine would like to use: the figures are the work, not the machine.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let masks = masks(set, args.masks, &args.model)?;
    let kind = args.masks;
    let mut report = pool.install(|| measure((folder, kind), set, &masks, engines, machine, output))?;
    if !args.no_peers {
        let prepared = prepare(set, &masks)?;
        output.note("asking Python for Open3D and small_gicp ...");
        let asked: Vec<usize> = pairs::spread(prepared.len(), Some(args.peer_limit)).collect();
        match peers::run(&args.python, &prepared, &set.tools, &asked) {
            Ok(peers) => {
                report.engines.extend(peers.rows);
                report.notes.extend(peers.notes);
            }
            Err(err) => report.notes.push(format!("Open3D and small_gicp were not run: {}", says(&err))),
        }
    }
    report.front = front::front(&report.engines);
    Ok(report)
}

/// True where the mesh is one straight bar: its outline is more than six times as long as wide, by second moments.
pub(super) fn is_straight(mesh: &TriMesh) -> bool {
    let points = mesh.sample_surface(2000, 1);
    let mean = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let (mut yy, mut zz, mut yz) = (0.0, 0.0, 0.0);
    for p in &points {
        let p = *p - mean;
        (yy, zz, yz) = (yy + p.y * p.y, zz + p.z * p.z, yz + p.y * p.z);
    }
    let (half, root) = (0.5 * (yy + zz), (0.25 * (yy - zz) * (yy - zz) + yz * yz).sqrt());
    half - root < (half + root) / 36.0
}

/// The contact points of both fingers, grasp frame, meters.
pub(super) fn points(case: &Case, masks: &[Mask; 2]) -> Result<Vec<DVec3>, CloudError> {
    contact_points(&case.imprints, &case.cameras, masks)
}

/// Views of the cameras of both fingers.
pub(super) fn images(case: &Case) -> [PadImage<'_>; 2] {
    std::array::from_fn(|f| PadImage {
        predicted: case.predicted,
        ..PadImage::measured(&case.imprints[f], &case.cameras[f])
    })
}

fn prepare(set: &CaseSet, masks: &[[Mask; 2]]) -> anyhow::Result<Vec<Prepared>> {
    let straight: BTreeMap<usize, bool> = set.tools.iter().map(|(&n, mesh)| (n, is_straight(mesh))).collect();
    let symmetry = |mesh: &TriMesh| Ok::<_, anyhow::Error>(Symmetry::of(&ToolModel::new(mesh.clone())?));
    let symmetries =
        set.tools.iter().map(|(&n, mesh)| Ok((n, symmetry(mesh)?))).collect::<anyhow::Result<BTreeMap<_, _>>>()?;
    set.cases
        .iter()
        .zip(masks)
        .map(|((name, case), masks)| {
            let points = points(case, masks).map_err(|err| anyhow::anyhow!("{name}: {err}"))?;
            Ok(Prepared {
                name: name.clone(),
                stratum: case.stratum,
                tool: case.tool,
                straight: straight[&case.tool],
                symmetry: symmetries[&case.tool].clone(),
                truth: case.grasp_from_object,
                points,
            })
        })
        .collect()
}

fn measure(
    (folder, kind): (&Path, Masks),
    set: &CaseSet,
    masks: &[[Mask; 2]],
    engines: &[Registration],
    machine: Machine,
    output: &Output,
) -> anyhow::Result<Report> {
    let mut models = BTreeMap::new();
    let mut tools = Vec::new();
    for (&number, mesh) in &set.tools {
        let fastest = |f: &dyn Fn() -> bool| {
            (0..3)
                .map(|_| Instant::now())
                .map(|t| (f(), t.elapsed().as_secs_f64() * 1e3).1)
                .fold(f64::INFINITY, f64::min)
        };
        let model = ToolModel::new(mesh.clone()).map_err(|err| anyhow::anyhow!("tool {number}: {err}"))?;
        tools.push(ToolRow {
            tool: number,
            triangles: mesh.triangles.len(),
            straight: is_straight(mesh),
            field_ms: fastest(&|| DistanceField::from_mesh(mesh).is_ok()),
            build_ms: fastest(&|| ToolModel::new(mesh.clone()).is_ok()),
        });
        // Built when first asked for; asked for here, so that the first case of a tool is not charged for it.
        std::hint::black_box(LabModel::of(&model));
        models.insert(number, model);
    }
    let prepared = prepare(set, masks)?;
    let (mut lift_ms, mut whole_ms) = (Vec::new(), Vec::new());
    for ((_, case), masks) in set.cases.iter().zip(masks) {
        let model = &models[&case.tool];
        lift_ms.push(timed(|| points(case, masks)).median);
        let whole = || {
            let contacts = Contacts { points: &points(case, masks)?, images: &images(case) };
            Ok::<_, anyhow::Error>(register(contacts, model, Registration::default(), false)?)
        };
        whole_ms.push(timed(whole).median);
    }
    let quantiles = |ms: &[f64]| Quantiles {
        median_ms: quantile(ms.iter().copied(), 0.5),
        p95_ms: quantile(ms.iter().copied(), 0.95),
    };
    let mut rows = Vec::new();
    for &engine in engines {
        let (mut outcomes, mut offset_mm, mut calls) = (Vec::new(), Vec::new(), 0);
        let mut scored = Vec::new();
        let method = engine.method();
        let mut cpu_ms = Some(0.0);
        for (case, (_, whole)) in prepared.iter().zip(&set.cases) {
            output.step(&engine.to_string());
            let model = &models[&case.tool];
            let images = images(whole);
            let contacts = Contacts { points: &case.points, images: &images };
            // First, so that what is made once for a tool is not charged to its first case.
            let judged = register_with(&*method, contacts, model, Ask { evidence: true, ..OF_CASES });
            let before = thread_cpu_ms();
            let result = timed(|| register_with(&*method, contacts, model, OF_CASES));
            cpu_ms = cpu_ms.zip(thread_cpu_ms().zip(before)).map(|(sum, (after, before))| sum + after - before);
            calls += result.calls;
            offset_mm.push(
                result.value.as_ref().ok().map(|r| offset(r.grasp_from_object, case.truth_near(r.grasp_from_object))),
            );
            outcomes.push(outcome(case, result));
            scored.extend(judged.ok().and_then(|found| {
                Some(scores(
                    found.evidence.as_ref()?,
                    found.grasp_from_object,
                    case.truth_near(found.grasp_from_object),
                ))
            }));
        }
        rows.push(EngineRow {
            name: engine.to_string(),
            label: engine.label(),
            peer: false,
            error_deg: outcomes.iter().map(|o| Some(o.error_deg).filter(|e| e.is_finite())).collect(),
            ms: outcomes.iter().map(|o| Some(o.ms)).collect(),
            cpu_mean_ms: cpu_ms.map(|ms| ms / calls as f64),
            offset_mm,
            reliability: Reliability::of(&scored),
            summary: Summary::new(&outcomes),
        });
    }
    Ok(Report {
        default: Registration::default().to_string(),
        machine,
        folder: folder.to_owned(),
        masks: kind,
        depth_to_points: quantiles(&lift_ms),
        depth_to_pose: quantiles(&whole_ms),
        engines: rows,
        front: Vec::new(),
        notes: Vec::new(),
        tools,
        cases: prepared
            .iter()
            .map(|c| CaseRow {
                name: c.name.clone(),
                stratum: c.stratum.to_string(),
                tool: c.tool,
                points: c.points.len(),
                truth_deg: c.truth.theta_rad.to_degrees(),
            })
            .collect(),
    })
}

fn outcome(case: &Prepared, timed: Timed<Result<AlignReport, AlignError>>) -> Outcome {
    let report = timed.value.as_ref().ok();
    let pose = report.map(|r| r.grasp_from_object);
    Outcome {
        stratum: case.stratum,
        straight: case.straight,
        error_deg: pose.map_or(f64::NAN, |p| angle_error(p.theta_rad, case.truth_near(p).theta_rad).to_degrees()),
        position_mm: pose.map_or(f64::NAN, |p| position_error_mm(p, case.truth_near(p))),
        ms: timed.median,
    }
}

fn text(report: &Report) -> String {
    let number = |v: Option<f64>, digits: usize| v.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    let mut text = format!("{}\n{} cases, {} masks\n", report.machine.text(), report.cases.len(), report.masks);
    let slowest = |of: &dyn Fn(&ToolRow) -> f64| report.tools.iter().map(of).fold(0.0, f64::max);
    text += &format!(
        "tools: field at most {:.1} ms, everything at most {:.1} ms; depth and mask to points {} ms, to pose {} ms\n\n",
        slowest(&|t| t.field_ms),
        slowest(&|t| t.build_ms),
        number(report.depth_to_points.median_ms, 3),
        number(report.depth_to_pose.median_ms, 3),
    );
    let width = report.engines.iter().map(|e| e.name.len()).max().unwrap_or(6).max(6);
    text += &format!(
        "{:width$} {:>4} {:>10} {:>10} {:>7} {:>8} {:>7} {:>7} {:>7} {:>7}\n",
        "engine", "n", "median ms", "p95 ms", "mean °", "median °", "<=5° %", "<=10° %", ">20° %", "pos. mm"
    );
    for row in &report.engines {
        let f = &row.summary.all;
        text += &format!(
            "{:width$} {:>4} {:>10} {:>10} {:>9} {:>7} {:>8} {:>7.1} {:>7.1} {:>7.1} {:>7}{}\n",
            row.name,
            f.angles.count,
            number(f.median_ms, 3),
            number(f.p95_ms, 3),
            number(row.cpu_mean_ms, 3),
            number(f.angles.mean_deg, 2),
            number(f.angles.median_deg, 2),
            f.angles.success_5,
            f.angles.success_10,
            f.gross_20,
            number(f.position_median_mm, 2),
            if row.name == report.default { "  <- default" } else { "" },
        );
    }
    text += "\nper stratum: mean °, <=5° %, <=10° %\n";
    for row in &report.engines {
        let strata: Vec<String> = row
            .summary
            .strata
            .iter()
            .map(|(name, f)| {
                let mean = number(f.angles.mean_deg, 2);
                format!("{name} {mean} {:.1} {:.1}", f.angles.success_5, f.angles.success_10)
            })
            .collect();
        text += &format!("{:width$} {}\n", row.name, strata.join(" | "));
    }
    text += "\nerrors in standard deviations, rms (within two): 1 (95 %) where these are right\n";
    for row in &report.engines {
        let Some(reliability) = &row.reliability else { continue };
        text += &format!("{:width$} {}\n", row.name, reliability.text());
    }
    for note in &report.notes {
        text += &format!("note: {note}\n");
    }
    text
}
