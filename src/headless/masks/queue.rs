//! `touch2touch masks queue`: which pairs are worth a look first.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::super::args::{DatasetArgs, RegistrationParser, keyed};
use super::super::contact_mask::MaskArgs;
use super::super::recipe::{MappingArgs, RuntimeArg, common, first_mask_model, kept};
use super::super::{Common, Output, ToolArgs, VerbResult};
use touch2touch_core::evaluation::Metric;
use touch2touch_core::pose::Registration;
use touch2touch_pipeline::infer::bundle::{Bundle, find_all};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::labels::{Labels, Review};
use touch2touch_pipeline::masks::queue::{Line, QueueBy, queue};
use touch2touch_pipeline::scores::evaluate::Setup;
use touch2touch_pipeline::steps::models::Models;

/// Arguments of `masks queue`.
#[derive(Debug, Args)]
pub(in super::super) struct QueueArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Metric that the pairs are ordered by: all together, how far the mask drawn by hand is from the mask model's, how
    /// many pixels the model is unsure of, the error of the angle, or how far kept predictions with different seeds are
    /// apart.
    #[arg(long, default_value = QueueBy::default().key(), value_parser = keyed::<QueueBy>())]
    by: QueueBy,
    /// Only the first so many.
    #[arg(long, value_name = "N")]
    first: Option<usize>,
    /// Leave out pairs that are marked "done" or "skip".
    #[arg(long)]
    unfinished: bool,
    /// The mask model's bundle (default: the first one found).
    #[arg(long)]
    mask_bundle: Option<PathBuf>,
    #[command(flatten)]
    mask: MaskArgs,
    /// The registration that gives the angles.
    #[arg(long = "engine", value_name = "ENGINE", default_value_t = Registration::default(), value_parser = RegistrationParser)]
    registration: Registration,
    #[command(flatten)]
    mapping: MappingArgs,
    #[command(flatten)]
    runtime: RuntimeArg,
    /// Neither look for metrics that were computed before (by the studio, too), nor keep those computed now.
    #[arg(long)]
    no_cache: bool,
    #[command(flatten)]
    tool: ToolArgs,
    #[command(flatten)]
    common: Common,
}

/// Answer of `masks queue`.
#[derive(Serialize)]
struct Report {
    by: &'static str,
    /// True where every pair was looked at.
    complete: bool,
    pairs: Vec<Line>,
}

/// As the studio does it with its preferences at their defaults.
fn setup(args: &QueueArgs, dataset: &Dataset) -> anyhow::Result<Setup> {
    let bundles = find_all(&[]).bundles;
    let first = |fits: fn(&Bundle) -> bool| bundles.iter().find(|b| fits(b)).map(|b| b.origin().clone());
    let generator = |b: &&Bundle| b.ends(&dataset.rig).is_some_and(|ends| ends.is_ok());
    let mask_model = first_mask_model(args.mask_bundle.as_deref(), &bundles)?;
    Ok(Setup {
        bundles: bundles.iter().filter(generator).map(|b| b.origin().clone()).collect(),
        classifier: first(|b| b.tool_classifier().is_some()),
        recipe: common(args.mapping.mode(None)?, &args.mask, mask_model, args.registration, args.runtime),
        ..Setup::default()
    })
}

pub(super) fn run(args: &QueueArgs) -> VerbResult {
    let dataset = args.dataset.open_with(args.tool.tool_scale)?;
    let output = Output::new(args.common, "ranking", 0);
    let models = Models::new(if args.no_cache { None } else { kept() });
    let (found, evaluation) = queue(&dataset, &setup(args, &dataset)?, &models, &output.job())?;
    for skipped in &evaluation.skipped {
        output.note(&format!("{}: {}", skipped.what, skipped.why));
    }
    let reviews = Labels::of(&dataset).reviews().states;
    let review = |name: &str| reviews.get(name).copied().unwrap_or_default();
    let mut pairs = found.lines(&dataset.index, args.by, review);
    if args.unfinished {
        pairs.retain(|line| !Review::from_stored(line.review).unwrap_or_default().is_finished());
    }
    pairs.truncate(args.first.unwrap_or(usize::MAX));
    let complete = evaluation.complete && evaluation.skipped.is_empty();
    let report = Report { by: args.by.key(), complete, pairs };
    output.finish(&report, || {
        let share = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{:.1}", v * 100.0));
        let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.2}"));
        let mut lines = vec![format!(
            "{:>7} {:>9} {:>8} {:>8} {:>9}  {:<11}  pair",
            "overall", "hand/mod%", "unsure%", "angle °", "spread mm", "review"
        )];
        for line in &report.pairs {
            let angle = if line.no_pose { "no pose".to_owned() } else { number(line.angle_error_deg) };
            lines.push(format!(
                "{:>7} {:>9} {:>8} {angle:>8} {:>9}  {:<11}  {}",
                number(line.overall),
                share(line.disagreement),
                share(line.unsure),
                number(line.seed_spread_mm),
                Review::from_stored(line.review).unwrap_or_default().name(),
                line.pair
            ));
        }
        let by = args.by.metric().map_or("all metrics together", Metric::name).to_lowercase();
        lines.push(format!("{} pairs by {by}, the most uncertain first", report.pairs.len()));
        lines.join("\n")
    })?;
    Ok(complete)
}
