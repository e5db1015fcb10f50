//! `touch2touch basin`: where starts lead, of one pair; the numbers behind the studio's basin map.

use std::time::Instant;

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::args::{DatasetArgs, JsonArgs, RegistrationParser, keyed};
use super::contact_mask::{MaskArgs, labels_of};
use super::notes::Notes;
use super::recipe::ModelArgs;
use super::{Output, VerbResult};
use touch2touch_core::align::Run;
use touch2touch_core::align::basin::{Basin, Plane};
use touch2touch_core::findings::Finding;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::pose::RegistrationChoice;
use touch2touch_core::units::{angle_error, fixed, mm, wrap_angle};
use touch2touch_work::feel::{Touch, feel};
use touch2touch_work::job::JobCx;
use touch2touch_work::labels::{ImprintSource, Labels};
use touch2touch_work::pose::basin;
use touch2touch_work::recipe::Stage;
use touch2touch_work::tool::{LoadedTool, load_tool};

/// Arguments of `basin`.
#[derive(Debug, Args)]
pub(super) struct BasinArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The pair, by its name or a part of it that no other has.
    #[arg(long)]
    pair: String,
    /// Imprint to align.
    #[arg(long, default_value = ImprintSource::Measured.key(), value_parser = keyed::<ImprintSource>())]
    imprint: ImprintSource,
    /// Coordinates of the start that are varied: columns and rows of the grid.
    #[arg(long, value_enum, default_value_t = PlaneArg::AngleY)]
    plane: PlaneArg,
    #[command(flatten)]
    mask: MaskArgs,
    /// The registration.
    #[arg(long = "engine", value_name = "ENGINE", default_value_t = RegistrationChoice::default(), value_parser = RegistrationParser)]
    registration: RegistrationChoice,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    model: ModelArgs,
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

#[derive(Debug, Serialize)]
struct Report {
    pair: String,
    #[serde(rename = "engine")]
    registration: String,
    imprint: &'static str,
    mask: String,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    mask_notes: Vec<String>,
    /// Oddities of the files.
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
    let output = Output::new(args.json.common(), "trying starts", 1);
    let sample = dataset.load(id)?;
    let name = entry.tool.as_deref();
    let name = name.ok_or_else(|| anyhow::anyhow!("{}: no tool is named, so there is no CAD model", entry.name))?;
    let LoadedTool { model: tool, notes: odd } = load_tool(&dataset, name)?;
    let models = args.model.models();
    let recipe = args.model.posed(args.imprint, &dataset.rig, &args.mask, args.registration)?;
    let mut notes = Notes::of(&dataset);
    notes.take(&output, &sample.notes);
    notes.take(&output, &odd);
    let labels = labels_of(&Labels::of(&dataset), &entry.name, &output);
    let touch = Touch { dataset: &dataset, pair: id, sample: &sample, tool: Ok(&tool), labels: &labels };
    let felt = feel(touch, &recipe, Stage::Pose, &models, &JobCx::unwatched())?;
    let contact = felt.contact();
    // What keeps every start from an answer keeps the registration itself from one, and is said once.
    let own = felt.pose().map_err(Clone::clone)?;
    let started = Instant::now();
    let (registration, plane) = (args.registration, args.plane.into());
    let basin = felt.with_contacts(touch, |contacts| basin(contacts, &tool, registration, plane, &output.job()))??;
    let report = Report {
        pair: entry.name.clone(),
        registration: args.registration.to_string(),
        imprint: args.imprint.key(),
        mask: contact.made_of(),
        mask_notes: contact.notes(&sample.rig),
        notes: notes.into_list(&output),
        truth: sample.grasp_from_object,
        own_starts: own.report.runs.clone(),
        ms: started.elapsed().as_secs_f64() * 1e3,
        basin,
    };
    args.json.write(&report)?;
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
