//! `touch2touch pose`: in-hand poses of a whole dataset, with the error against the truth where it is known.

use std::collections::BTreeMap;
use std::path::Path;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use serde::Serialize;
use strum::IntoEnumIterator as _;

use super::args::{DatasetArgs, LimitArgs};
use super::contact_mask::{MaskArgs, labels_of};
use super::guard::{Bug, guarded};
use super::notes::Notes;
use super::output::says;
use super::predict::{ModelArgs, Predictor};
use super::report::output_stems;
use super::seeds::{self, FanArgs, PoseFan, SeedArgs};
use super::{Common, Output, ToolArgs, VerbResult};
use crate::domain::align::{AlignReport, Ask, LabIcpConfig, PaperTrap, Register, lab_starts};
use crate::domain::ambiguity::{Ambiguity, ambiguity};
use crate::domain::dataset::{PairId, Problem};
use crate::domain::findings::Finding;
use crate::domain::frames::PlanarPose;
use crate::domain::hand::{AcceptedPose, HandPose};
use crate::domain::metrics::AngleSummary;
use crate::domain::pose::{Registration, ToolModel};
use crate::domain::rig::PerPad;
use crate::domain::units::angle_error;
use crate::io::dataset::Dataset;
use crate::work::job::JobCx;
use crate::work::labels::{ImprintSource, Labels};
use crate::work::mask::MaskInputs;
use crate::work::pose::{PoseResult, pose};

/// Arguments of `pose`.
#[derive(Debug, Args)]
pub(super) struct PoseArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Which imprints to align.
    #[arg(long, value_enum, default_value_t = Imprints::Measured)]
    imprint: Imprints,
    #[command(flatten)]
    mask: MaskArgs,
    #[command(flatten)]
    tool: ToolArgs,
    /// The registration: the key of one, `default`, `lab` (the paper's), or `all`, one after the other.
    #[arg(long, value_name = "ENGINE", default_value = "default", value_parser = parse_engines())]
    engine: Engines,
    /// Start here instead of where the registration would: `DEGREES,Y_MM,Z_MM` of the tool in the hand, such as
    /// `10,0,-2`. Repeat for several.
    #[arg(long = "start", value_name = "DEG,MM,MM", value_parser = parse_start, allow_hyphen_values = true)]
    starts: Vec<PlanarPose>,
    /// Give the paper's registration its ten random starts, drawn from this seed.
    #[arg(long, value_name = "SEED", conflicts_with = "starts")]
    paper_starts: Option<u64>,
    /// Switch on a trap of the paper's registration: `wrong-frame` (starts are applied in the wrong frame),
    /// `rmse-choice` (chosen by model-to-contact distance within 15 mm), `fixed-iterations` (no stop test).
    /// Repeat for several.
    #[arg(long = "paper-trap", value_name = "TRAP", value_parser = parse_trap)]
    paper_traps: Vec<PaperTrap>,
    #[command(flatten)]
    limit: LimitArgs,
    /// Add the whole registration report to each case of the JSON: every start and iteration, and each point's
    /// residual, weight and fate.
    #[arg(long)]
    trace: bool,
    #[command(flatten)]
    ensemble: SeedArgs,
    #[command(flatten)]
    fans: FanArgs,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Imprints {
    Measured,
    Predicted,
    Both,
}

/// The registrations to run, in this order.
#[derive(Debug, Clone)]
pub(super) struct Engines(pub(super) Vec<Registration>);

/// Reads the key of a registration, or one of the short names; lists them all in the help.
pub(super) fn parse_engines() -> impl TypedValueParser<Value = Engines> {
    let mut names = vec![
        PossibleValue::new("default").help("The same as distance_field"),
        PossibleValue::new("lab").help("The same as lab_icp"),
        PossibleValue::new("all").help("All of the following, one after the other"),
    ];
    names.extend(Registration::iter().map(|e| PossibleValue::new(e.key()).help(e.description())));
    PossibleValuesParser::new(names).map(|name| {
        Engines(match name.as_str() {
            "default" => vec![Registration::default()],
            "lab" => vec![Registration::LabIcp],
            "all" => Registration::iter().collect(),
            key => key.parse().into_iter().collect(),
        })
    })
}

pub(super) fn parse_start(text: &str) -> Result<PlanarPose, String> {
    let numbers: Vec<f64> =
        text.split(',').filter_map(|n| n.trim().parse().ok()).filter(|n: &f64| n.is_finite()).collect();
    let (&[degrees, y_mm, z_mm], 3) = (numbers.as_slice(), text.split(',').count()) else {
        return Err("three numbers are needed: degrees, millimeters along y, millimeters along z".to_owned());
    };
    Ok(PlanarPose { theta_rad: degrees.to_radians(), y_m: y_mm * 1e-3, z_m: z_mm * 1e-3 })
}

