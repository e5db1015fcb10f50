//! `touch2touch export`: a pair in files for other programs.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::VerbResult;
use super::args::{DatasetArgs, keyed};
use super::contact_mask::labels_of;
use super::notes::Notes;
use super::recipe::RecipeArgs;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::pair_files::{PairParts, write};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{ImprintSource, Labels};
use touch2touch_pipeline::steps::estimate::{Estimate, Touch};
use touch2touch_pipeline::steps::prediction::predicted_by;
use touch2touch_pipeline::steps::recipe::Stage;
use touch2touch_pipeline::steps::tool::load_tool;

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The pair, by its name or a unique part of it.
    #[arg(long)]
    pair: String,
    /// Imprint to export.
    #[arg(long, value_parser = keyed::<ImprintSource>(), default_value = "measured")]
    imprint: ImprintSource,
    /// The folder; created if missing.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    recipe: RecipeArgs,
}

pub(super) fn run(args: &ExportArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let id = super::find_pair(&dataset, &args.pair)?;
    let entry = &dataset.index.pairs[id.0 as usize];
    let output = args.dataset.output("exporting", 1);
    let mut notes = Notes::of(&dataset);
    let sample = dataset.load(id)?;
    notes.take(&output, &sample.notes);
    let tool = match entry.tool.as_deref() {
        Some(name) => load_tool(&dataset, name).map(|loaded| {
            notes.take(&output, &loaded.notes);
            loaded.model
        }),
        None => Err(TaskError::new("Export", "there is no CAD model")),
    };
    let models = args.recipe.model.models();
    let recipe = args.recipe.of(args.imprint, &dataset.rig)?;
    let labels = labels_of(&Labels::of(&dataset), &entry.name, &output);
    let touch = Touch { dataset: &dataset, pair: id, sample: &sample, tool: tool.as_ref(), labels: &labels };
    let estimate = Estimate::new(&recipe).with_surface().reach(touch, Stage::Pose, &models, &JobCx::unwatched())?;
    let contact = estimate.contact();
    let truth = sample.grasp_from_object;
    let pose = estimate.pose().map_err(|err| output.note(&err.to_string())).ok();
    let mask = contact.made_of();
    let prediction = recipe.generator.as_ref().map(|(bundle, config)| predicted_by(&bundle.name, config, recipe.shift));
    let parts = PairParts {
        name: &entry.name,
        source: args.imprint,
        prediction: prediction.as_deref(),
        rig: &sample.rig,
        clouds: estimate.surface(),
        mask: &mask,
        registration: recipe.registration,
        pose,
        truth,
        tool: entry.tool.as_deref().zip(tool.as_ref().ok()),
    };
    let files = write(&parts, &args.out)?;
    let report = json!({
        "pair": entry.name, "imprint": args.imprint, "engine": recipe.registration.to_string(), "mask": mask, "files": files,
        "notes": notes.into_list(&output),
    });
    output.finish(&report, || {
        let lines: Vec<String> = files.iter().map(|file| format!("wrote {}", file.display())).collect();
        lines.join("\n")
    })?;
    Ok(pose.is_some())
}
