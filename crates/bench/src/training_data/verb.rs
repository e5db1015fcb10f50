//! `touch2touch-bench training-data`: a data set or the simulator as shards for the trainer.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use super::{ShardSetup, TouchSource, WrittenShards, write_shards};
use touch2touch::headless::{DatasetArgs, LimitArgs, VerbResult, at_least_one, condition, keyed};
use touch2touch_bench::training_mix::Mix;
use touch2touch_core::dataset::PairId;
use touch2touch_core::sim::Condition;
use touch2touch_pipeline::labels::Labels;

/// The PATH that means the simulator.
const SIMULATOR: &str = "simulator";

/// Arguments of `training-data`.
#[derive(Debug, Args)]
pub(crate) struct TrainingDataArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The folder of the shards. It may hold shards of other data: the trainer mixes what lies in it. Shards that are complete are not
    /// written again.
    #[arg(long, value_name = "SHARDS")]
    out: PathBuf,
    /// Pairs in a shard.
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = at_least_one::<usize>)]
    per_shard: usize,
    /// Write only part I of N of the shards: for N machines at work on one folder.
    #[arg(long, value_name = "I/N", default_value = "1/1", value_parser = parse_share)]
    shard: [usize; 2],
    /// Of the simulator: how many grasps.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = at_least_one::<usize>)]
    grasps: usize,
    /// Of the simulator: what they are drawn from. train: seen and drawn tools, drawn sensors; seen, unseen: those tools with the nominal
    /// sensors, for validation.
    #[arg(long, default_value = "train", value_parser = keyed::<Mix>())]
    mix: Mix,
    /// Of the simulator: what is wrong with the pairs, as for `simulate`.
    #[arg(long, default_value = "plain", value_parser = condition())]
    condition: Condition,
    /// Of the simulator: the same seed writes the same touches.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    limit: LimitArgs,
}

fn parse_share(text: &str) -> Result<[usize; 2], String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some([i.parse().ok()?, n.parse().ok()?]));
    let parts: Option<[usize; 2]> = parts.filter(|[i, n]| (1..=*n).contains(i));
    parts.ok_or_else(|| "it must be I/N with I between 1 and N, such as 2/8".into())
}

#[derive(Serialize)]
struct Report {
    out: PathBuf,
    #[serde(flatten)]
    written: WrittenShards,
    seconds: f64,
}

pub(crate) fn run(args: &TrainingDataArgs) -> VerbResult {
    let begin = Instant::now();
    let setup = ShardSetup { pairs_per_shard: args.per_shard, share: args.shard };
    let (written, output) = if args.dataset.path() == Path::new(SIMULATOR) {
        let output = args.dataset.output("simulating", args.grasps);
        let TrainingDataArgs { grasps, mix, condition, seed, .. } = *args;
        let source = TouchSource::Simulator { grasps, mix, condition, seed };
        (write_shards(source, setup, &args.out, &output.job())?, output)
    } else {
        let dataset = args.dataset.open()?;
        let ids = args.limit.spread(dataset.index.pairs.len());
        let pairs: Vec<PairId> = ids.into_iter().map(|id| PairId(id as u32)).collect();
        let output = args.dataset.output("writing", pairs.len());
        let source = TouchSource::Dataset(&dataset, &Labels::of(&dataset), &pairs);
        (write_shards(source, setup, &args.out, &output.job())?, output)
    };
    for remark in &written.left_out {
        output.note(&format!("left out: {}: {}", remark.name, remark.why));
    }
    let complete = written.left_out.is_empty();
    let report = Report { out: args.out.clone(), written, seconds: begin.elapsed().as_secs_f64() };
    output.finish(&report, || text(&report))?;
    Ok(complete)
}

fn text(report: &Report) -> String {
    let w = &report.written;
    let c = w.contact;
    let mut text = format!(
        "{} shards written, {} touches, in {:.1} s: {}\ncontact: {} by hand, {} near the CAD model, {} by the simulator, {} not known\n",
        w.written,
        w.touches,
        report.seconds,
        report.out.display(),
        c.hand,
        c.cad,
        c.truth,
        c.unknown
    );
    for (count, what) in [
        (w.already, "shards were there already"),
        (w.of_others, "shards are left to other machines"),
        (w.skipped, "pairs marked \"skip\" left out"),
        (w.left_out.len(), "pairs could not be used"),
    ] {
        if count > 0 {
            text += &format!("{count} {what}\n");
        }
    }
    text
}
