//! `touch2touch-bench generator`: error against time of sampler, steps and engine, on simulated grasps.

pub(super) mod cases;
mod timing;

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use strum::IntoEnumIterator as _;

use self::cases::{Case, Judge, Score};
pub(super) use self::timing::timed_run;
use self::timing::{First, Overhead};
use super::Machine;
use super::figures::quantile;
use super::front::{self, FrontPoint};
use crate::json::{JsonArgs, write};
use touch2touch::headless::{Output, VerbResult};
use touch2touch_core::diffusion::{GenerateConfig, Sampler, Spacing};
use touch2touch_core::metrics::AngleSummary;
use touch2touch_core::pose::Registration;
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::infer::engine::{EngineChoice, EngineKind, resolve};
use touch2touch_pipeline::infer::generator::Generator;
use touch2touch_pipeline::infer::mask::MaskModel;
use touch2touch_pipeline::steps::bundles::{self, BundleKind};

/// Sampler and steps that everything is measured against.
const REFERENCE: (Sampler, u32) = (Sampler::Ddim, 200);
/// Largest error of the knee, relative to the reference's, and the share of its time that it may take.
const WORSE: f64 = 1.02;
const SHARE: f64 = 0.1;

/// Arguments of `bench generator`.
#[derive(Debug, Args)]
pub(super) struct GeneratorArgs {
    /// The generator's bundle (default: the shipped one).
    #[arg(long)]
    bundle: Option<PathBuf>,
    /// The mask model's bundle (default: the shipped one); it finds the contact that the poses come from.
    #[arg(long)]
    mask_bundle: Option<PathBuf>,
    /// Simulated grasps, spread over the tools; both fingers of each are predicted.
    #[arg(long, default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    grasps: u32,
    /// Only tools that the generator was trained on, or only the others.
    #[arg(long, value_enum, default_value_t = Tools::All)]
    tools: Tools,
    /// Seed of grasps and sensor noise.
    #[arg(long, default_value_t = 7)]
    seed: u64,
    /// Numbers of steps to try, separated by commas.
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2, 3, 4, 6, 8, 10, 15, 20, 50])]
    steps: Vec<u32>,
    /// Samplers to try, separated by commas.
    #[arg(long, value_delimiter = ',')]
    samplers: Vec<Sampler>,
    /// Spacings to try, separated by commas: trailing, lab.
    #[arg(long, value_delimiter = ',', default_value = "trailing")]
    spacings: Vec<Spacing>,
    /// Only this engine, by its name for `--runtime`. Without it, all that are found; all but the first on a quarter of the
    /// grasps.
    #[arg(long)]
    engine: Option<EngineChoice>,
    /// The registration of the poses.
    #[arg(long, default_value_t = Registration::default())]
    registration: Registration,
    #[command(flatten)]
    json: JsonArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum Tools {
    All,
    Seen,
    Unseen,
}

/// One way to generate.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    engine: EngineKind,
    sampler: Sampler,
    spacing: Spacing,
    /// Steps asked for.
    steps: u32,
    /// Both fingers of a grasp in one batch: image to meters, milliseconds of the clock.
    median_ms: f64,
    /// Median over the grasps of this row's time by the reference's time on the same grasp, measured right after it.
    share_of_reference: Option<f64>,
    /// Against the noise-free imprint, over all pixels of both fingers, millimeters.
    rmse_mm: f64,
    /// Mean over the imprints, peak 0.0225 m, decibels.
    psnr_db: f64,
    angles: AngleSummary,
    /// Grasps without a pose: the mask was empty.
    no_pose: usize,
    /// One value per grasp.
    ms: Vec<f64>,
    rmse_of_grasp_mm: Vec<f64>,
    error_deg: Vec<Option<f64>>,
}

/// The fastest way that is as good as the reference.
#[derive(Debug, Serialize)]
struct Knee {
    engine: EngineKind,
    /// By root mean square error and mean angle error: within 2 % of the reference in at most a tenth of its time.
    both: Option<String>,
}

