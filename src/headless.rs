//! The command line: every verb calls the code that the studio's buttons call.
//!
//! With `--json`, standard output carries exactly one JSON object (`watch`: one a line, as things happen); progress, notes and errors go to standard error.
//! The exit code is 0 only when everything asked for was done; 1: not all of it; 2: an error; 141: standard output was closed.

mod adapt;
mod args;
mod compare;
mod contact_mask;
mod doctor;
mod evaluate;
mod export;
mod generate;
mod guard;
mod label;
mod masks;
mod models;
mod notes;
mod output;
mod pose;
mod recipe;
mod report;
mod simulate;
mod stats;
mod still;
mod version;
mod watch;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, CommandFactory as _, Parser, Subcommand};

use output::PrintError;

pub use args::{DatasetArgs, LimitArgs, at_least_one, keyed};
pub use output::{Output, says};
pub use recipe::{ModelArgs, RuntimeArg};
pub use simulate::condition;

use touch2touch_core::rig::Rig;
use touch2touch_pipeline::io::program::Program;
use touch2touch_pipeline::steps::recipe::Recipe;

/// From a GelSlim touch to the Soft Bubble imprint and the in-hand pose of the same grasp.
///
/// Without a verb the studio opens, on PATH or on the built-in demo.
#[derive(Debug, Parser)]
#[command(name = "touch2touch", args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    verb: Option<Verb>,
    /// A data set to open in the studio: a folder in the lab's layout or of image pairs, or a built-in one.
    path: Option<PathBuf>,
    /// Start the studio with its default layout and settings.
    #[arg(long)]
    reset_ui: bool,
    /// Print the version.
    #[arg(short = 'V', exclusive = true)]
    short_version: bool,
    /// Print the version, the commit, the model engines and the graphics device.
    #[arg(long, exclusive = true)]
    version: bool,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Write a simulated data set in the lab's format.
    Simulate(simulate::SimulateArgs),
    /// Predict Soft Bubble imprints from GelSlim images and compare them with the measured ones.
    Generate(generate::GenerateArgs),
    /// Compare any two imprints of a pair: measured, predictions, the mean of several seeds, a stored picture.
    Compare(Box<compare::CompareArgs>),
    /// Compute the depth statistics of a data set's predictions and measurements, for `--shift refit:FILE`.
    Stats(stats::StatsArgs),
    /// Follow a folder: predict and pose each GelSlim touch that appears, and write the result beside it.
    ///
    /// PATH may still be empty: a data set in the lab's layout (the bubbles may be missing), a folder of GelSlim .pt
    /// files, of NAME_gelslim.png, or of NAME_touch.png with NAME_reference.png or one reference.png (or .jpg).
    Watch(Box<watch::WatchArgs>),
    /// Estimate in-hand poses from measured or predicted imprints.
    Pose(pose::PoseArgs),
    /// Make the paper's results table of a data set: generators side by side, the measured imprints as the upper bound.
    Evaluate(Box<evaluate::EvaluateArgs>),
    /// Draw a pair in 3D, as a PNG of any size, or as the frames of a turntable.
    Still(Box<still::StillArgs>),
    /// Write a pair for other programs: its cloud (PLY), pose (JSON) and CAD model in the hand (STL).
    Export(Box<export::ExportArgs>),
    /// Fit a generator to pairs of your own sensors, and score it on pairs that were left out.
    Adapt(Box<adapt::AdaptArgs>),
    /// List or change labels: hand-drawn masks, review states, notes, accepted poses.
    Label(Box<label::LabelArgs>),
    /// Contact masks.
    #[command(subcommand)]
    Masks(masks::MasksVerb),
    /// Check a data set and list its problems, or set how it is read.
    Doctor(doctor::DoctorArgs),
    /// Model bundles.
    #[command(subcommand)]
    Bundle(models::BundleVerb),
    /// Show which engine runs the models and why, and which GPUs it can use.
    Runtime(models::RuntimeArgs),
}

