//! `touch2touch evaluate`: the paper's results table of a data set.

use std::path::PathBuf;
use touch2touch_pipeline::io::dataset::Dataset;

use clap::Args;

use super::VerbResult;
use super::args::{DatasetArgs, RegistrationArgs, at_least_one, keyed};
use super::contact_mask::MaskArgs;
use super::recipe::{MappingArgs, RuntimeArg, first_mask_model};
use touch2touch_core::diffusion::Sampler;
use touch2touch_core::evaluation::{self, Row, paper_rows};
use touch2touch_pipeline::infer::bundle::{Bundle, Found, Origin, find_all};
use touch2touch_pipeline::io::atomic;
use touch2touch_pipeline::io::error::FileError;
use touch2touch_pipeline::pairs::pads_named;
use touch2touch_pipeline::scores::evaluate::{Evaluation, Report, Setup, csv, evaluate, export, rows};
use touch2touch_pipeline::steps::models::Models;
use touch2touch_pipeline::steps::recipe::Recipe;

/// Arguments of `evaluate`.
#[derive(Debug, Args)]
pub(super) struct EvaluateArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// A generator's bundle; repeat for several rows (default: every generator that is found).
    #[arg(long = "bundle")]
    bundles: Vec<PathBuf>,
    /// The mask model's bundle (default: the first one found).
    #[arg(long)]
    mask_bundle: Option<PathBuf>,
    /// The tool classifier's bundle (default: the first one found).
    #[arg(long)]
    classifier: Option<PathBuf>,
    #[command(flatten)]
    mask: MaskArgs,
    #[command(flatten)]
    registration: RegistrationArgs,
    /// Finger whose images are scored: right, left (or as the data set names it), both. Angles always use both fingers.
    #[arg(long, value_name = "FINGER", default_value = "both")]
    fingers: String,
    /// Predict everything anew and keep nothing: ignores earlier predictions, also those of the studio.
    #[arg(long)]
    no_cache: bool,
    /// Use only this many grasps per tool, spread evenly.
    #[arg(long, value_name = "N", value_parser = at_least_one::<usize>)]
    grasps: Option<usize>,
    /// Sampling steps (default: each bundle's; a bundle that draws in one step keeps it).
    #[arg(long)]
    steps: Option<u32>,
    /// Seed of the noise, the same for every image (default: each bundle's).
    #[arg(long)]
    seed: Option<u64>,
    /// Sampler (default: each bundle's).
    #[arg(long, value_parser = keyed::<Sampler>())]
    sampler: Option<Sampler>,
    #[command(flatten)]
    mapping: MappingArgs,
    #[command(flatten)]
    runtime: RuntimeArg,
    /// Batch size of a generator.
    #[arg(long, default_value_t = Setup::default().batch, value_parser = batch)]
    batch: usize,
    /// Bootstrap samples for the 95 % confidence intervals; 0 for no intervals.
    #[arg(long, default_value_t = Setup::default().resamples)]
    resamples: usize,
    /// Add the rows that the paper and the lab published, on real data.
    #[arg(long)]
    paper: bool,
    /// Write the scores and their intervals to this file, one line per method and group.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write evaluation.csv and .json (with every grasp) into this folder, as the studio's button does.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Add the scores of every grasp to the JSON.
    #[arg(long)]
    pairs: bool,
}

fn batch(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| (1..=256).contains(n)).ok_or_else(|| "choose 1 to 256 images".to_owned())
}

