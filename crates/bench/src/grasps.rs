//! `touch2touch-bench grasps`: poses, answers and verdicts of fresh grasps at any turn and place, and of the lab's, where the
//! registration looks among all poses and where it looks among the lab's.
//!
//! Half of the grasps are of the lab's tools and half of drawn ones; half are felt by the nominal membrane, which hangs from the
//! tool, and half by a soap film that reaches the middle plane. One of five is a hard one, as in [`known::Suite`].

use std::f64::consts::PI;
use std::time::Instant;

use clap::Args;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::Machine;
use super::figures::quantile;
use super::registration::{images, is_straight, points};
use crate::json::JsonArgs;
use touch2touch::headless::{Output, VerbResult};
use touch2touch_bench::known::{Case, Stratum, spoilt};
use touch2touch_bench::random_tool::random_tool;
use touch2touch_core::align::{Ask, Contacts, Evidence, PadImage, Range};
use touch2touch_core::catalog::{self, ToolSpec};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::pose::{Registration, ToolModel, register_with};
use touch2touch_core::rig::CameraTolerance;
use touch2touch_core::sim::{BubbleConfig, Grasp, SimConfig, random_grasp, random_grasp_within, simulate};
use touch2touch_core::symmetry::Symmetry;
use touch2touch_core::verdict::{Grade, SignKind, Verdict};

/// A pose this far off is right, degrees; and millimeters, for an answer beside the first.
const RIGHT_DEG: f64 = 5.0;
const RIGHT_MM: f64 = 5.0;
/// Answers this near are one, up to the symmetry of the tool, degrees.
const SAME_DEG: f64 = 0.1;
/// Farthest place of a grasp at any turn, meters.
const ANY_PLACE_M: f64 = 0.015;
/// Drawn tools.
const DRAWN: usize = 24;
/// Calls of which the shortest is the time: other programs only add to it.
const CALLS: usize = 5;
/// Errors of an angle that are compared with its deviation, degrees, and deviations that one of them counts at most.
const NEAR_DEG: f64 = 10.0;
const MOST_SD: f64 = 5.0;
/// Bins of the weights.
const BINS: usize = 10;

/// Arguments of `bench grasps`.
#[derive(Debug, Args)]
pub(super) struct GraspsArgs {
    /// Grasps of each set.
    #[arg(long, default_value_t = 120, value_parser = clap::value_parser!(u32).range(4..=100_000))]
    grasps: u32,
    /// Seed of tools, grasps, noise and masks.
    #[arg(long, default_value_t = 1)]
    simulation_seed: u64,
    /// Standard deviations of the cameras' poses, degrees and millimeters, which the rig then says: `3,1`.
    #[arg(long, value_delimiter = ',')]
    cameras: Option<Vec<f64>>,
    #[command(flatten)]
    json: JsonArgs,
}

impl GraspsArgs {
    fn tolerance(&self) -> CameraTolerance {
        let [angle_deg, place_mm] = self.cameras.as_deref().unwrap_or_default() else {
            return CameraTolerance::default();
        };
        CameraTolerance { angle_deg: *angle_deg, place_mm: *place_mm }
    }
}

/// Set of grasps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, strum::EnumIter, strum::Display)]
#[serde(rename_all = "snake_case")]
enum Reach {
    /// The full turn, 15 mm.
    #[strum(to_string = "any grasp")]
    Any,
    /// The lab's grid.
    #[strum(to_string = "lab's grid")]
    Lab,
}

impl Reach {
    fn grasp(self, seed: u64) -> Grasp {
        match self {
            Self::Any => random_grasp_within(seed, PI, ANY_PLACE_M),
            Self::Lab => random_grasp(seed),
        }
    }
}

/// A grasp as it is registered.
struct Held {
    reach: Reach,
    case: Case,
    hangs: bool,
    /// Position of a tool that it is not of.
    other: usize,
    tolerance: CameraTolerance,
}

