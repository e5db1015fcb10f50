//! `touch2touch doctor PATH`: says what a data set is and what the models are worth on a sample of it, loads the pairs and
//! lists what is wrong, and tries on a handful of pairs which other reading would explain them better.

mod set;

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::VerbResult;
use super::args::DatasetArgs;
use super::recipe::kept;
use touch2touch_core::findings::Finding;
use touch2touch_core::units::counted;
use touch2touch_pipeline::doctor::{self, Cure, Examined, Fact, Worth};
use touch2touch_pipeline::export::DrawnMasks;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::doctor::{DoctorReport, MOST_PAIRS};
use touch2touch_pipeline::io::error::FileErrorKind;
use touch2touch_pipeline::labels::{ImprintSource, Labels};
use touch2touch_pipeline::steps::bundles::{self, BundleKind};
use touch2touch_pipeline::steps::models::Models;
use touch2touch_pipeline::steps::recipe::Recipe;

/// Arguments of `doctor`. Findings that differ only in file, finger or numbers are one entry, in the text and in the JSON
/// (`problems`: `file`, `what`, `hint` of the first, `count`, `examples`).
#[derive(Debug, Args)]
pub(super) struct DoctorArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Check every pair, not 2000 spread evenly over a large data set.
    #[arg(long)]
    all: bool,
    /// Run no models: faster, but swapped GelSlims are not noticed.
    #[arg(long)]
    no_predictions: bool,
    /// The generator's bundle (default: the shipped one).
    #[arg(long)]
    bundle: Option<PathBuf>,
    /// Say something of the data for good, by a file beside them, and examine nothing: `read-as=LIST`, what the doctor
    /// offers, such as swap-fingers, several with commas (read-as.txt; an empty list removes it), or `unit:TOOL=UNIT` of m,
    /// cm, mm, um or in (unit.txt beside the tool's CAD model, for all models of that folder; where they are in several
    /// units it says `auto`). What the file said before is replaced.
    #[arg(long, value_name = "NAME=VALUE", num_args = 1..)]
    set: Vec<set::Setting>,
}

/// `problems` has an entry for each kind of problem: `file`, `what` and `hint` are of the first of its kind; `count` says
/// how many there are that differ only in file, finger or numbers, and `examples` names some of their files. `about` are
/// the lines of the studio's panel *About this data*, each with its cures.
#[derive(Serialize)]
struct Report<'a> {
    about: &'a [Fact],
    /// Worth of the models on the sample; `null` where none was tried.
    worth: Option<&'a Worth>,
    pairs: usize,
    /// Pairs that were loaded: 2000 at most, spread evenly, without `--all`.
    examined: usize,
    problems: &'a [Finding],
    /// The readings that would set it right, for `--set read-as=`; `null` where there is none.
    read_as: Option<String>,
}

/// Done means examined: problems found are the result, not a failure.
pub(super) fn run(args: &DoctorArgs) -> VerbResult {
    if !args.set.is_empty() {
        return set::run(&args.dataset, &args.set);
    }
    let output = args.dataset.output("examining", 0);
    let (mut about, mut worth) = (Vec::new(), None);
    let models = Models::new(kept());
    // Without knowing the sensors, none of its pairs can be examined.
    let (title, report, read_as, opened) = match Dataset::open(args.dataset.path()) {
        Ok(dataset) => {
            about = doctor::facts(&dataset, &DrawnMasks { labels: &Labels::of(&dataset), changed: &BTreeMap::new() });
            let recipe = if args.no_predictions { Recipe::default() } else { shipped(args, &dataset) };
            if !args.no_predictions {
                worth = doctor::worth(&dataset, &recipe, &models, &output.job())?;
            }
            about.extend(worth.iter().flat_map(Worth::facts));
            let most = if args.all { usize::MAX } else { MOST_PAIRS };
            let generator = recipe.generating().ok().map(|generating| (&models, generating));
            let Examined { report, read_as } = doctor::examined(&dataset, most, generator, &output.job())?;
            (dataset.title, report, read_as, true)
        }
        Err(err) if err.kind == FileErrorKind::Rig => {
            (args.dataset.path().display().to_string(), DoctorReport::refused(&err), None, false)
        }
        Err(err) => anyhow::bail!("{err}; {}", err.hint),
    };
    let DoctorReport { pairs, examined, ref problems } = report;
    let said = Report { about: &about, worth: worth.as_ref(), pairs, examined, problems, read_as };
    output.finish(&said, || {
        let all: usize = report.problems.iter().map(|p| p.count).sum();
        let kinds = match report.problems.len() {
            kinds if kinds == all => String::new(),
            kinds => format!(" of {kinds} kinds"),
        };
        let some = if examined < pairs {
            format!(" ({examined} checked, spread evenly; --all checks all)")
        } else {
            String::new()
        };
        let mut text = format!("{title}: {}{some}, {}{kinds}\n", counted(pairs, "pair"), counted(all, "problem"));
        about.iter().for_each(|fact| text += &line(fact));
        for p in &report.problems {
            text += &format!("\n{}\n  {}\n  {}\n", p.file.display(), p.what, p.hint);
            if p.count > 1 {
                text += &format!("  {} times like this, with other files, fingers or numbers", p.count);
                text += &also(p);
            }
        }
        text
    })?;
    Ok(opened)
}

/// A line of the panel, with the verbs that cure it. What every pair says stands below.
fn line(fact: &Fact) -> String {
    let mut text = format!("{:<11} {}\n", fact.topic.name(), fact.text);
    for cure in fact.cures.iter().filter(|cure| !matches!(cure, Cure::Examine { .. })) {
        if let Some(verb) = cure.verb() {
            text += &format!("{:<11} {}: {verb}\n", "", cure.name());
        }
    }
    text
}

/// The shipped models, or the generator that is named, with its own settings.
fn shipped(args: &DoctorArgs, dataset: &Dataset) -> Recipe {
    let found = bundles::find(&[]);
    let take = |kind, named| found.take(kind, named, &dataset.rig).ok();
    let generator = take(BundleKind::Generator, args.bundle.as_deref())
        .and_then(|bundle| Some((bundle.generator.as_ref()?.defaults, bundle)))
        .map(|(defaults, bundle)| (bundle.into(), defaults));
    let mask_model = take(BundleKind::Mask, None).map(Into::into);
    Recipe { imprint: ImprintSource::Predicted, generator, mask_model, ..Recipe::default() }
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
