//! `touch2touch masks export`: contact masks as training folders.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use serde::Serialize;

use super::contact_mask::{MaskArgs, MaskFrom, contact_mask};
use super::predict::{ModelArgs, Predictor};
use super::{Common, Output, ToolArgs, VerbResult};
use crate::domain::dataset::PairId;
use crate::domain::pose::ToolModel;
use crate::io::export_unet::{self, ExportConfig, ExportEntry, PARTS};
use crate::io::masks::MaskStore;

/// What can be done with masks.
#[derive(Debug, Subcommand)]
pub(super) enum MasksVerb {
    /// Write images and masks for training a mask UNet, and check what was written by the loader's rules.
    Export(ExportArgs),
}

/// Arguments of `masks export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// The dataset: a folder in the lab's layout or of image pairs, or `demo`.
    #[arg(long)]
    input: PathBuf,
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
    /// Take only this many pairs, spread evenly over the dataset.
    #[arg(long)]
    limit: Option<usize>,
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
    out_of_range_px: usize,
    unmeasured_px: usize,
}

pub(super) fn run(verb: &MasksVerb) -> VerbResult {
    let MasksVerb::Export(args) = verb;
    let Format::Unet = args.format;
    let mut dataset = super::open(&args.input)?;
    dataset.tool_scale = args.tool.tool_scale;
    let store = MaskStore::for_dataset(&dataset)?;
    let stored = store.masks();
    let mut entries = Vec::new();
    let mut ids = Vec::new();
    for id in super::spread(dataset.index.pairs.len(), args.limit) {
        let entry = &dataset.index.pairs[id];
        for finger in dataset.rig.pads() {
            let corrected = stored.iter().any(|(pair, f)| *pair == entry.name && *f == finger);
            if corrected || args.pairs == Pairs::All {
                entries.push(ExportEntry { pair: entry.name.clone(), tool: entry.tool.clone(), finger });
                ids.push((PairId(id as u32), corrected));
            }
        }
    }
    if entries.is_empty() {
        anyhow::bail!(
            "no mask was corrected by hand yet (they would lie in {}); --pairs all exports automatic masks",
            store.folder().display()
        );
    }
    let output = Output::new(args.common, "exporting", entries.len());
    let mut predictor = Predictor::new(&args.model, &dataset.rig);
    let mut tools: BTreeMap<String, Option<ToolModel>> = BTreeMap::new();
    let config = ExportConfig { seed: args.split_seed, rig: dataset.rig.clone(), ..ExportConfig::default() };
    let report = export_unet::export(&args.out, &entries, &config, |i| {
        let (entry, (id, corrected)) = (&entries[i], ids[i]);
        output.step(&entry.pair);
        let sample = dataset.load(id)?;
        let touch = sample.pad(entry.finger).ok_or("it has no such finger")?;
        let bubble = touch.depth().ok_or("it has no such imprint")?;
        if corrected && let Some(stored) = store.load(&entry.pair, entry.finger)? {
            return Ok((bubble.imprint.clone(), stored.mask));
        }
        let tool = entry.tool.as_ref().and_then(|name| {
            let model = tools.entry(name.clone()).or_insert_with(|| super::pose::tool_model(&dataset, name).ok());
            model.as_ref()
        });
        let source = match args.mask.mask {
            MaskFrom::Auto if sample.grasp_from_object.is_some() && tool.is_some() => MaskFrom::Cad,
            other => other,
        };
        let truth = sample.grasp_from_object;
        let mask = contact_mask(source, &args.mask, &bubble.imprint, touch, tool, truth, &mut predictor)?;
        Ok((bubble.imprint.clone(), mask))
    })?;
    let exported = Exported {
        out: args.out.clone(),
        train: report.counts[0],
        val: report.counts[1],
        test: report.counts[2],
        corrected: ids.iter().filter(|(_, corrected)| *corrected).count(),
        out_of_range_px: report.out_of_range_px,
        unmeasured_px: report.unmeasured_px,
    };
    output.finish(&exported, || {
        format!(
            "{} masks in {} ({} {}, {} {}, {} {}); {} corrected by hand; read back and accepted by the loader's rules",
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