fn held(tools: &[ToolSpec], reach: Reach, seed: u64, position: usize, tolerance: CameraTolerance) -> Held {
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(position as u64));
    rng.set_stream(reach as u64 + 1);
    let lab = catalog::tools().len();
    // Of four grasps two are of one of the lab's tools and two of a drawn one, under either membrane.
    let (four, hangs, drawn) = (position / 4, position.is_multiple_of(2), position % 4 >= 2);
    let tool = if drawn { lab + four % DRAWN } else { four % lab };
    let stratum = if four % 5 == 4 { Stratum::Hard } else { Stratum::Nominal };
    let mut config = SimConfig::default();
    if !hangs {
        config.bubble = BubbleConfig::film(tools[tool].half_thickness_m);
    }
    config.bubble.calibration_rad = tolerance.angle_deg.to_radians();
    config.bubble.calibration_m = tolerance.place_mm * 1e-3;
    config.bubble.dropped_share = 0.0;
    if stratum == Stratum::Hard {
        config.bubble.noise_m *= 1.5;
        config.bubble.press_m *= if hangs { 2.0 / 3.0 } else { 1.0 };
    }
    let sample = simulate(&tools[tool], reach.grasp(rng.random()), rng.random(), &config);
    let case = spoilt(&sample, tool, stratum, &mut rng);
    let other = (tool + rng.random_range(1..tools.len())) % tools.len();
    Held { reach, case, hangs, other, tolerance }
}

/// An answer beside the truth.
#[derive(Clone, Copy, Debug, Serialize)]
struct Listed {
    weight: f64,
    right: bool,
}

/// Result of one range for a grasp.
#[derive(Clone, Debug, Serialize)]
struct Found {
    /// Up to the tool's symmetry; `null` without a pose.
    error_deg: Option<f64>,
    position_mm: Option<f64>,
    ms: f64,
    verdict: Option<Verdict>,
    evidence: Option<Evidence>,
    /// The answers with their weights, those that are alike as one.
    answers: Vec<Listed>,
    /// Verdict on the pose of a tool that it is not of; none without a pose.
    wrong_tool: Option<Verdict>,
    explained: f64,
}

/// One grasp.
#[derive(Clone, Debug, Serialize)]
struct Row {
    reach: Reach,
    position: usize,
    tool: String,
    /// True for one of the lab's tools.
    lab: bool,
    hangs: bool,
    stratum: String,
    truth_deg: f64,
    truth_mm: [f64; 2],
    /// Number of turns that take the tool to itself.
    turns: usize,
    free: Found,
    labs_range: Found,
}

/// Tools with what the truth is compared by.
struct Tools {
    specs: Vec<ToolSpec>,
    models: Vec<ToolModel>,
    straight: Vec<bool>,
}

/// Errors of a pose, degrees and millimeters, up to the tool's symmetry.
fn errors(pose: PlanarPose, truth: PlanarPose, symmetry: &Symmetry) -> (f64, f64) {
    let off = symmetry.difference(pose, truth);
    (off.angle_rad.to_degrees(), off.position_m * 1e3)
}

fn found(held: &Held, range: Range, tools: &Tools) -> Found {
    let engine = Registration::Joint(range);
    let case = &held.case;
    let images = images(case).map(|image| PadImage { tolerance: held.tolerance, ..image });
    let points = points(case, &case.masks).unwrap_or_default();
    let contacts = Contacts { points: &points, images: &images };
    let method = engine.method();
    let ask = Ask { in_lab_grid: held.reach == Reach::Lab, ..Ask::default() };
    let judged =
        |tool: usize| register_with(&*method, contacts, &tools.models[tool], Ask { evidence: true, ..ask }).ok();
    // First, so that what is made once for a tool is not charged to its first case.
    let report = judged(case.tool);
    let times = (0..CALLS).map(|_| {
        let begin = Instant::now();
        std::hint::black_box(register_with(&*method, contacts, &tools.models[case.tool], ask).is_ok());
        begin.elapsed().as_secs_f64() * 1e3
    });
    let ms = times.fold(f64::INFINITY, f64::min);
    let symmetry = Symmetry::of(&tools.models[case.tool]);
    let off = report.as_ref().map(|report| errors(report.grasp_from_object, case.grasp_from_object, &symmetry));
    let is_right = |(deg, mm): (f64, f64)| deg <= RIGHT_DEG && (mm <= RIGHT_MM || tools.straight[case.tool]);
    let mut answers: Vec<(PlanarPose, Listed)> = Vec::new();
    for answer in report.iter().flat_map(|report| &report.answers) {
        let pose = answer.grasp_from_object;
        let right = is_right(errors(pose, case.grasp_from_object, &symmetry));
        // Of one answer the tool's symmetry makes several of equal weight.
        match answers.iter_mut().find(|(known, _)| errors(*known, pose, &symmetry).0 < SAME_DEG) {
            Some((_, first)) => first.weight += answer.weight,
            None => answers.push((pose, Listed { weight: answer.weight, right })),
        }
    }
    Found {
        error_deg: off.map(|(deg, _)| deg),
        position_mm: off.map(|(_, mm)| mm),
        ms,
        verdict: report.as_ref().and_then(Verdict::of),
        evidence: report.as_ref().and_then(|report| report.evidence),
        answers: answers.into_iter().map(|(_, listed)| listed).collect(),
        wrong_tool: judged(held.other).as_ref().and_then(Verdict::of),
        explained: report.and_then(|report| report.joint).map_or(0.0, |fit| fit.explained),
    }
}