pub(super) fn run(args: &EvaluateArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let setup = setup(args, &dataset)?;
    let output = args.dataset.output("evaluating", 0);
    let models = Models::new(if args.no_cache { None } else { super::recipe::kept() });
    let evaluation = evaluate(&dataset, &setup, &models, &output.job())?;
    super::notes::say_found(&dataset, &evaluation.findings);
    for skipped in &evaluation.skipped {
        let by = if skipped.method.is_empty() { String::new() } else { format!(" ({})", skipped.method) };
        output.note(&format!("{}{by}: {}", skipped.what, skipped.why));
    }
    let rows = rows(&evaluation, args.paper);
    if let Some(folder) = &args.out {
        export(&evaluation, args.paper, folder)?;
    }
    if let Some(file) = &args.csv {
        let table = csv(&evaluation, args.paper);
        atomic::write_bytes(file, table.as_bytes())
            .map_err(|err| FileError::io(file, "cannot write the table", err))?;
    }
    let pairs = args.pairs.then_some(evaluation.scores.as_slice());
    let published = if args.paper { paper_rows() } else { Vec::new() };
    let report = Report { evaluation: &evaluation, published, pairs };
    output.finish(&report, || text(&evaluation, &rows))?;
    Ok(evaluation.complete && evaluation.skipped.is_empty())
}

fn text(evaluation: &Evaluation, rows: &[Row]) -> String {
    let mut text = format!("{}\n\n{}", evaluation.size(), evaluation::text(rows));
    text += &format!("- {}\n", evaluation.conventions);
    for note in &evaluation.notes {
        text += &format!("- {note}\n");
    }
    if rows.iter().any(|r| r.published) {
        text += "- rows of the paper and the lab were published on real data: not directly comparable\n";
    }
    text += &format!("- {}; {:.0} s in all", evaluation.runtime, evaluation.seconds);
    if !evaluation.skipped.is_empty() {
        text += &format!("\n- {} items could not be scored, see above", evaluation.skipped.len());
    }
    text
}

/// The bundles that the arguments name, and for the rest those that are found.
fn setup(args: &EvaluateArgs, dataset: &Dataset) -> anyhow::Result<Setup> {
    let Found { bundles, problems } = find_all(&[]);
    let first = |named: &Option<PathBuf>, fits: fn(&Bundle) -> bool| {
        let named = named.as_ref().map(Origin::from);
        named.or_else(|| bundles.iter().find(|b| fits(b)).map(|b| b.origin().clone()))
    };
    let generators: Vec<Origin> = if args.bundles.is_empty() {
        let fits = |b: &&Bundle| b.ends(&dataset.rig).is_some_and(|ends| ends.is_ok());
        bundles.iter().filter(fits).map(|b| b.origin().clone()).collect()
    } else {
        args.bundles.iter().map(Origin::from).collect()
    };
    let gel = dataset.rig.is_gel();
    if generators.is_empty() && !gel {
        let refused: Vec<String> = problems.iter().map(|p| format!("\n- {}: {}", p.file.display(), p.what)).collect();
        anyhow::bail!(
            "no generator bundle for {} was found; name one with --bundle{}",
            dataset.rig.name,
            refused.concat()
        );
    }
    let fingers = pads_named(&dataset.rig, &args.fingers).map_err(anyhow::Error::msg)?;
    let finger = fingers.first().copied().filter(|_| fingers.len() < dataset.rig.pads().len());
    let only = if let [one] = generators.as_slice() { Some(Bundle::open(one.clone())?) } else { None };
    let shift = args.mapping.shift.mode(only.as_ref().map(|bundle| (bundle.name(), bundle.hash())))?;
    let mask_model = first_mask_model(args.mask_bundle.as_deref(), &bundles)?;
    let (mask, hand) = (args.mask.mask, !args.mask.no_hand);
    let (registration, engine) = (args.registration.one()?, args.runtime.choice());
    let recipe = Recipe { shift, mask, mask_model, hand, registration, engine, ..Recipe::default() };
    Ok(Setup {
        bundles: generators,
        classifier: first(&args.classifier, |b| b.tool_classifier().is_some())
            .filter(|_| args.classifier.is_some() || !gel),
        recipe,
        steps: args.steps,
        seed: args.seed,
        sampler: args.sampler,
        pairs: None,
        grasps_per_tool: args.grasps,
        finger,
        batch: args.batch,
        resamples: args.resamples,
    })
}
