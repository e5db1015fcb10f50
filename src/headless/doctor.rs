//! `touch2touch doctor PATH`: opens a data set, loads every pair and lists what is wrong.

use std::ops::ControlFlow;

use clap::Args;
use serde::Serialize;

use super::args::DatasetArgs;
use super::{Common, Output, VerbResult};
use crate::domain::findings::Finding;
use crate::io::dataset::OpenError;
use crate::io::doctor::{self, DoctorReport};

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
    let output = Output::new(args.common, "examining", 0);
    // Without knowing the sensors, none of its pairs can be examined.
    let (title, report, examined) = match args.dataset.open_unsaid() {
        Ok(dataset) => {
            let report = doctor::examine(&dataset, &mut |done, total| {
                output.set(done, total);
                ControlFlow::Continue(())
            });
            (dataset.title, report, true)
        }
        Err(err @ OpenError::Rig { .. }) => {
            (args.dataset.path().display().to_string(), DoctorReport::refused(&err), false)
        }
        Err(err) => anyhow::bail!("{err}; {}", err.hint()),
    };
    output.finish(&Report { pairs: report.pairs, problems: &report.problems }, || {
        let all: usize = report.problems.iter().map(|p| p.count).sum();
        let kinds = match report.problems.len() {
            kinds if kinds == all => String::new(),
            kinds => format!(" of {kinds} kinds"),
        };
        let mut text = format!("{title}: {} pairs, {all} problems{kinds}\n", report.pairs);
        for p in &report.problems {
            text += &format!("\n{}\n  {}\n  {}\n", p.file.display(), p.what, p.hint);
            if p.count > 1 {
                text += &format!("  {} times like this, but for file, finger and numbers", p.count);
                text += &also(p);
            }
        }
        text
    })?;
    Ok(examined)
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
