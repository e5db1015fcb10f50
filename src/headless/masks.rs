//! `touch2touch masks export`: contact masks as training folders.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use serde::Serialize;

use super::args::{DatasetArgs, LimitArgs, keyed};
use super::contact_mask::MaskArgs;
use super::output::says;
use super::predict::{ModelArgs, Predictor};
use super::{Common, Output, ToolArgs, VerbResult};
use crate::domain::dataset::PairId;
use crate::domain::rig::PadId;
use crate::domain::sample::Sample;
use crate::io::export_unet::ExportReport;
use crate::work::error::TaskError;
use crate::work::export::{Automatic, ExportChoice, ExportSetup, HandMasks, LeftOut, Which, export_masks, plan};
use crate::work::labels::Labels;
use crate::work::mask::MaskInputs;
use crate::work::tool::Tools;

/// What can be done with masks.
#[derive(Debug, Subcommand)]
pub(super) enum MasksVerb {
    /// Write images and masks for training a mask UNet, and check what was written by the loader's rules.
    Export(ExportArgs),
}

/// Arguments of `masks export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The folder to write; empty, missing, or a previous export.
    #[arg(long)]
    out: PathBuf,
    /// The form.
    #[arg(long, value_enum, default_value_t = Format::Unet)]
    format: Format,
    /// Which pairs: those marked "done" with a mask drawn by hand, those begun too, or all (`--mask` makes the missing
    /// masks). Pairs marked "skip" or "flagged" never go along.
    #[arg(long, default_value = Which::default().key(), value_parser = keyed::<Which>())]
    pairs: Which,
    /// Divides pairs that the data set keeps for tests (test_only) like the rest; else they go to test.
    #[arg(long)]
    test_in_train: bool,
    /// Sends all pairs of a tool to the same part.
    #[arg(long)]
    by_tool: bool,
    /// Says what would go where, and writes nothing.
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    mask: MaskArgs,
    #[command(flatten)]
    tool: ToolArgs,
    #[command(flatten)]
    model: ModelArgs,
    /// Decides which pair lands in which part.
    #[arg(long, default_value_t = 0)]
    split_seed: u64,
    #[command(flatten)]
    limit: LimitArgs,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// `{train,val,test}/{imgs,masks}/<stem>.png`, as the lab's UNet loader reads it.
    Unet,
}

#[derive(Serialize)]
struct Exported {
    out: PathBuf,
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
    written: Option<Written>,
}

#[derive(Serialize)]
struct Written {
    out_of_range_px: usize,
    unmeasured_px: usize,
}

pub(super) fn run(verb: &MasksVerb) -> VerbResult {
    let MasksVerb::Export(args) = verb;
    let Format::Unet = args.format;
    let dataset = args.dataset.open_with(args.tool.tool_scale)?;
    let ids = args.limit.spread(dataset.index.pairs.len());
    let output = Output::new(args.common, "exporting", ids.len());
    let setup = ExportSetup {
        pairs: Some(ids.into_iter().map(|id| PairId(id as u32)).collect()),
        choice: ExportChoice {
            which: args.pairs,
            test_in_train: args.test_in_train,
            by_tool: args.by_tool,
            seed: args.split_seed,
        },
    };
    let mut predictor = Predictor::new(&args.model, &dataset.rig);
    let mut tools = Tools::new(&dataset);
    let mut automatic = |sample: &Sample, finger: PadId, tool: Option<&str>| {
        const WHAT: &str = "Contact mask";
        let tool = tool.and_then(|name| tools.get(name));
        let touch = sample.pad(finger).ok_or_else(|| TaskError::new(WHAT, "it has no such finger"))?;
        let bubble = touch.depth().ok_or_else(|| TaskError::new(WHAT, "it has no such imprint"))?;
        let inputs = MaskInputs::measured(sample, tool, None);
        let found = predictor.contact_mask(&args.mask, &bubble.imprint, finger, inputs);
        let found = found.map_err(|err| TaskError::new(WHAT, says(&err)))?;
        if let Some(note) = found.basis.note() {
            output.note(&format!("note: {} finger: {note}", sample.rig.pad_key(finger)));
        }
        Ok(found.mask)
    };
    let labels = Labels::of(&dataset);
    let masks = HandMasks { labels: &labels, changed: &BTreeMap::new() };
    let (plan, written) = if args.dry_run {
        (plan(&dataset, &masks, &setup)?, None)
    } else {
        let automatic: Option<Automatic<'_>> = (args.pairs == Which::All).then_some(&mut automatic);
        let (plan, report) = export_masks(&dataset, &masks, &setup, &args.out, automatic, &output.job())?;
        let ExportReport { out_of_range_px, unmeasured_px, .. } = report;
        (plan, Some(Written { out_of_range_px, unmeasured_px }))
    };
    let [train, val, test] = plan.counts;
    let exported = Exported {
        out: args.out.clone(),
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
            Some(_) => format!("written to {}, read back and accepted by the loader's rules", args.out.display()),
            None => "nothing was written (--dry-run)".to_owned(),
        };
        [plan.lines(), vec![end]].concat().join("\n")
    })?;
    Ok(true)
}