/// A line of the table. Shares in percent.
#[derive(Debug, Serialize)]
struct Line {
    grasps: usize,
    within_5: f64,
    mean_deg: Option<f64>,
    median_deg: Option<f64>,
    p95_deg: Option<f64>,
    median_ms: Option<f64>,
    p95_ms: Option<f64>,
    /// Grasps of which an answer is right.
    listed: f64,
    /// Mean difference of weight and share of right answers over bins of the weight.
    calibration: f64,
    /// Grasps of tools that no turn takes to themselves, of which an answer beside the right one is told.
    second: f64,
    /// Root mean square of the angle's error over its deviation, where that is below 10 degrees and the membranes had a say.
    deviations: f64,
    /// Right poses that are doubted, and called wrong.
    right_doubted: f64,
    right_wrong: f64,
    /// Poses of tools that it is not of that are doubted, and called wrong, or that have none.
    other_told: f64,
    other_wrong: f64,
}

impl Line {
    fn new(rows: &[&Row], of: impl Fn(&Row) -> &Found) -> Self {
        let all: Vec<(&Row, &Found)> = rows.iter().map(|row| (*row, of(row))).collect();
        let share = |among: &dyn Fn(&Row, &Found) -> bool, is: &dyn Fn(&Found) -> bool| {
            let among = all.iter().filter(|(row, found)| among(row, found));
            let (count, of) = among.fold((0, 0), |(count, of), (_, found)| (count + usize::from(is(found)), of + 1));
            100.0 * count as f64 / (of as f64).max(1.0)
        };
        let any = |_: &Row, _: &Found| true;
        let right = |found: &Found| found.error_deg.is_some_and(|deg| deg <= RIGHT_DEG);
        let degrees = || all.iter().map(|(_, found)| found.error_deg.unwrap_or(180.0));
        let graded = |verdict: &Option<Verdict>, least: Grade| verdict.as_ref().is_none_or(|v| v.grade >= least);
        let (mut bins, mut listed) = ([(0usize, 0.0, 0usize); BINS], 0usize);
        for answer in all.iter().flat_map(|(_, found)| &found.answers) {
            let bin = &mut bins[((answer.weight * BINS as f64) as usize).min(BINS - 1)];
            *bin = (bin.0 + 1, bin.1 + answer.weight, bin.2 + usize::from(answer.right));
            listed += 1;
        }
        let told = all.iter().filter_map(|(_, found)| Some((found.error_deg?, found.verdict.as_ref()?)));
        let by_membrane = |verdict: &Verdict| verdict.against.iter().all(|sign| sign.kind != SignKind::MaskAlone);
        let near = told.filter(|(deg, verdict)| *deg < NEAR_DEG && by_membrane(verdict));
        let squares: Vec<f64> =
            near.map(|(deg, verdict)| (deg.to_radians() / verdict.angle.sd).min(MOST_SD).powi(2)).collect();
        let apart = bins.iter().map(|(_, weight, right)| (weight - *right as f64).abs()).sum::<f64>();
        Self {
            grasps: all.len(),
            within_5: share(&any, &right),
            mean_deg: (!all.is_empty()).then(|| degrees().sum::<f64>() / all.len() as f64),
            median_deg: quantile(degrees(), 0.5),
            p95_deg: quantile(degrees(), 0.95),
            median_ms: quantile(all.iter().map(|(_, found)| found.ms), 0.5),
            p95_ms: quantile(all.iter().map(|(_, found)| found.ms), 0.95),
            listed: share(&any, &|found| found.answers.iter().any(|answer| answer.right)),
            calibration: apart / (listed as f64).max(1.0),
            second: share(&|row, _| row.turns == 0, &|found| {
                found.answers.iter().any(|answer| answer.right) && found.answers.iter().any(|answer| !answer.right)
            }),
            deviations: (squares.iter().sum::<f64>() / (squares.len() as f64).max(1.0)).sqrt(),
            right_doubted: share(&|_, found| right(found), &|found| graded(&found.verdict, Grade::Check)),
            right_wrong: share(&|_, found| right(found), &|found| graded(&found.verdict, Grade::Wrong)),
            other_told: share(&any, &|found| graded(&found.wrong_tool, Grade::Check)),
            other_wrong: share(&any, &|found| graded(&found.wrong_tool, Grade::Wrong)),
        }
    }