#[derive(Debug, Serialize)]
struct Report {
    machine: Machine,
    bundle: String,
    bundle_hash: String,
    defaults: GenerateConfig,
    registration: Registration,
    grasps: usize,
    tools: Tools,
    seed: u64,
    /// The pose error of the measured imprints by the same masks and registration: what no generator is better than.
    measured: AngleSummary,
    rows: Vec<Row>,
    knees: Vec<Knee>,
    overhead: Vec<Overhead>,
    first: Vec<First>,
    front_angle: Vec<FrontPoint>,
    front_rmse: Vec<FrontPoint>,
}

pub(super) fn run(args: &GeneratorArgs) -> VerbResult {
    let available = bundles::find(&[]);
    let bundle =
        available.take(BundleKind::Generator, args.bundle.as_deref(), &Rig::lab())?.open("Open the generator")?;
    let spec = bundle.generator().ok_or_else(|| anyhow::anyhow!("{} is not a generator", bundle.name()))?;
    let (defaults, training_steps) = (spec.defaults, spec.schedule.training_steps());
    let mask_bundle =
        available.take(BundleKind::Mask, args.mask_bundle.as_deref(), &Rig::lab())?.open("Open the mask model")?;
    let engines = engines(args.engine)?;
    let machine = Machine::now();
    let configs = configs(args, defaults, training_steps);
    let cases = cases::simulate(args.grasps as usize, args.seed, |seen| match args.tools {
        Tools::All => true,
        Tools::Seen => seen,
        Tools::Unseen => !seen,
    })?;
    let mut judge = Judge::new(MaskModel::open(&mask_bundle, EngineChoice::Auto)?, args.registration);
    let measured = judge.measured(&cases)?;

    let subset = |engine: usize| match engine {
        0 => cases.iter().collect::<Vec<_>>(),
        _ => cases.iter().step_by(4).collect(),
    };
    let total: usize = (0..engines.len()).map(|e| subset(e).len()).sum();
    let output = Output::new(args.json.common(), "generating", total);
    let (mut rows, mut overhead, mut first) = (Vec::new(), Vec::new(), Vec::new());
    for (index, &engine) in engines.iter().enumerate() {
        let (wait, mut generator) = timing::first(&bundle, engine, &cases[0], &defaults)?;
        first.push(wait);
        rows.extend(measure(&mut generator, engine, &configs, &subset(index), &mut judge, &output)?);
        overhead.push(timing::overhead(&mut generator, engine, &cases, &defaults)?);
    }
    let knees = engines.iter().map(|&engine| knee(engine, &rows)).collect();
    let mut report = Report {
        machine,
        bundle: bundle.name().to_owned(),
        bundle_hash: bundle.hash().to_owned(),
        defaults,
        registration: args.registration,
        grasps: cases.len(),
        tools: args.tools,
        seed: args.seed,
        measured,
        front_angle: points(&rows, |row| Some((row.angles.mean_deg?, row.angles.median_deg?))),
        front_rmse: points(&rows, |row| Some((row.rmse_mm, quantile(row.rmse_of_grasp_mm.iter().copied(), 0.5)?))),
        rows,
        knees,
        overhead,
        first,
    };
    report.rows.sort_by(|a, b| {
        (a.engine, a.median_ms).partial_cmp(&(b.engine, b.median_ms)).unwrap_or(std::cmp::Ordering::Equal)
    });
    if let Some(file) = args.json.file() {
        write(file, &report)?;
        output.note(&format!("written: {} (pictures of both fronts beside it)", file.display()));
    }
    output.finish(&report, || text(&report))?;
    Ok(true)
}

fn engines(only: Option<EngineChoice>) -> anyhow::Result<Vec<EngineKind>> {
    match only {
        Some(choice) => Ok(vec![resolve(choice)?]),
        None => {
            // What the studio would take comes first: it is measured on every grasp.
            let mut engines = vec![resolve(EngineChoice::Auto)?];
            engines.extend(resolve(EngineChoice::Rten).ok().filter(|rten| !engines.contains(rten)));
            Ok(engines)
        }
    }
}

