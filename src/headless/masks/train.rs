//! `touch2touch masks train`: a mask model trained on corrected masks, or on those that CAD models make.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::super::VerbResult;
use super::super::args::{DatasetArgs, RegistrationArgs, keyed, parse_minutes};
use super::super::recipe::{RuntimeArg, kept};
use touch2touch_core::units::counted;
use touch2touch_pipeline::export::DrawnMasks;
use touch2touch_pipeline::labels::Labels;
use touch2touch_pipeline::learn::new_bundle::models_folder;
use touch2touch_pipeline::learn::train::{
    MaskScore, MasksFrom, TrainChoice, TrainSetup, Trained, new_folder, plan, train,
};
use touch2touch_pipeline::learn::tuning::{Tuning, unfinished_folder};
use touch2touch_pipeline::steps::bundles::{self, BundleKind};
use touch2touch_pipeline::steps::models::Models;

/// Trained for so long where nothing is said.
const MINUTES: f64 = 10.0;

/// Arguments of `masks train`.
#[derive(Debug, Args)]
pub(in crate::headless) struct TrainArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The masks that are learned from: `drawn` by people, of pairs marked "done"; or from the `cad` model at the true pose
    /// (within 1 mm), of every pair that has both, where nobody drew a mask and marked it "done". No label is written.
    #[arg(long, default_value = MasksFrom::default().key(), value_parser = keyed::<MasksFrom>())]
    from: MasksFrom,
    /// The folder of the mask model's bundle to begin from; else the first mask model found.
    #[arg(long, value_name = "BUNDLE")]
    start: Option<PathBuf>,
    /// Train for so long (10 where nothing is said); a few steps are timed first. A run that was stopped goes on when the
    /// same is asked for again.
    #[arg(long, value_name = "M", conflicts_with = "steps", value_parser = parse_minutes)]
    minutes: Option<Duration>,
    /// Train with so many steps of eight masks each.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    steps: Option<u32>,
    /// Percent of the pairs that are left out of the training, for the score; 0 learns from all, and what that is worth is
    /// not known.
    #[arg(long, value_name = "PERCENT", default_value_t = TrainChoice::default().held_out_percent, value_parser = clap::value_parser!(u8).range(0..=90))]
    held_out: u8,
    /// Use pairs reserved for tests (test_only) like the rest; otherwise they are left out.
    #[arg(long)]
    test_in_train: bool,
    /// Seed: decides which pairs are left out, and the order and augmentation of the masks.
    #[arg(long, default_value_t = TrainChoice::default().seed)]
    seed: u64,
    /// The folder of the new bundle, empty or new; else one among the models that the program looks for at its start.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Show what would be trained on and train nothing.
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    runtime: RuntimeArg,
    #[command(flatten)]
    registration: RegistrationArgs,
    /// Neither keep a run that is stopped, nor look for one, nor for predictions that were made before.
    #[arg(long)]
    no_cache: bool,
}

pub(super) fn run(args: &TrainArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let output = args.dataset.output("training", 1);
    let labels = Labels::of(&dataset);
    let masks = DrawnMasks { labels: &labels, changed: &BTreeMap::new() };
    let choice = TrainChoice {
        from: args.from,
        held_out_percent: args.held_out,
        seed: args.seed,
        test_in_train: args.test_in_train,
    };
    let planned = plan(&dataset, &masks, choice)?;
    output.notes("", planned.lines());
    if args.dry_run {
        output.notes("note: ", planned.warnings());
        let [held_masks, held_pairs] = planned.held_out;
        let said = serde_json::json!({
            "masks": planned.masks(), "pairs": planned.pairs, "tools": planned.tools, "predicted": planned.predicted,
            "held_out": {"masks": held_masks, "pairs": held_pairs}, "left_out": planned.left_out,
            "unusable": planned.unreadable,
        });
        output.finish(&said, || "nothing was trained (--dry-run)".into())?;
        return Ok(planned.unreadable.is_empty());
    }
    planned.check()?;
    let found = bundles::find(&[]);
    let out = match &args.out {
        Some(out) => out.clone(),
        None => {
            let models = models_folder()
                .ok_or_else(|| anyhow::anyhow!("this system names no folder for models; name one with --out"))?;
            new_folder(&models, &dataset)
        }
    };
    let tuning = match (args.steps, args.minutes) {
        (Some(steps), _) => Tuning::Steps(steps),
        (None, minutes) => Tuning::Within(minutes.unwrap_or(Duration::from_secs_f64(60.0 * MINUTES))),
    };
    let setup = TrainSetup {
        start: found.take(BundleKind::Mask, args.start.as_deref(), &dataset.rig)?,
        generators: found.bundles.iter().filter(|bundle| bundle.kind == BundleKind::Generator).cloned().collect(),
        engine: args.runtime.choice(),
        registration: args.registration.one()?,
        choice,
        tuning,
        unfinished: if args.no_cache { None } else { unfinished_folder() },
        out,
    };
    let models = Models::new(if args.no_cache { None } else { kept() });
    let trained = train(&dataset, &masks, &setup, &models, &output.job())?;
    output.notes("not used: ", &trained.unusable);
    output.notes("note: ", &trained.warnings);
    let complete = trained.unusable.is_empty();
    output.finish(&trained, || text(&trained))?;
    Ok(complete)
}

fn text(trained: &Trained) -> String {
    let mut lines = Vec::new();
    if !trained.held_out.is_empty() {
        lines.push(format!("{:>15} {:>15}  on pairs left out, worst first", "IoU", "Dice"));
    }
    let change = |before: f64, after: f64| format!("{before:.3} -> {after:.3}");
    let row = |before: MaskScore, after: MaskScore, name: &str| {
        format!("{:>15} {:>15}  {name}", change(before.iou, after.iou), change(before.dice, after.dice))
    };
    for one in &trained.held_out {
        let imprint = match one.imprint {
            touch2touch_pipeline::labels::ImprintSource::Measured => "",
            touch2touch_pipeline::labels::ImprintSource::Predicted => ", predicted",
        };
        lines.push(row(one.before, one.after, &format!("{}, {}{imprint}", one.pair, one.finger)));
    }
    if let (Some(before), Some(after)) = (trained.before, trained.after) {
        lines.push(row(before, after, &format!("mean of {}", trained.held_out.len())));
    }
    for (worth, when) in trained.poses.iter().flatten().zip(["before", "after"]) {
        lines.push(format!("{when} on {} left out: {}", counted(worth.grasps, "grasp"), worth.text()));
    }
    lines.push(format!(
        "{} masks of {} pairs{}, {} steps, {:.0} s",
        trained.masks,
        trained.pairs,
        if trained.persons.is_empty() { String::new() } else { format!(" by {}", trained.persons.join(", ")) },
        trained.steps,
        trained.seconds
    ));
    lines.push(format!("{}: {}", trained.name, trained.bundle.display()));
    lines.join("\n")
}
