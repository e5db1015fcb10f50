//! `touch2touch stats`: the statistics behind the "refit on this data set" shift, in one pass over a data set.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use serde::Serialize;

use super::VerbResult;
use super::args::{DatasetArgs, at_least_one};
use super::recipe::ModelArgs;
use touch2touch_core::dataset::PairId;
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::units::{fixed, mm};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::statistics::ShiftStatistics;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::pairs::{pads_named, spread};
use touch2touch_pipeline::scores::statistics::{PAIRS, StatisticsSetup, statistics};
use touch2touch_pipeline::steps::imprint::chain_of;

/// Arguments of `stats`.
#[derive(Debug, Args)]
pub(super) struct StatsArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The file to write; use it with `--shift refit:FILE`.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Fingers to include: right, left (or as the data set names it), both.
    #[arg(long, default_value = "both")]
    finger: String,
    /// Take only this many pairs, spread evenly over the data set.
    #[arg(long, value_name = "N", default_value_t = PAIRS, value_parser = at_least_one::<usize>)]
    limit: usize,
    #[command(flatten)]
    model: ModelArgs,
}

#[derive(Debug, Serialize)]
struct Report {
    file: String,
    failed: Vec<String>,
    /// Gain and offset (meters) of the shift these statistics make: `gain · raw + offset`.
    gain: f64,
    offset_m: f64,
    #[serde(flatten)]
    statistics: ShiftStatistics,
}

pub(super) fn run(args: &StatsArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let ids: Vec<PairId> = spread(dataset.index.pairs.len(), Some(args.limit)).map(|at| PairId(at as u32)).collect();
    let output = args.dataset.output("predicting", ids.len());
    let models = args.model.models();
    let recipe = args.model.recipe(ImprintSource::Predicted, &dataset.rig)?;
    let generating = recipe.generating()?;
    let chain = chain_of(&models.chains(generating.bundle)?, &generating.bundle.id, ShiftMode::Raw)?;
    let load = |id| dataset.load(id).map(Arc::new).map_err(|err| TaskError::from_error("Load", &err));
    let fingers = pads_named(&dataset.rig, &args.finger).map_err(anyhow::Error::msg)?;
    let setup = StatisticsSetup { pairs: ids, fingers, recipe: recipe.clone(), dataset: dataset.title.clone() };
    let (statistics, failed) = statistics(&setup, load, &models, &output.job())?;
    output.notes("", &failed);
    statistics.write(&args.out)?;
    let [gain, offset_m] = statistics.stats.affine(chain.range.max_m);
    let failed: Vec<String> = failed.iter().map(ToString::to_string).collect();
    let complete = failed.is_empty();
    let report = Report { file: args.out.display().to_string(), failed, gain, offset_m, statistics };
    output.finish(&report, || text(&report))?;
    Ok(complete)
}

fn text(report: &Report) -> String {
    let s = &report.statistics;
    let row = |name: &str, mean: f64, std: f64, [min, max]: [f64; 2], pixels: u64| {
        let [mean, std, min, max] = [mean, std, min, max].map(|v| fixed(mm(v), 3));
        format!("{name:<16} {mean:>9} {std:>9} {min:>9} {max:>9} {pixels:>12}\n")
    };
    format!("{:<16} {:>9} {:>9} {:>9} {:>9} {:>12}\n", "mm", "mean", "std", "min", "max", "pixels")
        + &row("raw prediction", s.stats.pred_mean, s.stats.pred_std, s.extremes_m[0], s.predicted_pixels)
        + &row("measured", s.stats.gt_mean, s.stats.gt_std, s.extremes_m[1], s.measured_pixels)
        + &format!(
            "\n{:.3} · raw {} {} mm (the exact inverse has 2); {} touches of {}, {} steps, seed {}, {}\nwritten to {}\n",
            report.gain,
            if report.offset_m < 0.0 { "-" } else { "+" },
            fixed(mm(report.offset_m.abs()), 2),
            s.touches,
            s.provenance.dataset,
            s.provenance.steps,
            s.provenance.seed,
            s.provenance.bundle,
            report.file
        )
}
