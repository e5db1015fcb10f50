//! `touch2touch masks`: contact masks as training folders, and a mask model trained on them.

mod import;
mod train;

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde::Serialize;

use super::VerbResult;
use super::args::{DatasetArgs, LimitArgs, keyed};
use super::contact_mask::MaskArgs;
use super::recipe::ModelArgs;
use touch2touch_core::dataset::PairId;
use touch2touch_core::pose::Registration;
use touch2touch_pipeline::export::{
    Automatic, DrawnMasks, ExportChoice, ExportSetup, LeftOut, Which, export_masks, plan,
};
use touch2touch_pipeline::io::exchange::{ExportReport, Format};
use touch2touch_pipeline::labels::{ImprintSource, Labels};
use touch2touch_pipeline::steps::recipe::Recipe;

/// Verbs of masks.
#[derive(Debug, Subcommand)]
pub(super) enum MasksVerb {
    /// Write masks for training, and check what was written.
    Export(ExportArgs),
    /// Read masks in one of the export formats. Hand-drawn masks stay, and no pair is marked done.
    Import(import::ImportArgs),
    /// Train a mask model on the masks of pairs marked "done", or on masks from CAD models at true poses, and score it on
    /// pairs that were left out.
    Train(train::TrainArgs),
}

/// Arguments of `masks export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The folder to write; empty, missing, or a previous export.
    #[arg(long)]
    out: PathBuf,
    /// The format: a folder for the lab's UNet loader, or only masks as pictures.
    #[arg(long, default_value = Format::default().key(), value_parser = keyed::<Format>())]
    format: Format,
    /// Pairs to write: those marked "done" with a hand-drawn mask, also those begun, or all (`--mask` makes the missing
    /// masks). Pairs marked "skip" or "flagged" are never written.
    #[arg(long, default_value = Which::default().key(), value_parser = keyed::<Which>())]
    pairs: Which,
    /// Split pairs reserved for tests (test_only) like the rest; otherwise they go to test.
    #[arg(long)]
    test_in_train: bool,
    /// Use only hand-drawn pixels; all others are marked as ignored, in `ignore/` beside the masks.
    #[arg(long)]
    manual_checked: bool,
    /// Keep each tool in one split.
    #[arg(long)]
    by_tool: bool,
    /// Show the split and write nothing.
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    mask: MaskArgs,
    #[command(flatten)]
    model: ModelArgs,
    /// Seed of the split.
    #[arg(long, default_value_t = 0)]
    split_seed: u64,
    #[command(flatten)]
    limit: LimitArgs,
}

#[derive(Serialize)]
struct Exported {
    out: PathBuf,
    format: &'static str,
    train: usize,
    val: usize,
    test: usize,
    corrected: usize,
    /// Pairs that go to test because the data set keeps them for tests.
    held_out: usize,
    /// Pairs that do not go along, by their review state.
    left_out: BTreeMap<LeftOut, usize>,
    /// Of what was written; missing in a dry run.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    written: Option<ExportReport>,
}

pub(super) fn run(verb: &MasksVerb) -> VerbResult {
    let args = match verb {
        MasksVerb::Export(args) => args,
        MasksVerb::Import(args) => return import::run(args),
        MasksVerb::Train(args) => return train::run(args),
    };
    let dataset = args.dataset.open()?;
    let ids = args.limit.spread(dataset.index.pairs.len());
    let output = args.dataset.output("exporting", ids.len());
    let setup = ExportSetup {
        pairs: Some(ids.into_iter().map(|id| PairId(id as u32)).collect()),
        choice: ExportChoice {
            which: args.pairs,
            test_in_train: args.test_in_train,
            manual_checked: args.manual_checked,
            by_tool: args.by_tool,
            seed: args.split_seed,
            format: args.format,
        },
    };
    let models = args.model.models();
    let automatic_too = args.pairs == Which::All && !args.dry_run;
    let registration = Registration::default();
    let recipe = args.model.posed(ImprintSource::Measured, &dataset.rig, &args.mask, registration);
    let recipe = if automatic_too { recipe? } else { Recipe::default() };
    let labels = Labels::of(&dataset);
    let masks = DrawnMasks { labels: &labels, changed: &BTreeMap::new() };
    let (plan, written) = if args.dry_run {
        (plan(&dataset, &masks, &setup)?, None)
    } else {
        let note = |note: &str| output.note(note);
        let automatic = automatic_too.then(|| Automatic::new(&dataset, &recipe, &models, &note));
        let (plan, report) = export_masks(&dataset, &masks, &setup, &args.out, automatic, &output.job())?;
        (plan, Some(report))
    };
    let [train, val, test] = plan.counts;
    let exported = Exported {
        out: args.out.clone(),
        format: args.format.key(),
        train,
        val,
        test,
        corrected: plan.by_hand,
        held_out: plan.held_out,
        left_out: plan.left_out.clone(),
        written,
    };
    output.finish(&exported, || {
        let end = match exported.written {
            Some(_) => format!("written to {}, read back and found the same", args.out.display()),
            None => "nothing was written (--dry-run)".to_owned(),
        };
        [plan.lines(), vec![end]].concat().join("\n")
    })?;
    Ok(true)
}
