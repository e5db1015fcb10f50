//! `touch2touch case`: one pair with everything that its results depend on, in one file.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use serde::Serialize;

use super::args::{DatasetArgs, RegistrationParser};
use super::contact_mask::{MaskArgs, labels_of};
use super::recipe::ModelArgs;
use super::{Common, Output, VerbResult};
use touch2touch_core::pose::RegistrationChoice;
use touch2touch_work::case::{CaseSetup, check, make, open};
use touch2touch_work::labels::{ImprintSource, Labels};
use touch2touch_work::models::Models;
use touch2touch_work::recipe::Recipe;

/// Verbs of a case.
#[derive(Debug, Subcommand)]
pub(super) enum CaseVerb {
    /// Put a pair into one file: its data, labels, settings, and the results to be had from them.
    Make(Box<MakeArgs>),
    /// Make the results of a case again and say what differs; nothing may.
    Check(CheckArgs),
}

/// Arguments of `case make`.
#[derive(Debug, Args)]
pub(super) struct MakeArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The pair, by its name or a part of it that no other has.
    #[arg(long)]
    pair: String,
    /// The file to write, such as `grasp.t2tcase`.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Leave predictions out: no generator is needed to check the case then.
    #[arg(long)]
    measured_only: bool,
    /// The registration.
    #[arg(long = "engine", value_name = "ENGINE", default_value_t = RegistrationChoice::default(), value_parser = RegistrationParser)]
    registration: RegistrationChoice,
    #[command(flatten)]
    mask: MaskArgs,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    common: Common,
}

/// Arguments of `case check`.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// The case.
    file: PathBuf,
    #[command(flatten)]
    common: Common,
}

#[derive(Serialize)]
struct Made<'a> {
    file: &'a Path,
    pair: &'a str,
    /// By imprint: the angle that the lab reports, degrees.
    angles_deg: Vec<(&'static str, Option<f64>)>,
}

pub(super) fn run(verb: &CaseVerb) -> VerbResult {
    match verb {
        CaseVerb::Make(args) => run_make(args),
        CaseVerb::Check(args) => run_check(args),
    }
}

fn run_make(args: &MakeArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let pair = super::find_pair(&dataset, &args.pair)?;
    let output = Output::new(args.common, "making", 1);
    let models = args.model.models();
    let imprint = if args.measured_only { ImprintSource::Measured } else { ImprintSource::Predicted };
    let recipe = args.model.posed(imprint, &dataset.rig, &args.mask, args.registration)?.of(ImprintSource::Measured);
    // A shift is of predictions.
    let shift = if args.measured_only { Default::default() } else { recipe.shift };
    let labels = match args.mask.no_hand {
        true => Default::default(),
        false => labels_of(&Labels::of(&dataset), &dataset.index.pairs[pair.0 as usize].name, &output),
    };
    let setup = CaseSetup { pair, recipe: Recipe { shift, hand: true, ..recipe }, labels, view: None };
    let case = make(&dataset, &setup, &models, &args.out, &output.job())?;
    let angle = |pose: touch2touch_core::frames::PlanarPose| pose.inverse().theta_rad.to_degrees();
    let angles_deg = case.results.iter().map(|r| (r.imprint.key(), r.pose.map(angle))).collect();
    let made = Made { file: &args.out, pair: &case.pair, angles_deg };
    output.finish(&made, || format!("wrote {} ({})", args.out.display(), case.pair))?;
    Ok(true)
}

fn run_check(args: &CheckArgs) -> VerbResult {
    let folder = tempfile::tempdir()?;
    let output = Output::new(args.common, "checking", 1);
    let opened = open(&args.file, folder.path())?;
    // Nothing that was kept from before: what is checked is made now.
    let report = check(&opened, &opened.bundles(), &Models::new(None), &output.job())?;
    let same = report.same;
    output.finish(&report, || match same {
        true => format!("{}: all {} results are the same, bit for bit", report.pair, report.compared),
        false => {
            format!("{}: {} things differ\n{}", report.pair, report.differences.len(), report.differences.join("\n"))
        }
    })?;
    Ok(same)
}
