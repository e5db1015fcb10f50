//! `touch2touch watch`: each GelSlim touch that appears in a folder is predicted, posed, and written beside it. This is
//! how a robot uses the models online.

mod done;
mod one;
mod recipe;
mod summary;
mod write;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use async_signal::{Signal, Signals};
use clap::Args;
use serde::Serialize;
use serde_json::json;

use super::args::DatasetArgs;
use super::contact_mask::{MaskArgs, readable};
use super::guard::{Bug, guarded};
use super::output::says;
use super::pose::{Registrations, RegistrationsParser};
use super::recipe::ModelArgs;
use super::{Common, Output, ToolArgs, VerbResult, report};
use done::Done;
use one::{Arrived, Worker};
use summary::Summary;
use touch2touch_core::dataset::{PairId, Problem};
use touch2touch_core::rig::PerPad;
use touch2touch_core::sample::DepthCamera;
use touch2touch_pipeline::follow::{FollowEvent, Following};
use touch2touch_pipeline::io::dataset::{Dataset, cameras_of, rig_of};
use touch2touch_pipeline::io::follow::{Arrival, FollowConfig, PERIOD, Ready, Stamp};
use touch2touch_pipeline::io::names::Outputs;
use touch2touch_pipeline::job::Cancel;
use touch2touch_pipeline::labels::PairLabels;
use touch2touch_pipeline::steps::estimate::Touch;
use touch2touch_pipeline::steps::mask::MaskSource;
use write::Save;

/// Arguments of `watch`.
#[derive(Debug, Args)]
pub(super) struct WatchArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Write the results into this folder instead of beside the touches.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The tool held: an .stl file, or the name of a tool of the data set or the demo. Without it, the tool that the
    /// file's name says; if that says none, there is no pose.
    #[arg(long, value_name = "NAME|FILE.stl")]
    tool: Option<String>,
    #[command(flatten)]
    unit: ToolArgs,
    /// The bubble cameras for touches without a bubble file: a bubble .pt file of the same rig, or `demo`. Without it,
    /// rig.pt in the folder, else its first bubble file; if there is none, there is no pose.
    #[arg(long, value_name = "FILE.pt|demo")]
    camera: Option<PathBuf>,
    #[command(flatten)]
    mask: MaskArgs,
    /// The registration.
    #[arg(long = "engine", value_name = "ENGINE", default_value = "default", value_parser = RegistrationsParser)]
    registration: Registrations,
    /// Files that are written beside NAME.t2t.json: imprints in meters and masks as .npz or .pt, 16-bit pictures (0.001
    /// mm steps from -20 mm) as .png.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Save::Npz, Save::Png])]
    save: Vec<Save>,
    /// Take up what lies there already as well, unless it was done with the same recipe.
    #[arg(long)]
    existing: bool,
    /// Take up what lies there, and end.
    #[arg(long)]
    once: bool,
    /// Time that a file that cannot be read may stay unchanged before it counts as broken, seconds.
    #[arg(long, default_value_t = 2.0, value_name = "SECONDS")]
    patience: f64,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    common: Common,
}

/// File of a touch when it was done: with the same numbers and the same recipe it need not be done again.
#[derive(Debug, Clone, Serialize)]
struct Source {
    file: String,
    bytes: u64,
    modified_ns: u64,
}

impl Source {
    fn new(file: &Path, stamp: Stamp) -> Self {
        let name = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        Self { file: name, bytes: stamp.bytes, modified_ns: stamp.modified_ns() }
    }
}

pub(super) fn run(args: &WatchArgs) -> VerbResult {
    let output = Output::new(args.common, "watching", 0);
    let stop = Cancel::default();
    take_signals(stop.clone())?;
    let masks = args.mask.choice().source;
    if matches!(masks, MaskSource::Cad | MaskSource::Truth) {
        anyhow::bail!("--mask {} needs the true pose, which a new touch does not have", masks.key());
    }
    let mut outputs = args.out.as_deref().map(report::outputs).transpose()?;
    let patience = Duration::try_from_secs_f64(args.patience)
        .map_err(|_| anyhow::anyhow!("--patience {} is no time in seconds", args.patience))?;
    let config = FollowConfig {
        existing: args.existing || args.once,
        patience,
        tool_scale: args.unit.tool_scale,
        cameras: cameras(args.camera.as_deref())?,
    };
    let mut following = Following::new(args.dataset.path(), config)?;
    // The models are chosen for the sensors before the first touch is there.
    let rig = rig_of(args.dataset.path()).map_err(|err| anyhow::anyhow!("{err}; {}", err.hint()))?;
    let mut worker = Worker::new(args, &rig, stop.clone())?;
    let ready = json!({
        "event": "ready", "folder": args.dataset.path(), "recipe": worker.recipe(None, &PairLabels::default())?, "period_ms": PERIOD.as_secs_f64() * 1e3,
        "load_and_warm_up_s": worker.warm_s,
    });
    output.line(&ready, || {
        format!("following {} (models warm after {:.1} s); Ctrl-C ends", args.dataset.path().display(), worker.warm_s)
    })?;

    following.dataset().into_iter().for_each(|dataset| super::notes::say_problems(dataset));
    let mut summary = Summary::default();
    while let Some(event) = following.wait(&stop, args.once) {
        match event {
            FollowEvent::Ready(ready) => {
                touch(&mut outputs, &mut following, &mut worker, &ready, &output, &mut summary)?;
            }
            FollowEvent::Trouble(Problem { file, what, hint }) => {
                let event = json!({"event": "trouble", "file": file, "error": what, "hint": hint});
                output.line(&event, || format!("{}: {what} ({hint})", file.display()))?;
            }
            FollowEvent::Recovered => {
                output.line(&json!({"event": "recovered"}), || "the folder is in order again".to_owned())?;
            }
        }
    }
    if args.once && following.dataset().is_none() {
        anyhow::bail!(
            "no touch was found ({}); see `touch2touch watch --help` for what counts as one",
            args.dataset.path().display()
        );
    }
    output.line(&summary.json(), || summary.text())?;
    Ok(summary.failed() == 0 && following.is_in_order())
}

