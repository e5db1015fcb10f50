//! `touch2touch read-as PATH`: how a data set is read otherwise than it is stored, and a way to say it.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::args::{DatasetArgs, Readings, parse_readings};
use super::{Common, Output, VerbResult};
use touch2touch_work::doubts::read_otherwise;
use touch2touch_work::io::dataset::READ_AS_FILE;

/// Arguments of `read-as`.
#[derive(Debug, Args)]
pub(super) struct ReadAsArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Write the file read-as.txt into the data set that says this: what the doctor offers, such as swap-fingers; several
    /// with commas. What it said before is replaced.
    #[arg(long, value_name = "LIST", value_parser = parse_readings, conflicts_with = "clear")]
    set: Option<Readings>,
    /// Remove that file: the data are read as they are stored.
    #[arg(long)]
    clear: bool,
    #[command(flatten)]
    common: Common,
}

#[derive(Serialize)]
struct Report {
    /// The ways in which the data are read, in order; none where they are read as they are stored.
    read_as: Vec<String>,
    /// Mistake in the stored data that each of them mends.
    because: Vec<String>,
    /// The file that says so.
    file: Option<PathBuf>,
}

pub(super) fn run(args: &ReadAsArgs) -> VerbResult {
    let mut dataset = args.dataset.open()?;
    let said = args.set.as_ref().map(|set| set.0.clone()).or_else(|| args.clear.then(Vec::new));
    if let Some(read_as) = said {
        read_otherwise(&dataset, &read_as)?;
        dataset = dataset.reading(read_as);
    }
    let file = dataset.root.as_ref().map(|root| root.join(READ_AS_FILE)).filter(|file| file.is_file());
    let report = Report {
        read_as: dataset.read_as().iter().map(ToString::to_string).collect(),
        because: dataset.read_as().iter().map(|read_as| read_as.mistake()).collect(),
        file,
    };
    let output = Output::new(args.common, "reading", 1);
    output.finish(&report, || {
        if report.read_as.is_empty() {
            return "read as it is stored\n".to_owned();
        }
        let lines = report.read_as.iter().zip(&report.because).map(|(key, why)| format!("{key:<24} {why}\n"));
        lines.collect()
    })?;
    Ok(true)
}
