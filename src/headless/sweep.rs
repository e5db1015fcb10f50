//! `touch2touch sweep`: what a threshold, a probability, a gate, a trim or a shift does to every pose of a data set.

use clap::Args;

use super::args::{DatasetArgs, RegistrationParser, at_least_one, keyed};
use super::contact_mask::MaskArgs;
use super::recipe::ModelArgs;
use super::shards::{Parts, ShardArg, Sharded};
use super::{Common, Output, ToolArgs, VerbResult};
use touch2touch_core::dataset::PairId;
use touch2touch_core::pose::RegistrationChoice;
use touch2touch_work::labels::ImprintSource;
use touch2touch_work::mask::MaskSource;
use touch2touch_work::pairs;
use touch2touch_work::recipe::Recipe;
use touch2touch_work::sweep::{Dial, MOST_VALUES, Point, Series, Setting, Sweep, SweepSetup, sweep, sweep_part};

/// Arguments of `sweep`.
#[derive(Debug, Args)]
pub(super) struct SweepArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Dial to turn: `threshold` (imprint depth of contact, mm), `probability` (of the mask model, 0 to 1), `gate`
    /// (distance beyond which the registration leaves a contact out, mm), `trim` (share of the contacts that it leaves
    /// out, 0 to 0.9) or `shift` (exact, unfitted, paper, raw).
    #[arg(long, value_parser = keyed::<Dial>())]
    dial: Dial,
    /// Values that it is turned to, separated by commas (default: a usual range).
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_hyphen_values = true)]
    values: Vec<String>,
    /// Take only this many pairs, spread evenly over the data set.
    #[arg(long, visible_alias = "limit", value_name = "N", value_parser = at_least_one::<usize>)]
    pairs: Option<usize>,
    /// Only these pairs: their names, separated by commas.
    #[arg(long, value_name = "NAME,NAME", value_delimiter = ',', conflicts_with = "pairs")]
    only: Vec<String>,
    /// Leave the predictions out: measured imprints only.
    #[arg(long)]
    measured_only: bool,
    /// The registration. Its key may be followed by what it leaves out, as with `pose`.
    #[arg(long = "engine", value_name = "ENGINE", default_value_t = RegistrationChoice::default(), value_parser = RegistrationParser)]
    registration: RegistrationChoice,
    #[command(flatten)]
    shard: ShardArg,
    #[command(flatten)]
    mask: MaskArgs,
    #[command(flatten)]
    tool: ToolArgs,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    common: Common,
}

pub(super) fn run(args: &SweepArgs) -> VerbResult {
    let values = values(args).map_err(anyhow::Error::msg)?;
    let dataset = args.dataset.open_with(args.tool.tool_scale)?;
    let pairs: Vec<PairId> = if args.only.is_empty() {
        pairs::spread(dataset.index.pairs.len(), args.pairs).map(|at| PairId(at as u32)).collect()
    } else {
        args.only.iter().map(|name| super::find_pair(&dataset, name)).collect::<anyhow::Result<_>>()?
    };
    let pairs = args.shard.share(pairs);
    let output = Output::new(args.common, "turning the dial", pairs.len());
    let models = args.model.models();
    let imprint = if args.measured_only { ImprintSource::Measured } else { ImprintSource::Predicted };
    let recipe = args.model.posed(imprint, &dataset.rig, &args.mask, args.registration)?.of(ImprintSource::Measured);
    // The dial may ask for the mask model where the choice does not.
    let model = || args.model.mask_model(MaskSource::Unet, &dataset.rig);
    let mask_model = if args.dial == Dial::Probability { model()? } else { recipe.mask_model.clone() };
    let setup = SweepSetup { values, pairs, recipe: Recipe { mask_model, ..recipe } };
    let turn = if args.shard.shard.is_some() { sweep_part } else { sweep };
    let found = turn(&dataset, &setup, &models, &output.job())?;
    for remark in &found.left_out {
        output.note(&format!("left out: {}: {}", remark.name, remark.why));
    }
    let complete = found.complete && found.left_out.is_empty();
    args.shard.finish(output, (Sharded::Sweep, complete), Vec::new(), &found, || text(&found))
}

/// The parts of a run as one.
pub(super) fn merge(parts: &Parts, output: Output) -> VerbResult {
    let found = Sweep::joined(parts.reports()?)?.moving()?;
    output.finish(&found, || text(&found))?;
    Ok(parts.complete())
}

/// Settings that the dial is turned to.
fn values(args: &SweepArgs) -> Result<Vec<Setting>, String> {
    if args.values.is_empty() {
        let (first, last, count) = args.dial.usual();
        return args.dial.spread(first, last, count);
    }
    if args.values.len() > MOST_VALUES {
        return Err(format!("{} values are too many: at most {MOST_VALUES}", args.values.len()));
    }
    let parse = |text: &String| args.dial.parse(text).map_err(|why| format!("--values: {why}"));
    args.values.iter().map(parse).collect()
}

fn text<M>(found: &Sweep<M>) -> String {
    let mut text = format!("{}: {}, {} pairs\n", found.dataset, found.dial.name().to_lowercase(), found.pairs);
    for series in &found.series {
        text += &format!("\n{}", table(found.dial, series));
    }
    for note in &found.notes {
        text += &format!("- {note}\n");
    }
    text += "- * where the dial stands; \"as set\" is without turning it; change and residual are medians\n";
    text + &format!("- {:.1} s in all{}", found.seconds, if found.complete { "" } else { "; stopped early" })
}

fn table(dial: Dial, series: &Series) -> String {
    let unit = if dial.unit().is_empty() { String::new() } else { format!(" {}", dial.unit()) };
    let mut text = format!(
        "{:<22} {:>7} {:>8} {:>7} {:>7} {:>9} {:>9} {:>7} {:>8}\n",
        format!("{} imprints,{unit}", series.source.key()).trim_end_matches(','),
        "mean °",
        "median °",
        "<=5° %",
        "<=10° %",
        "change °",
        "rms mm",
        "points",
        "no pose"
    );
    for (at, point) in std::iter::once(&series.base).chain(&series.points).enumerate() {
        text += &line(point, at > 0 && series.best == Some(at - 1));
    }
    for point in &series.points {
        for failure in &point.summary.failures {
            let value = point.value.map(Setting::label).unwrap_or_default();
            text += &format!("  {value}: {} without a pose: {}\n", failure.count, failure.why);
        }
    }
    text
}

fn line(point: &Point, best: bool) -> String {
    let s = &point.summary;
    let number = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    let angle = |get: fn(&touch2touch_core::metrics::AngleSummary) -> Option<f64>| s.angle.as_ref().and_then(get);
    let name = point.value.map_or("as set".to_owned(), Setting::key);
    let mark = if point.value.is_some() && point.in_force { " *" } else { "" };
    let name = format!("{name}{mark}{}", if best { " best" } else { "" });
    format!(
        "{name:<22} {:>7} {:>8} {:>7} {:>7} {:>9} {:>9} {:>7} {:>8}\n",
        number(angle(|a| a.mean_deg), 2),
        number(angle(|a| a.median_deg), 2),
        number(angle(|a| Some(a.success_5)), 1),
        number(angle(|a| Some(a.success_10)), 1),
        number(s.median_change_rad.map(f64::to_degrees), 2),
        number(s.median_rms_m.map(|m| m * 1e3), 3),
        number(s.median_points, 0),
        s.failed
    )
}
