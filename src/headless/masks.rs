//! `touch2touch masks export`: contact masks as training folders.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use serde::Serialize;

use super::args::{DatasetArgs, LimitArgs};
use super::contact_mask::MaskArgs;
use super::output::says;
use super::predict::{ModelArgs, Predictor};
use super::{Common, Output, ToolArgs, VerbResult};
use crate::domain::dataset::PairId;
use crate::domain::rig::PadId;
use crate::domain::sample::Sample;
use crate::io::export_unet::{ExportConfig, PARTS};
use crate::work::error::TaskError;
use crate::work::export::{Automatic, ExportSetup, HandMasks, export_masks};
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
    /// Which pairs: only those with a mask corrected by hand, or all (`--mask` makes the missing masks).
    #[arg(long, value_enum, default_value_t = Pairs::Corrected)]
    pairs: Pairs,
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

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Pairs {
    /// Those with a mask corrected by hand.
    Corrected,
    /// All.
    All,
}

#[derive(Serialize)]
struct Exported {
    out: PathBuf,
    train: usize,
    val: usize,
    test: usize,
    corrected: usize,
    /// Pairs left out because of their review state.
    skipped: usize,
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
        split: ExportConfig { seed: args.split_seed, rig: dataset.rig.clone(), ..ExportConfig::default() },
    };
    let mut predictor = Predictor::new(&args.model, &dataset.rig);
    let mut tools = Tools::new(&dataset);
    let mut automatic = |sample: &Sample, finger: PadId, tool: Option<&str>| {
        const WHAT: &str = "Contact mask";
        let tool = tool.and_then(|name| tools.get(name));
        let touch = sample.pad(finger).ok_or_else(|| TaskError::new(WHAT, "it has no such finger"))?;
        let bubble = touch.depth().ok_or_else(|| TaskError::new(WHAT, "it has no such imprint"))?;
        let inputs = MaskInputs { sample, tool, labels: None };
        let found = predictor.contact_mask(&args.mask, &bubble.imprint, finger, inputs);
        let found = found.map_err(|err| TaskError::new(WHAT, says(&err)))?;
        if let Some(note) = found.basis.note() {
            output.note(&format!("note: {} finger: {note}", sample.rig.pad_key(finger)));
        }
        Ok(found.mask)
    };
    let labels = Labels::of(&dataset);
    let masks = HandMasks { labels: &labels, changed: &BTreeMap::new() };
    let automatic: Option<Automatic<'_>> = (args.pairs == Pairs::All).then_some(&mut automatic);
    let done = export_masks(&dataset, &masks, &setup, &args.out, automatic, &output.job())?;
    let report = &done.report;
    let exported = Exported {
        out: args.out.clone(),
        train: report.counts[0],
        val: report.counts[1],
        test: report.counts[2],
        corrected: done.by_hand,
        skipped: done.skipped,
        out_of_range_px: report.out_of_range_px,
        unmeasured_px: report.unmeasured_px,
    };
    output.finish(&exported, || {
        let skipped = match exported.skipped {
            0 => String::new(),
            n => format!("; {n} pairs marked \"skip\" left out"),
        };
        format!(
            "{} masks in {} ({} {}, {} {}, {} {}); {} corrected by hand{skipped}; read back and accepted by the \
             loader's rules",
            report.counts.iter().sum::<usize>(),
            args.out.display(),
            report.counts[0],
            PARTS[0],
            report.counts[1],
            PARTS[1],
            report.counts[2],
            PARTS[2],
            exported.corrected
        )
    })?;
    Ok(true)
}
