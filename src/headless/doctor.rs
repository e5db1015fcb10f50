//! `touch2touch doctor PATH`: opens a data set, loads every pair and lists what is wrong.

use std::ops::ControlFlow;

use clap::Args;
use serde::Serialize;

use super::args::DatasetArgs;
use super::{Common, Output, VerbResult};
use crate::domain::findings::Finding;
use crate::io::doctor;

/// Arguments of `doctor`. Findings that differ only in file, finger or numbers are one entry, in the text and in the JSON
/// (`problems`: `file`, `what`, `hint` of the first, `count`, `examples`).
#[derive(Debug, Args)]
pub(super) struct DoctorArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    #[command(flatten)]
    common: Common,
}

/// `problems` has an entry for each kind of problem: `file`, `what` and `hint` are of the first of its kind; `count` says
/// how many there are that differ only in file, finger or numbers, and `examples` names some of their files.
#[derive(Serialize)]
struct Report<'a> {
    pairs: usize,
    problems: &'a [Finding],
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
        let all: usize = report.problems.iter().map(|p| p.count).sum();
        let kinds = match report.problems.len() {
            kinds if kinds == all => String::new(),
            kinds => format!(" of {kinds} kinds"),
        };
        let mut text = format!("{}: {} pairs, {all} problems{kinds}\n", dataset.title, report.pairs);
        for p in &report.problems {
            text += &format!("\n{}\n  {}\n  {}\n", p.file.display(), p.what, p.hint);
            if p.count > 1 {
                text += &format!("  {} times like this, but for file, finger and numbers", p.count);
                text += &also(p);
            }
        }
        text
    })?;
    Ok(true)
}

/// The other examples, by the names of their files.
fn also(finding: &Finding) -> String {
    let others: Vec<String> = finding
        .examples
        .iter()
        .skip(1)
        .map(|file| file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned())
        .collect();
    if others.is_empty() { "\n".into() } else { format!(", such as {}\n", others.join(", ")) }
}