fn parse_trap(text: &str) -> Result<PaperTrap, String> {
    text.parse().map_err(|_| {
        let names: Vec<&'static str> = PaperTrap::iter().map(Into::into).collect();
        format!("the traps are {}", names.join(", "))
    })
}

/// The registration as the arguments want it.
fn registration(args: &PoseArgs, engine: Registration) -> Box<dyn Register> {
    if engine != Registration::LabIcp {
        return engine.method();
    }
    let mut config = LabIcpConfig { traps: args.paper_traps.clone(), ..LabIcpConfig::default() };
    if let Some(seed) = args.paper_starts {
        config.starts = lab_starts(seed);
    }
    Box::new(config)
}

#[derive(Debug, Clone, Serialize)]
struct Case {
    name: String,
    engine: &'static str,
    imprint: &'static str,
    /// What the masks are made of: the source's key, `hand` where one was drawn, `depth` where the mask model found nothing,
    /// `flat` where the imprint is flat; of both fingers (right, left) where they differ.
    mask: String,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    mask_notes: Vec<String>,
    angle_deg: Option<f64>,
    truth_deg: Option<f64>,
    error_deg: Option<f64>,
    y_m: Option<f64>,
    z_m: Option<f64>,
    /// Time of the registration, milliseconds; 0 without a pose.
    ms: f64,
    stop: String,
    /// What a person accepted for this imprint in the studio, where there are labels.
    #[serde(skip_serializing_if = "Option::is_none")]
    accepted: Option<Accepted>,
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<AlignReport>,
    /// Of a predicted imprint: what the GelSlim images (right, left) leave open about where on the tool they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    ambiguity: Option<PerPad<Ambiguity>>,
    /// With `--seeds`, for predicted imprints.
    #[serde(skip_serializing_if = "Option::is_none")]
    fan: Option<PoseFan>,
}

/// An accepted pose in the sense of the other numbers of a [`Case`].
#[derive(Debug, Clone, Copy, Serialize)]
struct Accepted {
    /// Whether a person set it, rather than took over what a registration answered.
    by_hand: bool,
    angle_deg: f64,
    error_deg: Option<f64>,
    y_m: f64,
    z_m: f64,
    /// All six numbers as they are stored.
    grasp_from_object: HandPose,
}

impl Accepted {
    fn new(accepted: AcceptedPose, truth_rad: Option<f64>) -> Self {
        let found = accepted.pose.planar.inverse();
        Self {
            by_hand: accepted.by_hand,
            angle_deg: found.theta_rad.to_degrees(),
            error_deg: truth_rad.map(|t| angle_error(found.theta_rad, t).to_degrees()),
            y_m: found.y_m,
            z_m: found.z_m,
            grasp_from_object: accepted.pose,
        }
    }
}

