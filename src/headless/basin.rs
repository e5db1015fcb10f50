//! `touch2touch basin`: where starts lead, of one pair; the numbers behind the studio's basin map.

use std::path::PathBuf;
use std::time::Instant;

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::{Args, ValueEnum};
use serde::Serialize;
use strum::IntoEnumIterator as _;

use super::args::DatasetArgs;
use super::contact_mask::{FingerMasks, MaskArgs};
use super::notes::Notes;
use super::predict::{ModelArgs, Predictor};
use super::{Common, Output, VerbResult, pose};
use crate::domain::align::Run;
use crate::domain::align::basin::{Basin, BasinConfig, Plane};
use crate::domain::findings::Finding;
use crate::domain::frames::PlanarPose;
use crate::domain::inspect::basin_map;
use crate::domain::pose::{Engine, FingerInput, Fingers, contact_cloud, register};
use crate::domain::units::{angle_error, fixed, mm, wrap_angle};
use crate::work::job::JobCx;

/// Arguments of `basin`.
#[derive(Debug, Args)]
pub(super) struct BasinArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The pair, by its name or a part of it that no other has.
    #[arg(long)]
    pair: String,
    /// Which imprint to align.
    #[arg(long, value_enum, default_value_t = Imprint::Measured)]
    imprint: Imprint,
    /// What of the start is varied: columns and rows of the grid.
    #[arg(long, value_enum, default_value_t = PlaneArg::AngleY)]
    plane: PlaneArg,
    #[command(flatten)]
    mask: MaskArgs,
    /// The registration.
    #[arg(long, default_value = Engine::default().key(), value_parser = parse_engine())]
    engine: Engine,
    /// Write grid, costs and ends to this file as one JSON object.
    #[arg(long, value_name = "OUT")]
    json: Option<PathBuf>,
    #[command(flatten)]
    model: ModelArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Imprint {
    Measured,
    Predicted,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PlaneArg {
    /// Angle along the columns, y along the rows.
    AngleY,
    /// Angle along the columns, z along the rows.
    AngleZ,
    /// y along the columns, z along the rows.
    YZ,
}

impl From<PlaneArg> for Plane {
    fn from(plane: PlaneArg) -> Self {
        match plane {
            PlaneArg::AngleY => Self::AngleY,
            PlaneArg::AngleZ => Self::AngleZ,
            PlaneArg::YZ => Self::YZ,
        }
    }
}

fn parse_engine() -> impl clap::builder::TypedValueParser<Value = Engine> {
    PossibleValuesParser::new(Engine::iter().map(Engine::key)).map(|key| key.parse().unwrap_or_default())
}

#[derive(Debug, Serialize)]
struct Report {
    pair: String,
    engine: &'static str,
    imprint: &'static str,
    mask: String,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    mask_notes: Vec<String>,
    /// What is odd about the files.
    notes: Vec<Finding>,
    /// The true pose, `grasp_from_object`, where known.
    truth: Option<PlanarPose>,
    /// The registration's own starts and where they lead.
    own_starts: Vec<Run>,
    /// Time of the whole map, milliseconds.
    ms: f64,
    #[serde(flatten)]
    basin: Basin,
}

pub(super) fn run(args: &BasinArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let id = super::find_pair(&dataset, &args.pair)?;
    let entry = &dataset.index.pairs[id.0 as usize];
    let output = Output::new(Common { json: false }, "trying starts", 1);
    let sample = dataset.load(id)?;
    let name = entry.tool.as_deref();
    let name = name.ok_or_else(|| anyhow::anyhow!("{}: no tool is named, so there is no CAD model", entry.name))?;
    let tool = pose::tool_model(&dataset, name)?;
    let mut predictor = Predictor::new(&args.model, &dataset.rig);
    let predicted = args.imprint == Imprint::Predicted;
    let imprints = if predicted { predictor.imprints(&sample, &JobCx::unwatched())? } else { pose::measured(&sample) };
    let mut notes = Notes::default();
    notes.take(&output, &sample.notes);
    let FingerMasks { masks, made_of, notes: mask_notes } =
        pose::masks(&args.mask, &sample, &tool, &imprints, predicted, &mut predictor)?;
    let fingers = Fingers::new(&sample.rig, |f| {
        let camera = sample.pad(f)?.camera()?;
        Some(FingerInput { imprint: imprints[f].as_ref()?, camera, mask: masks[f].as_ref() })
    });
    let cloud = contact_cloud(&fingers)?;
    // What keeps every start from an answer keeps the registration itself from one, and is said once.
    let own = register(&cloud.points, &tool, args.engine, false)?;
    let started = Instant::now();
    let config = BasinConfig::new(args.plane.into());
    let basin = basin_map(&cloud.points, &tool, args.engine, &config, || false)
        .ok_or_else(|| anyhow::anyhow!("the map was not finished"))?;
    let report = Report {
        pair: entry.name.clone(),
        engine: args.engine.key(),
        imprint: if predicted { "predicted" } else { "measured" },
        mask: made_of,
        mask_notes,
        notes: notes.into_list(&output),
        truth: sample.grasp_from_object,
        own_starts: own.runs,
        ms: started.elapsed().as_secs_f64() * 1e3,
        basin,
    };
    if let Some(file) = &args.json {
        let bytes = serde_json::to_vec(&report)?;
        crate::io::atomic::write_bytes(file, &bytes).map_err(|err| anyhow::anyhow!("{}: {err}", file.display()))?;
    }
    output.finish(&report, || text(&report))?;
    Ok(true)
}

fn text(report: &Report) -> String {
    let basin = &report.basin;
    let [columns, rows] = basin.config.size;
    let mut text = format!(
        "{}: {columns} x {rows} starts, {} of {} contact points, {} ms\n{:>8} {:>9} {:>8} {:>8} {:>9} {:>9}\n",
        report.pair,
        basin.points,
        basin.offered,
        fixed(report.ms, 0),
        "starts %",
        "angle °",
        "y mm",
        "z mm",
        "√cost mm",
        "error °"
    );
    /// Ends that few starts lead to are many in a valley.
    const MOST: usize = 12;
    for end in basin.basins.iter().take(MOST) {
        let error =
            report.truth.map_or("-".to_owned(), |t| fixed(angle_error(end.end.theta_rad, t.theta_rad).to_degrees(), 1));
        text += &format!(
            "{:>8} {:>9} {:>8} {:>8} {:>9} {:>9}\n",
            fixed(100.0 * end.starts as f64 / basin.cells.len() as f64, 1),
            fixed(wrap_angle(-end.end.theta_rad).to_degrees(), 1),
            fixed(mm(end.end.y_m), 2),
            fixed(mm(end.end.z_m), 2),
            fixed(mm(end.cost_m2.max(0.0).sqrt()), 3),
            error
        );
    }
    if basin.basins.len() > MOST {
        text += &format!("and {} further ends\n", basin.basins.len() - MOST);
    }
    text
}
