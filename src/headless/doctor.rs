//! `touch2touch doctor PATH`: opens a dataset, loads every pair and lists what is wrong.

use std::ops::ControlFlow;

use clap::Args;
use serde::Serialize;

use super::args::DatasetArgs;
use super::{Common, Output, VerbResult};
use crate::domain::dataset::Problem;
use crate::io::doctor;

/// Arguments of `doctor`.
#[derive(Debug, Args)]
pub(super) struct DoctorArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    #[command(flatten)]
    common: Common,
}

#[derive(Serialize)]
struct Report<'a> {
    pairs: usize,
    problems: &'a [Problem],
}

/// Done means examined: problems found are the result, not a failure.
pub(super) fn run(args: &DoctorArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let output = Output::new(args.common, "examining", dataset.index.pairs.len());
    let report = doctor::examine(&dataset, &mut |done, total| {
        output.set(done, total);
        ControlFlow::Continue(())
    });
    output.finish(&Report { pairs: report.pairs, problems: &report.problems }, || {
        let mut text = format!("{}: {} pairs, {} problems\n", dataset.title, report.pairs, report.problems.len());
        for p in &report.problems {
            text += &format!("\n{}\n  {}\n  {}\n", p.file.display(), p.what, p.hint);
        }
        text
    })?;
    Ok(true)
}