/// From now on Ctrl-C sets `stop` instead of ending the program in the middle of a touch; a second one ends it.
fn take_signals(stop: Cancel) -> anyhow::Result<()> {
    let wanted: &[Signal] = if cfg!(unix) { &[Signal::Int, Signal::Term] } else { &[Signal::Int] };
    let signals =
        Signals::new(wanted).map_err(|err| anyhow::anyhow!("cannot take care of Ctrl-C and its kind: {err}"))?;
    std::thread::Builder::new().name("signals".into()).spawn(move || {
        for _ in futures_lite::stream::block_on(signals) {
            if stop.is_cancelled() {
                std::process::exit(130);
            }
            stop.cancel();
        }
    })?;
    Ok(())
}

/// The cameras that `--camera` names.
fn cameras(named: Option<&Path>) -> anyhow::Result<Option<PerPad<DepthCamera>>> {
    let Some(file) = named else { return Ok(None) };
    let cameras = if file == Path::new("demo") {
        Dataset::demo().load(PairId(0))?.pads.map(|touch| touch?.depth()?.camera.clone())
    } else {
        cameras_of(file)?
    };
    if cameras.is_empty() {
        anyhow::bail!(
            "the file has no camera: K, bubbles_tr_quat, grasp_frame_quat and bubble_depth_ref are needed ({})",
            file.display()
        );
    }
    Ok(Some(cameras))
}

/// Takes one touch as far as it goes now.
fn touch(
    outputs: &mut Option<Outputs>,
    following: &mut Following,
    worker: &mut Worker<'_>,
    ready: &Ready,
    output: &Output,
    summary: &mut Summary,
) -> anyhow::Result<()> {
    if ready.completed {
        return Ok(());
    }
    let stem = match outputs.as_mut().map(|outputs| outputs.stem(&ready.name)) {
        None => ready.file.with_extension(""),
        Some(Ok(stem)) => stem,
        Some(Err(clash)) => {
            summary.fail();
            let event = json!({"event": "error", "name": ready.name, "error": clash.to_string()});
            return output.line(&event, || format!("{}: {clash}", ready.name));
        }
    };
    let source = Source::new(&ready.file, ready.stamp);
    let tool = worker.tool_name(following.entry(ready).and_then(|entry| entry.tool.clone()));
    let labels = readable(following.labels(ready), output);
    let recipe = worker.recipe(tool.as_deref(), &labels)?;
    if write::is_done(&stem, &source, &recipe) {
        summary.skip();
        return output.line(&json!({"event": "skipped", "name": ready.name}), || {
            format!("{}: was done with the same recipe", ready.name)
        });
    }
    let found = SystemTime::now();
    let start = Instant::now();
    let problem = match following.read(ready) {
        Arrival::Unfinished => return Ok(()),
        Arrival::Gone => {
            return output.line(&json!({"event": "gone", "name": ready.name}), || format!("{}: is gone", ready.name));
        }
        Arrival::Broken(problem) => problem,
        Arrival::Whole(loaded) => {
            let Some(dataset) = following.dataset().cloned() else { return Ok(()) };
            let (sample, read) = (&loaded.sample, Instant::now());
            let work = || {
                let tool = worker.tool_of(&dataset, sample, tool.as_deref());
                let model = tool.as_ref().map(|tool| &*tool.model);
                let touch = Touch { dataset: &dataset, pair: ready.id, sample, tool: model, labels: &labels };
                let tool = tool.as_ref().map(|tool| &*tool.name).ok();
                let arrived =
                    Arrived { ready, tool, found, start, read, stem: &stem, source: &source, recipe: &recipe };
                worker.work(touch, arrived)
            };
            match guarded(vec![ready.file.clone()], work) {
                Ok(Some(done)) => return report(output, &done, summary),
                // Ctrl-C.
                Ok(None) => return Ok(()),
                Err(err) => {
                    if err.is::<Bug>() {
                        worker.recover();
                    }
                    Problem {
                        file: ready.file.clone(),
                        what: says(&err),
                        hint: "touch the file to have it tried again".into(),
                    }
                }
            }
        }
    };
    summary.fail();
    if let Err(err) = write::failure(&stem, &source, &recipe, &problem) {
        output.note(&format!("{}: {}", ready.name, says(&err)));
    }
    let event = json!({"event": "error", "name": ready.name, "error": problem.what, "hint": problem.hint});
    output.line(&event, || format!("{}: {} ({})", ready.name, problem.what, problem.hint))
}

fn report(output: &Output, done: &Done, summary: &mut Summary) -> anyhow::Result<()> {
    summary.add(&done.latency, done.fresh);
    for note in &done.notes {
        output.note(&super::notes::line(note));
    }
    for note in &done.mask_notes {
        output.note(&format!("note: {}, {note}", done.name));
    }
    let mut event = json!({"event": "done"});
    if let (Some(event), serde_json::Value::Object(rest)) = (event.as_object_mut(), serde_json::to_value(done)?) {
        event.extend(rest);
    }
    output.line(&event, || done.text())
}