/// The reference first, then everything asked for, each once.
fn configs(args: &GeneratorArgs, defaults: GenerateConfig, training_steps: usize) -> Vec<GenerateConfig> {
    let with = |sampler, steps, spacing| GenerateConfig { sampler, steps, spacing, eta: 0.0, ..defaults };
    let limit = u32::try_from(training_steps).unwrap_or(u32::MAX);
    let mut configs = vec![with(REFERENCE.0, REFERENCE.1.min(limit), defaults.spacing), defaults];
    let samplers = if args.samplers.is_empty() { Sampler::iter().collect() } else { args.samplers.clone() };
    for &spacing in &args.spacings {
        for &sampler in &samplers {
            // With one step every sampler is the same.
            let steps = args.steps.iter().filter(|&&s| s <= limit && (s > 1 || sampler == samplers[0]));
            configs.extend(steps.map(|&steps| with(sampler, steps, spacing)));
        }
    }
    let mut unique: Vec<GenerateConfig> = Vec::new();
    for config in configs {
        if !unique.contains(&config) {
            unique.push(config);
        }
    }
    unique
}

fn name(config: &GenerateConfig, engine: EngineKind, several: bool) -> String {
    let sampler = match config.sampler {
        Sampler::Ddim => "DDIM",
        Sampler::Ddpm => "DDPM",
    };
    let lab = if config.spacing == Spacing::Lab { " lab" } else { "" };
    let engine = if several { format!(" {}", EngineChoice::from(engine).key()) } else { String::new() };
    format!("{sampler} {}{lab}{engine}", config.steps)
}

/// All configurations on one grasp, then the next grasp: a busy minute of the machine hits them all alike.
fn measure(
    generator: &mut Generator,
    engine: EngineKind,
    configs: &[GenerateConfig],
    cases: &[&Case],
    judge: &mut Judge,
    output: &Output,
) -> anyhow::Result<Vec<Row>> {
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); configs.len()];
    let mut scores: Vec<Vec<Score>> = configs.iter().map(|_| Vec::new()).collect();
    for case in cases {
        output.step(&case.name);
        for (index, config) in configs.iter().enumerate() {
            let (ms, imprints) = timed_run(generator, &case.sample, config)?;
            times[index].push(ms);
            scores[index].push(judge.score(case, &imprints)?);
        }
    }
    let rows = configs.iter().zip(times.iter().zip(&scores)).map(|(config, (ms, scores))| {
        let squares: f64 = scores.iter().map(|s| s.mse_m2).sum::<f64>() / scores.len().max(1) as f64;
        let psnr: Vec<f64> = scores.iter().flat_map(|s| s.psnr_db).flatten().collect();
        let errors: Vec<f64> = scores.iter().filter_map(|s| s.error_rad).collect();
        let shares = ms.iter().zip(&times[0]).map(|(ms, reference)| ms / reference);
        Row {
            name: name(config, engine, false),
            engine,
            sampler: config.sampler,
            spacing: config.spacing,
            steps: config.steps,
            median_ms: quantile(ms.iter().copied(), 0.5).unwrap_or(f64::NAN),
            share_of_reference: quantile(shares, 0.5),
            rmse_mm: squares.sqrt() * 1e3,
            psnr_db: psnr.iter().sum::<f64>() / psnr.len().max(1) as f64,
            angles: AngleSummary::from_errors(&errors),
            no_pose: scores.len() - errors.len(),
            ms: ms.clone(),
            rmse_of_grasp_mm: scores.iter().map(|s| s.mse_m2.sqrt() * 1e3).collect(),
            error_deg: scores.iter().map(|s| Some(s.error_rad?.to_degrees())).collect(),
        }
    });
    Ok(rows.collect())
}

