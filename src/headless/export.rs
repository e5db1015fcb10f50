//! `touch2touch export`: a pair in files for other programs.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use strum::IntoEnumIterator as _;

use super::args::{DatasetArgs, RegistrationParser, keyed};
use super::contact_mask::{MaskArgs, labels_of};
use super::notes::Notes;
use super::recipe::ModelArgs;
use super::{Common, Output, ToolArgs, VerbResult};
use touch2touch_core::findings::Finding;
use touch2touch_core::pose::Registration;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::pair_files::{PairFile, PairParts, write};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{ImprintSource, Labels};
use touch2touch_pipeline::steps::estimate::{Touch, estimate};
use touch2touch_pipeline::steps::prediction::predicted_by;
use touch2touch_pipeline::steps::recipe::Stage;
use touch2touch_pipeline::steps::tool::load_tool;

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The pair, by its name or a part of it that no other has.
    #[arg(long)]
    pair: String,
    /// Imprint to export.
    #[arg(long, value_parser = keyed::<ImprintSource>(), default_value = "measured")]
    imprint: ImprintSource,
    /// The files, with commas between them: `cloud` (PLY; contact, finger and distance to the model for each point),
    /// `pose` (JSON with 4 x 4 matrices), `mesh` (the CAD model at that pose, STL). Meters, grasp frame.
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = parse_file(), default_value = "cloud,pose,mesh")]
    what: Vec<PairFile>,
    /// The folder, which is made if it is not there.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The registration.
    #[arg(long = "engine", value_name = "ENGINE", default_value_t = Registration::default(), value_parser = RegistrationParser)]
    registration: Registration,
    #[command(flatten)]
    mask: MaskArgs,
    #[command(flatten)]
    tool: ToolArgs,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    common: Common,
}

fn parse_file() -> impl TypedValueParser<Value = PairFile> {
    // The parser has compared the key with the list.
    PossibleValuesParser::new(PairFile::iter().map(PairFile::key)).map(|key| key.parse().unwrap_or(PairFile::Cloud))
}

#[derive(Serialize)]
struct Report {
    pair: String,
    imprint: &'static str,
    #[serde(rename = "engine")]
    registration: String,
    mask: String,
    files: Vec<PathBuf>,
    /// Oddities of the files of the pair.
    notes: Vec<Finding>,
}

pub(super) fn run(args: &ExportArgs) -> VerbResult {
    let dataset = args.dataset.open_with(args.tool.tool_scale)?;
    let id = super::find_pair(&dataset, &args.pair)?;
    let entry = &dataset.index.pairs[id.0 as usize];
    let output = Output::new(args.common, "exporting", 1);
    let mut notes = Notes::of(&dataset);
    let sample = dataset.load(id)?;
    notes.take(&output, &sample.notes);
    let tool = entry.tool.as_deref().map(|name| load_tool(&dataset, name)).transpose();
    let tool = match tool {
        Ok(found) => found.map(|loaded| {
            notes.take(&output, &loaded.notes);
            loaded.model
        }),
        // The cloud needs none.
        Err(err) if args.what == [PairFile::Cloud] => {
            output.note(&err.to_string());
            None
        }
        Err(err) => return Err(err.into()),
    };
    let models = args.model.models();
    let recipe = args.model.posed(args.imprint, &dataset.rig, &args.mask, args.registration)?;
    let labels = labels_of(&Labels::of(&dataset), &entry.name, &output);
    let lacks = TaskError::new("Export", "there is no CAD model");
    let touch =
        Touch { dataset: &dataset, pair: id, sample: &sample, tool: tool.as_ref().ok_or(&lacks), labels: &labels };
    let estimate = estimate(touch, &recipe, Stage::Pose, &models, &JobCx::unwatched())?;
    let contact = estimate.contact();
    let (clouds, truth) = (contact.clouds(&sample)?, sample.grasp_from_object);
    let found = match estimate.pose() {
        _ if tool.is_none() => None,
        Err(err) if args.what == [PairFile::Cloud] => {
            output.note(&err.to_string());
            None
        }
        found => Some(found.map_err(Clone::clone)?),
    };
    let mask = contact.made_of();
    let prediction = recipe.generator.as_ref().map(|(bundle, config)| predicted_by(&bundle.name, config, recipe.shift));
    let parts = PairParts {
        name: &entry.name,
        source: args.imprint,
        prediction: prediction.as_deref(),
        rig: &sample.rig,
        clouds: &clouds,
        mask: &mask,
        registration: args.registration,
        pose: found,
        truth,
        tool: entry.tool.as_deref().zip(tool.as_ref()),
    };
    let files = write(&parts, &args.what, &args.out)?;
    let report = Report {
        pair: entry.name.clone(),
        imprint: args.imprint.key(),
        registration: args.registration.to_string(),
        mask,
        files,
        notes: notes.into_list(&output),
    };
    output.finish(&report, || {
        let lines: Vec<String> = report.files.iter().map(|file| format!("wrote {}", file.display())).collect();
        lines.join("\n")
    })?;
    Ok(true)
}