#[derive(Debug, Clone, Serialize)]
struct AngleMetrics {
    #[serde(flatten)]
    angles: AngleSummary,
    median_ms: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Summary {
    /// The figures of the first engine on the first kind of imprint.
    #[serde(flatten)]
    first: AngleMetrics,
    /// `engine` (first kind of imprint) and `engine/imprint` (all): the figures of each.
    engines: BTreeMap<String, AngleMetrics>,
}

#[derive(Debug, Serialize)]
struct Report {
    cases: Vec<Case>,
    summary: Summary,
    /// What is odd about the files and the numbers in them, by kind.
    notes: Vec<Finding>,
}

pub(super) fn run(args: &PoseArgs) -> VerbResult {
    let dataset = args.dataset.open_with(args.tool.tool_scale)?;
    let ids = args.limit.spread(dataset.index.pairs.len());
    let imprints: &[ImprintSource] = match args.imprint {
        Imprints::Measured => &[ImprintSource::Measured],
        Imprints::Predicted => &[ImprintSource::Predicted],
        Imprints::Both => &[ImprintSource::Measured, ImprintSource::Predicted],
    };
    let stems = match &args.fans.fan_out {
        Some(folder) => output_stems(folder, &dataset, &ids)?.into_iter().map(Some).collect(),
        None => vec![None; ids.len()],
    };
    let output = Output::new(args.common, "aligning", ids.len());
    let mut predictor = Predictor::new(&args.model, &dataset.rig);
    let mut tools: BTreeMap<String, Option<ToolModel>> = BTreeMap::new();
    let mut notes = Notes::default();
    let mut cases = Vec::new();
    let all_labels = Labels::of(&dataset);
    let mut complete = true;
    for (id, stem) in ids.into_iter().zip(stems) {
        let entry = &dataset.index.pairs[id];
        output.step(&entry.name);
        let sample = match dataset.load(PairId(id as u32)) {
            Ok(sample) => sample,
            Err(err) => {
                output.note(&format!("{}: {err}", entry.name));
                complete = false;
                continue;
            }
        };
        notes.take(&output, &sample.notes);
        let Some(tool_name) = entry.tool.clone() else {
            output.note(&format!("{}: no tool is named, so there is no CAD model to align", entry.name));
            complete = false;
            continue;
        };
        let tool = tools.entry(tool_name.clone()).or_insert_with(|| match tool_with_notes(&dataset, &tool_name) {
            Ok((tool, odd)) => {
                notes.take(&output, &odd);
                Some(tool)
            }
            Err(err) => {
                output.note(&format!("{tool_name}: {}", says(&err)));
                None
            }
        });
        let Some(tool) = tool else {
            complete = false;
            continue;
        };
        let labels = labels_of(&all_labels, &entry.name, &output);
        for &imprint in imprints {
            let asked = Asked {
                name: &entry.name,
                stem: stem.as_deref(),
                inputs: MaskInputs { sample: &sample, tool: Some(tool), labels: args.mask.drawn(&labels) },
                tool,
                accepted: labels.accepted(imprint),
            };
            let work = || pose_cases(args, &asked, imprint, &mut predictor);
            match guarded(dataset.pair_files(PairId(id as u32)), work) {
                Ok(found) => {
                    for note in found.first().iter().flat_map(|case| &case.mask_notes) {
                        output.note(&format!("note: {} ({} imprint), {note}", entry.name, imprint.key()));
                    }
                    complete &= found.iter().all(|c| c.angle_deg.is_some());
                    cases.extend(found);
                }
                Err(err) => {
                    output.note(&format!("{} ({} imprint): {}", entry.name, imprint.key(), says(&err)));
                    if err.is::<Bug>() {
                        predictor.recover();
                    }
                    complete = false;
                }
            }
        }
    }
    complete &= !cases.is_empty();
    let notes = notes.into_list(&output);
    let report = Report { summary: summary(&cases, imprints[0].key(), args.engine.0[0]), cases, notes };
    output.finish(&report, || text(&report))?;
    Ok(complete)
}

pub(super) fn tool_model(dataset: &Dataset, name: &str) -> anyhow::Result<ToolModel> {
    tool_with_notes(dataset, name).map(|(tool, _)| tool)
}

/// The tool, and what is odd about its file.
fn tool_with_notes(dataset: &Dataset, name: &str) -> anyhow::Result<(ToolModel, Vec<Problem>)> {
    let file = dataset
        .tool_with_notes(name)
        .map_err(|err| anyhow::anyhow!("{err}: {}", err.hint()))?
        .ok_or_else(|| anyhow::anyhow!("no CAD model (expected tools_stls/{name}.stl), so its grasps have no pose"))?;
    Ok((ToolModel::new(file.mesh)?, file.notes))
}

/// A pair as `pose` asks for it.
struct Asked<'a> {
    name: &'a str,
    /// Where pictures of it go.
    stem: Option<&'a Path>,
    inputs: MaskInputs<'a>,
    tool: &'a ToolModel,
    accepted: Option<AcceptedPose>,
}

