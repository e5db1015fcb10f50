//! `touch2touch stats`: the statistics behind the "refit on this dataset" shift, in one pass over a dataset.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use serde::Serialize;

use super::generate::FingerArg;
use super::predict::{ModelArgs, Predictor};
use super::{Common, Output, VerbResult};
use crate::app::error::TaskError;
use crate::app::jobs::{Cancel, JobCx, statistics};
use crate::domain::dataset::PairId;
use crate::domain::postprocess::ShiftMode;
use crate::domain::sample::Scale;
use crate::domain::units::{fixed, mm};
use crate::io::masks::now_unix_s;
use crate::io::statistics::{Provenance, ShiftStatistics, utc_text};

/// Arguments of `stats`.
#[derive(Debug, Args)]
pub(super) struct StatsArgs {
    /// The dataset: a folder in the lab's layout or of image pairs, or `demo`.
    #[arg(long)]
    input: PathBuf,
    /// The file to write; use it with `--shift refit --stats FILE`.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Which finger's touches: right, left (or as the data set names it), both.
    #[arg(long, default_value = "both")]
    finger: FingerArg,
    /// Take only this many pairs, spread evenly over the dataset.
    #[arg(long)]
    limit: Option<usize>,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Serialize)]
struct Report {
    file: String,
    failed: Vec<String>,
    /// Gain and offset (metres) of the shift these statistics make: `gain · raw + offset`.
    gain: f64,
    offset_m: f64,
    #[serde(flatten)]
    statistics: ShiftStatistics,
}

pub(super) fn run(args: &StatsArgs) -> VerbResult {
    let dataset = super::open(&args.input)?;
    let ids: Vec<PairId> =
        super::spread(dataset.index.pairs.len(), args.limit).into_iter().map(|i| PairId(i as u32)).collect();
    let output = Arc::new(Output::new(args.common, "predicting", ids.len()));
    let mut predictor = Predictor::new(&args.model, &dataset.rig);
    let config = predictor.config()?;
    let chain = predictor.generator()?.spec().depth_chain(ShiftMode::Raw)?;
    let engine = predictor.generator()?.engine().label();
    let input = predictor.input().ok_or_else(|| anyhow::anyhow!("the bundle is not a generator"))?;
    let scale = std::cell::Cell::new(Scale::Measured);
    let bar = output.clone();
    let cx = JobCx::new(Cancel::default(), Arc::new(move |p| bar.set(p.done as usize, p.total as usize)));
    let pass = statistics::pass(
        &ids,
        &args.finger.fingers(&dataset.rig)?,
        input,
        |id| {
            let sample = dataset.load(id).map_err(|err| TaskError::from_error("Load", &err))?;
            scale.set(sample.scale);
            Ok(Arc::new(sample))
        },
        |id, finger, difference| {
            let name = &dataset.index.pairs[id.0 as usize].name;
            let what = format!("{name} {}", dataset.rig.pad_key(finger));
            let raw = predictor.predict_one(difference).map_err(|err| TaskError::new(&what, err))?;
            Ok((raw, chain.clone()))
        },
        &cx,
    )
    .map_err(|err| anyhow::anyhow!("{err}"))?;
    drop(cx);
    for failure in &pass.failed {
        output.note(&failure.to_string());
    }
    let provenance = Provenance {
        bundle: predictor.bundle_name().to_owned(),
        bundle_hash: predictor.bundle_hash().to_owned(),
        dataset: dataset.title.clone(),
        seed: config.seed,
        steps: config.steps,
        sampler: config.sampler.key().into(),
        eta: config.eta,
        engine: engine.into(),
        scale: super::scale_name(scale.get()).into(),
        made: utc_text(now_unix_s()),
    };
    let statistics = ShiftStatistics::new(provenance, &pass.fit).expect("a pass without a pixel is an error");
    statistics.write(&args.out)?;
    let [gain, offset_m] = statistics.stats.affine(chain.range.max_m);
    let failed: Vec<String> = pass.failed.iter().map(ToString::to_string).collect();
    let complete = failed.is_empty();
    let report = Report { file: args.out.display().to_string(), failed, gain, offset_m, statistics };
    let output = Arc::into_inner(output).expect("the job that shared it is over");
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