/// Options that every verb takes.
#[derive(Debug, Clone, Copy, Args)]
pub struct Common {
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Result of a verb: true where everything asked for was done.
pub type VerbResult = anyhow::Result<bool>;

/// Exit code that the shell gives a program that writes into a pipe nobody reads any more.
const PIPE_CLOSED: u8 = 141;

/// Parses the arguments and runs the verb or the window.
pub fn main() -> ExitCode {
    main_with(std::env::args_os(), Program::executable()).into()
}

/// The program in another process than its own, such as Python's: `arguments` begin with its name. The exit code.
pub fn main_with(arguments: impl IntoIterator<Item = OsString>, this: Option<Program>) -> u8 {
    program(this, || parse(arguments).and_then(run))
}

/// A program of verbs: what it is, what it does, its exit code and what it says of errors.
pub fn program(this: Option<Program>, run: impl FnOnce() -> VerbResult) -> u8 {
    output::start_log();
    touch2touch_pipeline::job::bound_threads();
    match this {
        Some(program) => program.declare(),
        None => {
            log::warn!("model bundles are not tried before their first use: the program does not know its own path")
        }
    }
    match run() {
        Ok(true) => 0,
        Ok(false) => 1,
        Err(err) => match err.downcast_ref::<PrintError>() {
            Some(PrintError::Closed) => PIPE_CLOSED,
            _ => {
                output::note(&format!("error: {}", says(&err)));
                2
            }
        },
    }
}

/// Checks that a command line, the program's name first, is understood; nothing is run, opened or looked for.
///
/// # Errors
/// The message that the program would print.
pub fn check_command<T: Into<OsString> + Clone>(arguments: impl IntoIterator<Item = T>) -> Result<(), String> {
    match Cli::try_parse_from(arguments) {
        // Help and version are answers.
        Err(err) if err.use_stderr() => Err(err.to_string()),
        _ => Ok(()),
    }
}

/// The recipe of a command line of `pose`, the program's name first, for the sensors of `rig`; nothing is predicted.
///
/// # Errors
/// The message that the program would print.
pub fn recipe_of<T: Into<OsString> + Clone>(
    arguments: impl IntoIterator<Item = T>,
    rig: &Rig,
) -> anyhow::Result<Recipe> {
    match parse(arguments.into_iter().map(Into::into))?.and_then(|cli| cli.verb) {
        Some(Verb::Pose(args)) => args.recipe(rig),
        _ => anyhow::bail!("it is no command of pose"),
    }
}

/// Command line, parsed; `None` where it was only help or the version, which has been printed.
fn parse(arguments: impl IntoIterator<Item = OsString>) -> anyhow::Result<Option<Cli>> {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    // Before the parser, which takes any word for a path and complains about what follows it.
    if let Some(first) = arguments.get(1)
        && !first.to_string_lossy().starts_with('-')
        && !verbs().iter().any(|verb| first == verb.as_str())
    {
        check_studio_path(Path::new(first))?;
    }
    match Cli::try_parse_from(arguments) {
        Ok(cli) => Ok(Some(cli)),
        Err(err) if err.use_stderr() => {
            let text = err.to_string();
            anyhow::bail!("{}", text.strip_prefix("error: ").unwrap_or(&text).trim_end())
        }
        Err(help) => {
            output::print(help.to_string().trim_end())?;
            Ok(None)
        }
    }
}

fn verbs() -> Vec<String> {
    Cli::command().get_subcommands().map(|verb| verb.get_name().to_owned()).chain(["help".to_owned()]).collect()
}

/// Refuses what is neither a folder nor a file nor the name of a built-in data set, before a window opens: most likely it
/// is a mistyped verb.
fn check_studio_path(path: &Path) -> anyhow::Result<()> {
    use touch2touch_pipeline::io::dataset::BuiltIn;
    let word = path.to_string_lossy();
    if path.exists() || BuiltIn::named(&word).is_some() {
        return Ok(());
    }
    let mut near: Vec<(f64, String)> =
        verbs().into_iter().map(|verb| (strsim::jaro_winkler(&word.to_lowercase(), &verb), verb)).collect();
    near.sort_by(|a, b| b.0.total_cmp(&a.0));
    /// From here on two words look alike.
    const ALIKE: f64 = 0.75;
    let hint = match near.first() {
        Some((alike, verb)) if *alike >= ALIKE => format!("did you mean `touch2touch {verb}`?"),
        _ => "`touch2touch --help` lists the verbs".to_owned(),
    };
    anyhow::bail!("{word:?} is neither a verb nor a folder or file that exists; {hint}")
}

fn run(cli: Option<Cli>) -> VerbResult {
    let Some(cli) = cli else { return Ok(true) };
    match cli.verb {
        None if cli.short_version || cli.version => version::run(cli.version),
        None => {
            if let Some(path) = &cli.path {
                check_studio_path(path)?;
            }
            studio(cli.path, cli.reset_ui)
        }
        Some(Verb::Simulate(args)) => simulate::run(&args),
        Some(Verb::Generate(args)) => generate::run(&args),
        Some(Verb::Compare(args)) => compare::run(&args),
        Some(Verb::Stats(args)) => stats::run(&args),
        Some(Verb::Watch(args)) => watch::run(&args),
        Some(Verb::Pose(args)) => pose::run(&args),
        Some(Verb::Evaluate(args)) => evaluate::run(&args),
        Some(Verb::Still(args)) => still::run(&args),
        Some(Verb::Export(args)) => export::run(&args),
        Some(Verb::Adapt(args)) => adapt::run(&args),
        Some(Verb::Label(args)) => label::run(&args),
        Some(Verb::Masks(verb)) => masks::run(&verb),
        Some(Verb::Doctor(args)) => doctor::run(&args),
        Some(Verb::Bundle(verb)) => models::bundle(&verb),
        Some(Verb::Runtime(args)) => models::runtime(&args),
    }
}

#[cfg(feature = "gui")]
fn studio(path: Option<PathBuf>, reset_ui: bool) -> VerbResult {
    crate::ui::run(path, reset_ui).map_err(anyhow::Error::msg)?;
    Ok(true)
}

#[cfg(not(feature = "gui"))]
fn studio(_path: Option<PathBuf>, _reset_ui: bool) -> VerbResult {
    anyhow::bail!("this build has no window (cargo feature `gui`); see `touch2touch --help` for the verbs")
}

/// The pair called `name`, or the only one whose name has that in it.
fn find_pair(
    dataset: &touch2touch_pipeline::io::dataset::Dataset,
    name: &str,
) -> anyhow::Result<touch2touch_core::dataset::PairId> {
    let pairs = &dataset.index.pairs;
    let exact = pairs.iter().position(|p| p.name == name);
    let similar: Vec<usize> = (0..pairs.len()).filter(|&i| pairs[i].name.contains(name)).collect();
    let at = match (exact, similar.as_slice()) {
        (Some(id), _) => id,
        (None, [id]) => *id,
        (None, []) => anyhow::bail!("no pair is called {name:?}; `doctor` lists what is there"),
        (None, [first, second, ..]) => {
            let (a, b) = (&pairs[*first].name, &pairs[*second].name);
            anyhow::bail!("{} pairs are called like {name:?}, such as {a} and {b}: say more of the name", similar.len())
        }
    };
    Ok(touch2touch_core::dataset::PairId(at as u32))
}