/// One case per engine for one pair and one kind of imprint.
fn pose_cases(
    args: &PoseArgs,
    asked: &Asked<'_>,
    imprint: ImprintSource,
    predictor: &mut Predictor,
) -> anyhow::Result<Vec<Case>> {
    let Asked { name, stem, inputs, tool, accepted } = *asked;
    let sample = inputs.sample;
    let imprints = predictor.imprints(sample, imprint, &JobCx::unwatched())?;
    let contact = predictor.contact(&args.mask, imprints, inputs)?;
    let points = contact.points(sample);
    let truth = sample.grasp_from_object;
    let predicted = imprint == ImprintSource::Predicted;
    // What was measured is as it is; what was predicted may have had nothing to go by.
    let left_open = predicted.then(|| {
        let left_open = |f| ambiguity(&sample.pad(f)?.color()?.difference);
        sample.rig.pads().map(left_open).collect()
    });
    let several = predicted && args.ensemble.seeds > 1;
    let one = |&engine: &Registration| {
        let fan = several
            .then(|| seeds::fan(predictor, inputs, tool, engine, &args.mask, args.ensemble.seeds))
            .transpose()?;
        if let (Some(fan), Some(stem)) = (&fan, stem) {
            fan.write(stem, name, engine)?;
        }
        let starts = (!args.starts.is_empty()).then_some(args.starts.as_slice());
        let ask = Ask { starts, record: args.trace };
        let found = points.clone().and_then(|points| pose(&points, tool, &*registration(args, engine), ask, truth));
        let answer = found.as_ref().ok();
        let place = answer.map(PoseResult::object_from_grasp);
        Ok(Case {
            name: name.to_owned(),
            engine: engine.key(),
            imprint: imprint.key(),
            mask: contact.made_of(),
            mask_notes: contact.notes(&sample.rig),
            angle_deg: answer.map(|found| found.angle_rad.to_degrees()),
            truth_deg: truth.map(|truth| truth.inverse().theta_rad.to_degrees()),
            error_deg: answer.and_then(|found| Some(found.error_rad?.to_degrees())),
            y_m: place.map(|p| p.y_m),
            z_m: place.map(|p| p.z_m),
            ms: answer.map_or(0.0, |found| found.ms),
            stop: found.as_ref().map_or_else(|err| err.why.clone(), |found| found.stop.clone()),
            accepted: accepted.map(|a| Accepted::new(a, truth.map(|truth| truth.inverse().theta_rad))),
            report: found.ok().map(|found| found.report).filter(|_| args.trace),
            ambiguity: left_open.clone(),
            fan,
        })
    };
    args.engine.0.iter().map(one).collect()
}

fn figures<'a>(cases: impl Iterator<Item = &'a Case>) -> AngleMetrics {
    let cases: Vec<&Case> = cases.collect();
    // A case without truth has no error; one without a pose is a failure.
    let errors: Vec<f64> =
        cases.iter().filter(|c| c.truth_deg.is_some()).map(|c| c.error_deg.map_or(f64::NAN, f64::to_radians)).collect();
    let mut ms: Vec<f64> = cases.iter().map(|c| c.ms).collect();
    ms.sort_by(f64::total_cmp);
    let median_ms = (!ms.is_empty()).then(|| 0.5 * (ms[(ms.len() - 1) / 2] + ms[ms.len() / 2]));
    AngleMetrics { angles: AngleSummary::from_errors(&errors), median_ms }
}

fn summary(cases: &[Case], first_imprint: &str, first_engine: Registration) -> Summary {
    let of = |engine: &str, imprint: &str| figures(cases.iter().filter(|c| c.engine == engine && c.imprint == imprint));
    let mut engines = BTreeMap::new();
    for case in cases {
        let key = format!("{}/{}", case.engine, case.imprint);
        if !engines.contains_key(&key) {
            let figures = of(case.engine, case.imprint);
            if case.imprint == first_imprint {
                engines.insert(case.engine.to_owned(), figures.clone());
            }
            engines.insert(key, figures);
        }
    }
    Summary { first: of(first_engine.key(), first_imprint), engines }
}

fn text(report: &Report) -> String {
    let number = |v: Option<f64>| v.map_or("      -".to_owned(), |v| format!("{v:7.2}"));
    let mut text = format!("{:<44} {:>9} {:>9} {:>9}  mask, stop\n", "pair", "angle °", "truth °", "error °");
    for c in &report.cases {
        text += &format!(
            "{:<44} {:>9} {:>9} {:>9}  {}/{}/{}: {}\n",
            c.name,
            number(c.angle_deg),
            number(c.truth_deg),
            number(c.error_deg),
            c.engine,
            c.imprint,
            c.mask,
            c.stop
        );
    }
    text += &format!(
        "\n{:<28} {:>5} {:>9} {:>9} {:>7} {:>7} {:>10}\n",
        "engine/imprint", "n", "mean °", "median °", "<=5° %", "<=10° %", "median ms"
    );
    for (key, f) in report.summary.engines.iter().filter(|(k, _)| k.contains('/')) {
        let a = f.angles;
        text += &format!(
            "{key:<28} {:>5} {:>9} {:>9} {:>7.1} {:>7.1} {:>10}\n",
            a.count,
            number(a.mean_deg),
            number(a.median_deg),
            a.success_5,
            a.success_10,
            f.median_ms.map_or("-".to_owned(), |v| format!("{v:.3}"))
        );
    }
    text
}