fn knee(engine: EngineKind, rows: &[Row]) -> Knee {
    let mut own: Vec<&Row> = rows.iter().filter(|row| row.engine == engine).collect();
    let reference = own.iter().find(|row| (row.sampler, row.steps) == REFERENCE).copied();
    own.sort_by(|a, b| a.median_ms.total_cmp(&b.median_ms));
    let rmse = |row: &Row, reference: &Row| row.rmse_mm <= WORSE * reference.rmse_mm;
    let angle = |row: &Row, reference: &Row| {
        let pair = row.angles.mean_deg.zip(reference.angles.mean_deg);
        row.no_pose <= reference.no_pose && pair.is_some_and(|(row, reference)| row <= WORSE * reference)
    };
    let fast = |row: &Row| row.share_of_reference.is_some_and(|share| share <= SHARE);
    let knee = reference
        .and_then(|reference| own.iter().find(|row| fast(row) && rmse(row, reference) && angle(row, reference)));
    Knee { engine, both: knee.map(|row| row.name.clone()) }
}

fn points(rows: &[Row], error: impl Fn(&Row) -> Option<(f64, f64)>) -> Vec<FrontPoint> {
    let first = rows.first().map(|row| row.engine);
    let point = |row: &Row| {
        let (mean, median) = error(row)?;
        Some(FrontPoint {
            name: row.name.clone(),
            peer: false,
            ms: row.median_ms,
            mean_deg: mean,
            median_deg: median,
            on_front: false,
        })
    };
    front::pareto(rows.iter().filter(|row| Some(row.engine) == first).filter_map(point).collect())
}

fn text(report: &Report) -> String {
    let number = |v: Option<f64>, digits: usize| v.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    let mut text = format!(
        "{}\n{}, {} grasps, both fingers; measured imprints with the same masks: mean {}°, median {}°\n\n",
        report.machine.text(),
        report.bundle,
        report.grasps,
        number(report.measured.mean_deg, 2),
        number(report.measured.median_deg, 2)
    );
    text += &format!(
        "{:<14} {:<6} {:>9} {:>9} {:>8} {:>8} {:>8} {:>9} {:>7} {:>7}\n",
        "sampler steps",
        "engine",
        "median ms",
        "of ref. %",
        "rmse mm",
        "PSNR dB",
        "mean °",
        "median °",
        "<=5° %",
        "no pose"
    );
    for row in &report.rows {
        let engine = EngineChoice::from(row.engine).key();
        let reference = (row.sampler, row.steps) == REFERENCE;
        let default = row.sampler == report.defaults.sampler
            && (row.steps, row.spacing) == (report.defaults.steps, report.defaults.spacing);
        text += &format!(
            "{:<14} {engine:<6} {:>9.1} {:>9} {:>8.3} {:>8.2} {:>8} {:>9} {:>7.1} {:>7}{}{}\n",
            row.name,
            row.median_ms,
            number(row.share_of_reference.map(|s| 100.0 * s), 1),
            row.rmse_mm,
            row.psnr_db,
            number(row.angles.mean_deg, 2),
            number(row.angles.median_deg, 2),
            row.angles.success_5,
            row.no_pose,
            if reference { "  <- reference" } else { "" },
            if default { "  <- default" } else { "" },
        );
    }
    text += "\nknee: within 2 % of the reference in at most a tenth of its time\n";
    for knee in &report.knees {
        text += &format!("{}: {}\n", knee.engine.label(), knee.both.as_deref().unwrap_or("none"));
    }
    for o in &report.overhead {
        text += &format!(
            "{}: overhead of the sampler over the bare graphs {:.2} % of the shortest runs\n",
            o.engine.label(),
            o.percent_of_shortest
        );
    }
    for f in &report.first {
        text += &format!("{}: first result cold {:.0} ms, warm {:.0} ms\n", f.engine.label(), f.cold_ms, f.warm_ms);
    }
    text
}
