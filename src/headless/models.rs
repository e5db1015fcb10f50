//! `touch2touch bundle check` (with the second process it starts) and `touch2touch runtime`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde_json::json;

use super::{Common, Output, VerbResult};
use touch2touch_pipeline::infer::bundle::Bundle;
use touch2touch_pipeline::infer::engine::{EngineChoice, EngineKind, resolve};
use touch2touch_pipeline::infer::{runtime, sandbox};

/// Verbs of a bundle.
#[derive(Debug, Subcommand)]
pub(super) enum BundleVerb {
    /// Check a bundle's manifest, files and shapes, run it once on every available engine, and list all problems.
    Check(BundleArgs),
    /// Try a bundle: `check` starts this in a process of its own.
    #[command(hide = true)]
    Try(TryArgs),
}

/// Arguments of `bundle check`.
#[derive(Debug, Args)]
pub(super) struct BundleArgs {
    /// The folder with `manifest.json`.
    path: PathBuf,
    #[command(flatten)]
    common: Common,
}

/// Arguments of `bundle try`.
#[derive(Debug, Args)]
pub(super) struct TryArgs {
    engine: EngineChoice,
    path: PathBuf,
}

pub(super) fn bundle(verb: &BundleVerb) -> VerbResult {
    match verb {
        BundleVerb::Check(args) => check(args),
        BundleVerb::Try(args) => attempt(args),
    }
}

fn check(args: &BundleArgs) -> VerbResult {
    let named = EngineChoice::all().filter(|choice| *choice != EngineChoice::Auto);
    let engines: Vec<EngineKind> = named.filter_map(|choice| resolve(choice).ok()).collect();
    let output = Output::new(args.common, "checking", 1 + engines.len());
    let (mut runs_on, mut problems, mut opened) = (Vec::new(), Vec::new(), None);
    match Bundle::open(&args.path) {
        Ok(bundle) => {
            output.step("manifest and files");
            for engine in engines {
                output.message(engine.label());
                match sandbox::check(&bundle, engine) {
                    Ok(()) => runs_on.push(engine),
                    Err(refusal) => problems.push(refusal.to_string()),
                }
                output.step(engine.label());
            }
            opened = Some(bundle);
        }
        Err(err) => {
            problems = err.problems.iter().map(|p| format!("{}: {} ({})", p.file.display(), p.what, p.hint)).collect();
        }
    }
    let report = json!({
        "bundle": args.path, "name": opened.as_ref().map(Bundle::name), "hash": opened.as_ref().map(Bundle::hash),
        "engines": runs_on, "problems": problems,
    });
    let sound = problems.is_empty();
    output.finish(&report, || {
        let folder = args.path.display();
        let labels: Vec<&str> = runs_on.iter().map(|engine| engine.label()).collect();
        match (sound, labels.is_empty()) {
            (true, true) => format!("{folder}: valid, but this build has no engine to run it"),
            (true, false) => format!("{folder}: valid; runs on {}", labels.join(" and ")),
            (false, true) => format!("{folder} is not valid:\n  {}", problems.join("\n  ")),
            (false, false) => {
                format!("{folder} runs only on {}:\n  {}", labels.join(" and "), problems.join("\n  "))
            }
        }
    })?;
    Ok(sound)
}

/// The second process of a trial.
fn attempt(args: &TryArgs) -> VerbResult {
    // Also where the first process is gone and cannot end this one.
    std::thread::spawn(|| {
        std::thread::sleep(2 * sandbox::TIME);
        std::process::exit(1);
    });
    let output = Output::new(Common { json: false }, "trying", 1);
    let bundle = Bundle::open(&args.path)?;
    let mut written = Ok(());
    let taken = sandbox::run(&bundle, args.engine, &mut |text| {
        if written.is_ok() {
            written = output.line(&text, || text.to_owned());
        }
    })?;
    written.map(|()| taken)
}

/// Arguments of `runtime`.
#[derive(Debug, Args)]
pub(super) struct RuntimeArgs {
    #[command(flatten)]
    common: Common,
}

pub(super) fn runtime(args: &RuntimeArgs) -> VerbResult {
    let output = Output::new(args.common, "runtime", 1);
    let report = runtime::runtime_report();
    output.finish(&report, || report.to_string())?;
    Ok(report.engine.is_some())
}
