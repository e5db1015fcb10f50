//! `touch2touch adapt`: a generator fitted to pairs of one's own sensors.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use serde::Serialize;

use super::VerbResult;
use super::args::{DatasetArgs, LimitArgs, parse_minutes};
use super::recipe::RecipeArgs;
use touch2touch_core::dataset::PairId;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::learn::adapt::{AdaptSetup, Adapted, Scored, Tuning, adapt};

/// Arguments of `adapt`.
#[derive(Debug, Args)]
pub(super) struct AdaptArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The folder of the fitted bundle. Without it the fit is scored and not saved.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Save the fit even if its scores or the data speak against it.
    #[arg(long, requires = "out")]
    force: bool,
    /// Replace a fit to other data in that folder.
    #[arg(long, requires = "out")]
    replace: bool,
    /// Only these pairs: their names, separated by commas.
    #[arg(long, value_name = "NAME,NAME", value_delimiter = ',')]
    pairs: Vec<String>,
    /// Folds of the cross-validation; whole tools are left out where at least three are known.
    /// 0: no cross-validation, and so no score on other pairs.
    #[arg(long, value_name = "K", default_value_t = 3, value_parser = parse_parts)]
    validate: usize,
    /// After the fit, also tune the networks for this many steps, such as 50: once for each fold, and once on all pairs.
    /// A run that was stopped continues when you run the same command again.
    #[arg(long, value_name = "STEPS", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=100_000))]
    tune: u32,
    /// Tune for this many minutes, all runs together; a few steps are timed first.
    #[arg(long, value_name = "M", conflicts_with = "tune", value_parser = parse_minutes)]
    minutes: Option<Duration>,
    #[command(flatten)]
    limit: LimitArgs,
    #[command(flatten)]
    recipe: RecipeArgs,
}

fn parse_parts(text: &str) -> Result<usize, String> {
    let parts: usize = text.parse().map_err(|_| "it must be a whole number".to_owned())?;
    if parts == 1 || parts > 1000 { Err("it must be 0 or between 2 and 1000".into()) } else { Ok(parts) }
}

#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    adapted: Adapted,
    /// The bundle that was fitted.
    from: String,
    engine: &'static str,
}

pub(super) fn run(args: &AdaptArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let pairs: Vec<PairId> = if args.pairs.is_empty() {
        args.limit.spread(dataset.index.pairs.len()).into_iter().map(|at| PairId(at as u32)).collect()
    } else {
        args.pairs.iter().map(|name| super::find_pair(&dataset, name)).collect::<anyhow::Result<_>>()?
    };
    let output = args.dataset.output("fitting", pairs.len());
    let models = args.recipe.model.models();
    let recipe = args.recipe.of(ImprintSource::Predicted, &dataset.rig)?;
    let setup = AdaptSetup {
        recipe,
        pairs,
        folds: args.validate,
        tuning: args.minutes.map(Tuning::Within).or((args.tune > 0).then_some(Tuning::Steps(args.tune))),
        unfinished: args.recipe.model.unfinished(),
        out: args.out.clone(),
        force: args.force,
        replace: args.replace,
    };
    let adapted = adapt(&dataset, &setup, &models, &output.job())?;
    super::notes::say_found(&dataset, &adapted.notes);
    output.notes("not used: ", &adapted.left_out);
    output.notes("look at ", &adapted.doubtful);
    output.notes("note: ", &adapted.warnings);
    output.notes("against this fit: ", &adapted.objections);
    let complete = adapted.left_out.is_empty() && adapted.unwritten.is_none();
    let report = Report {
        adapted,
        from: setup.recipe.generating()?.bundle.name.clone(),
        engine: args.recipe.model.engine_label()?,
    };
    output.finish(&report, || text(&report))?;
    Ok(complete)
}

fn text(report: &Report) -> String {
    let a = &report.adapted;
    let number = |v: Option<f64>, digits: usize| v.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    let mut text = format!(
        "{:<28} {:>8} {:>6} {:>8} {:>8} {:>8}\n",
        "on pairs left out", "PSNR dB", "SSIM", "unscaled", "shape", "angle °"
    );
    let mut row = |name: &str, s: &Scored| {
        text += &format!(
            "{name:<28} {:>8} {:>6} {:>8} {:>8} {:>8}\n",
            number(s.psnr_db, 2),
            number(s.ssim, 3),
            number(s.psnr_raw_db, 2),
            number(s.psnr_line_db, 2),
            number(s.angle.as_ref().and_then(|a| a.mean_deg), 2)
        );
    };
    row("before", &a.before);
    for (name, scored) in [("fitted", &a.closed_form), ("tuned", &a.after)] {
        if let Some(scored) = scored {
            row(name, scored);
        }
    }
    for pad in &a.pads {
        text += &format!(
            "\n{} ({} touches): shifted {:+.2} px right, {:+.2} px down; depth {:.3} · d {:+.2} mm",
            pad.pad,
            pad.touches,
            pad.offset_px[0],
            pad.offset_px[1],
            pad.gain,
            pad.offset_m * 1e3
        );
    }
    text += &format!(
        "\n\n{} pairs, {} touches, {} not used, {} doubtful; {:.1} s ({:.2} s for the fit) on {}\n",
        a.pairs,
        a.touches,
        a.left_out.len(),
        a.doubtful.len(),
        a.seconds,
        a.fit_seconds,
        report.engine
    );
    match (&a.bundle, &a.in_place_of) {
        (Some(bundle), _) => text + &format!("fitted {}, saved as {}\n", report.from, bundle.display()),
        (None, Some(other)) => {
            text + &format!("not saved: {other}; overwrite it with --replace, or name a new folder\n")
        }
        (None, None) if a.unwritten.is_some() => {
            text + "not saved, because of the objections above; --force saves it anyway\n"
        }
        (None, None) => text + "not saved: name a folder with --out to keep the fit\n",
    }
}