    fn text(&self, name: &str) -> String {
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
        format!(
            "{name:34} {:>5} {:>6.1} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6.1} {:>6.3} {:>6.1} {:>6.2} {:>6.1} {:>6.1} {:>6.1} {:>6.1}\n",
            self.grasps,
            self.within_5,
            number(self.mean_deg),
            number(self.median_deg),
            number(self.p95_deg),
            number(self.median_ms),
            number(self.p95_ms),
            self.listed,
            self.calibration,
            self.second,
            self.deviations,
            self.right_doubted,
            self.right_wrong,
            self.other_told,
            self.other_wrong,
        )
    }
}

#[derive(Serialize)]
struct Report {
    machine: Machine,
    lines: Vec<(String, Line)>,
    rows: Vec<Row>,
}

/// The lines of the table: each set by both ranges, and of the free one its parts.
fn lines(rows: &[Row]) -> Vec<(String, Line)> {
    type Part = (&'static str, fn(&Row) -> bool);
    let parts: [Part; 5] = [
        ("", |_| true),
        (", lab's tools", |row| row.lab),
        (", drawn tools", |row| !row.lab),
        (", hanging", |row| row.hangs),
        (", reaching", |row| !row.hangs),
    ];
    let mut lines = Vec::new();
    for reach in [Reach::Any, Reach::Lab] {
        let of = |part: fn(&Row) -> bool| -> Vec<&Row> {
            rows.iter().filter(|row| row.reach == reach && part(row)).collect()
        };
        for (name, part) in parts {
            lines.push((format!("{reach}: free{name}"), Line::new(&of(part), |row| &row.free)));
        }
        lines.push((format!("{reach}: lab's range"), Line::new(&of(|_| true), |row| &row.labs_range)));
    }
    lines
}

fn text(report: &Report) -> String {
    let head = "grasps: range                          n   <=5°   mean median    p95     ms p95 ms listed  calib second    rms doubted  wrong  other  wrong";
    let lines: String = report.lines.iter().map(|(name, line)| line.text(name)).collect();
    format!("{}\n\n{head}\n{lines}", report.machine.text())
}

pub(super) fn run(args: &GraspsArgs) -> VerbResult {
    let seed = args.simulation_seed;
    let drawn = (0..DRAWN as u64).map(|i| random_tool(seed.wrapping_mul(7919).wrapping_add(i)));
    let specs: Vec<ToolSpec> = catalog::tools().iter().cloned().chain(drawn).collect();
    let meshes: Vec<_> = specs.iter().map(ToolSpec::mesh).collect();
    let straight = meshes.iter().map(is_straight).collect();
    let models = meshes.into_iter().map(ToolModel::new).collect::<Result<_, _>>()?;
    let tools = Tools { specs, models, straight };
    let output = Output::new(args.json.common(), "registering", 2 * args.grasps as usize);
    let mut rows = Vec::new();
    for reach in [Reach::Any, Reach::Lab] {
        for position in 0..args.grasps as usize {
            let held = held(&tools.specs, reach, seed, position, args.tolerance());
            let tool = held.case.tool;
            output.step(&tools.specs[tool].name);
            let truth = held.case.grasp_from_object;
            rows.push(Row {
                reach,
                position,
                tool: tools.specs[tool].name.clone(),
                lab: tool < catalog::tools().len(),
                hangs: held.hangs,
                stratum: held.case.stratum.to_string(),
                truth_deg: truth.theta_rad.to_degrees(),
                truth_mm: [truth.y_m * 1e3, truth.z_m * 1e3],
                turns: Symmetry::of(&tools.models[tool]).turns.len(),
                free: found(&held, Range::FREE, &tools),
                labs_range: found(&held, Range::LAB, &tools),
            });
        }
    }
    let report = Report { machine: Machine::now(), lines: lines(&rows), rows };
    args.json.write(&report)?;
    output.finish(&report, || text(&report))?;
    Ok(true)
}
