//! `touch2touch bundle check` and `touch2touch runtime`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde::Serialize;

use super::{Common, Output, VerbResult};
use crate::infer::bundle::Bundle;
use crate::infer::runtime;

/// What can be done with a bundle.
#[derive(Debug, Subcommand)]
pub(super) enum BundleVerb {
    /// Check a bundle's manifest, files and shapes, and list everything that is wrong.
    Check(BundleArgs),
}

/// Arguments of `bundle check`.
#[derive(Debug, Args)]
pub(super) struct BundleArgs {
    /// The folder with `manifest.json`.
    path: PathBuf,
    #[command(flatten)]
    common: Common,
}

#[derive(Serialize)]
struct BundleReport {
    bundle: PathBuf,
    name: Option<String>,
    hash: Option<String>,
    problems: Vec<String>,
}

pub(super) fn bundle(verb: &BundleVerb) -> VerbResult {
    let BundleVerb::Check(args) = verb;
    let output = Output::new(args.common, "checking", 1);
    let report = match Bundle::open(&args.path) {
        Ok(bundle) => BundleReport {
            bundle: args.path.clone(),
            name: Some(bundle.name().to_owned()),
            hash: Some(bundle.hash().to_owned()),
            problems: Vec::new(),
        },
        Err(err) => BundleReport {
            bundle: args.path.clone(),
            name: None,
            hash: None,
            problems: err.problems.iter().map(|p| format!("{}: {} ({})", p.file.display(), p.what, p.hint)).collect(),
        },
    };
    let sound = report.problems.is_empty();
    output.finish(&report, || {
        if sound {
            format!("{}: sound", args.path.display())
        } else {
            format!("{} is refused:\n  {}", args.path.display(), report.problems.join("\n  "))
        }
    })?;
    Ok(sound)
}

/// Arguments of `runtime`.
#[derive(Debug, Args)]
pub(super) struct RuntimeArgs {
    /// Fetch the ONNX Runtime library for this platform (by Python's pip) and keep it for the studio.
    #[arg(long)]
    fetch: bool,
    /// Where to keep it instead of the application's data folder.
    #[arg(long, requires = "fetch")]
    dir: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

pub(super) fn runtime(args: &RuntimeArgs) -> VerbResult {
    let output = Output::new(args.common, "runtime", 1);
    if args.fetch {
        let library = runtime::fetch_runtime(args.dir.as_deref())?;
        output.note(&format!("fetched {}", library.display()));
    }
    let report = runtime::runtime_report();
    output.finish(&report, || report.to_string())?;
    Ok(report.engine.is_some())
}
