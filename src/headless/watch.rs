//! `touch2touch watch`: each GelSlim touch that appears in a folder is predicted, posed, and written beside it. This is
//! how a robot uses the models online.

mod files;
mod one;

use std::path::PathBuf;
use std::time::{Instant, SystemTime};

use async_signal::{Signal, Signals};
use clap::Args;
use serde_json::json;

use super::args::DatasetArgs;
use super::contact_mask::readable;
use super::guard::{Bug, guarded};
use super::output::says;
use super::recipe::RecipeArgs;
use super::{Output, VerbResult};
use one::{Arrived, Done, Worker};
use touch2touch_core::dataset::Problem;
use touch2touch_pipeline::follow::{FollowEvent, Following, PERIOD, Ready};
use touch2touch_pipeline::io::dataset::rig_of;
use touch2touch_pipeline::io::names::Outputs;
use touch2touch_pipeline::job::Cancel;
use touch2touch_pipeline::labels::PairLabels;
use touch2touch_pipeline::steps::estimate::Touch;
use touch2touch_pipeline::steps::mask::MaskSource;

/// Arguments of `watch`.
#[derive(Debug, Args)]
pub(super) struct WatchArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Write the results into this folder instead of beside the touches.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The tool in the hand: an .stl file, or a tool of the data set or the demo (default: from the file name; without a
    /// tool there is no pose).
    #[arg(long, value_name = "NAME|FILE.stl")]
    tool: Option<String>,
    /// Process what is in the folder, skip what was done with the same settings, and exit.
    #[arg(long)]
    once: bool,
    #[command(flatten)]
    recipe: RecipeArgs,
}

pub(super) fn run(args: &WatchArgs) -> VerbResult {
    let output = args.dataset.output("watching", 0);
    let stop = Cancel::default();
    take_signals(stop.clone())?;
    let masks = args.recipe.mask.mask.source;
    if matches!(masks, MaskSource::Cad | MaskSource::Truth) {
        anyhow::bail!("--mask {} needs the true pose, which a new touch does not have", masks.key());
    }
    let folder = args.dataset.path();
    let outputs = args.out.as_deref().map(Outputs::new).transpose()?;
    let following = Following::new(folder, args.once)?;
    // The models are chosen for the sensors before the first touch is there.
    let rig = rig_of(folder).map_err(|err| anyhow::anyhow!("{err}; {}", err.hint))?;
    let worker = Worker::new(args, &rig, stop.clone())?;
    let ready = json!({
        "event": "ready", "folder": folder, "recipe": worker.recipe(None, &PairLabels::default())?,
        "period_ms": PERIOD.as_secs_f64() * 1e3, "load_and_warm_up_s": worker.warm_s,
    });
    output.line(&ready, || {
        format!("following {} (models warm after {:.1} s); Ctrl-C ends", folder.display(), worker.warm_s)
    })?;
    following.dataset().into_iter().for_each(|dataset| super::notes::say_problems(dataset));
    let mut watch = Watch { output, outputs, following, worker, tool: args.tool.clone(), summary: Summary::default() };
    while let Some(event) = watch.following.wait(&stop, args.once) {
        let output = &watch.output;
        match event {
            FollowEvent::Ready(ready) => watch.touch(&ready)?,
            FollowEvent::Trouble(Problem { file, what, hint }) => {
                let event = json!({"event": "trouble", "file": file, "error": what, "hint": hint});
                output.line(&event, || format!("{}: {what} ({hint})", file.display()))?;
            }
            FollowEvent::Recovered => {
                output.line(&json!({"event": "recovered"}), || "the folder is in order again".to_owned())?;
            }
        }
    }
    let Watch { output, following, summary, .. } = watch;
    if args.once && following.dataset().is_none() {
        anyhow::bail!(
            "no touch was found ({}); see `touch2touch watch --help` for what counts as one",
            folder.display()
        );
    }
    output.line(&summary.json(), || summary.text())?;
    Ok(summary.failed == 0 && following.is_in_order())
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

/// A folder that is watched.
struct Watch {
    output: Output,
    outputs: Option<Outputs>,
    following: Following,
    worker: Worker,
    /// The tool of all touches, where one is named.
    tool: Option<String>,
    summary: Summary,
}

impl Watch {
    /// Takes one touch as far as it goes now.
    fn touch(&mut self, ready: &Ready) -> anyhow::Result<()> {
        let Self { output, outputs, following, worker, summary, tool } = self;
        if ready.completed {
            return Ok(());
        }
        let stem = match outputs.as_mut().map(|outputs| outputs.stem(&ready.name)) {
            None => ready.file.with_extension(""),
            Some(Ok(stem)) => stem,
            Some(Err(clash)) => {
                summary.failed += 1;
                let event = json!({"event": "error", "name": ready.name, "error": clash.to_string()});
                return output.line(&event, || format!("{}: {clash}", ready.name));
            }
        };
        let source = files::source(&ready.file, ready.stamp);
        // What the command line says, else what the file's name says.
        let tool = tool.clone().or_else(|| following.entry(ready)?.tool.clone());
        let labels = readable(following.labels(ready), output);
        let recipe = worker.recipe(tool.as_deref(), &labels)?;
        if files::is_done(&stem, &source, &recipe) {
            summary.skipped += 1;
            return output.line(&json!({"event": "skipped", "name": ready.name}), || {
                format!("{}: already done with the same recipe", ready.name)
            });
        }
        let begun = (SystemTime::now(), Instant::now());
        let (Some(read), Some(dataset)) = (following.read(ready), following.dataset()) else { return Ok(()) };
        let done = read.and_then(|sample| {
            let work = || {
                let tool = worker.tool_of(dataset, &sample, tool.as_deref());
                let model = tool.as_ref().map(|(_, model)| &**model);
                let touch = Touch { dataset, pair: ready.id, sample: &sample, tool: model, labels: &labels };
                let tool = tool.as_ref().ok().map(|(name, _)| name.as_str());
                worker.work(touch, Arrived { ready, tool, begun, stem: &stem, source: &source, recipe: &recipe })
            };
            guarded(vec![ready.file.clone()], work).map_err(|err| {
                if err.is::<Bug>() {
                    // The models are loaded anew for the next touch.
                    worker.models.forget();
                }
                let hint = "touch the file to have it tried again".into();
                Problem { file: ready.file.clone(), what: says(&err), hint }
            })
        });
        match done {
            Ok(Some(done)) => report(output, &done, summary),
            // Ctrl-C.
            Ok(None) => Ok(()),
            Err(problem) => {
                summary.failed += 1;
                if let Err(err) = files::failure(&stem, &source, &recipe, &problem) {
                    output.note(&format!("{}: {}", ready.name, says(&err)));
                }
                let Problem { what, hint, .. } = problem;
                let event = json!({"event": "error", "name": ready.name, "error": what, "hint": hint});
                output.line(&event, || format!("{}: {what} ({hint})", ready.name))
            }
        }
    }
}

fn report(output: &Output, done: &Done, summary: &mut Summary) -> anyhow::Result<()> {
    if done.fresh { &mut summary.fresh } else { &mut summary.backlog }.push(done.latency);
    output.notes("", done.notes.iter().map(super::notes::line));
    output.notes(&format!("note: {}, ", done.name), &done.mask_notes);
    let mut event = serde_json::to_value(done)?;
    event["event"] = "done".into();
    output.line(&event, || done.text())
}

/// Counts and times of a run.
#[derive(Debug, Default)]
struct Summary {
    fresh: Vec<Latency>,
    backlog: Vec<Latency>,
    skipped: usize,
    failed: usize,
}

/// Times of one touch, milliseconds.
#[derive(Debug, Clone, Copy, Default, serde::Serialize)]
struct Latency {
    /// From its being found whole to meters: reading and the generator, both fingers.
    generate: f64,
    /// From its being found whole to the result on the disk.
    work: f64,
    /// From the file's last change to the result on the disk.
    total: f64,
}

/// Median, 95th percentile and largest of a time.
fn spread(times: impl Iterator<Item = f64>) -> Option<[f64; 3]> {
    let mut times: Vec<f64> = times.collect();
    times.sort_by(f64::total_cmp);
    let last = times.len().checked_sub(1)?;
    // Nearest rank: a time that was measured, not one in between.
    let rank = |share: f64| times[((share * times.len() as f64).ceil() as usize).clamp(1, times.len()) - 1];
    Some([rank(0.5), rank(0.95), times[last]])
}

impl Summary {
    fn json(&self) -> serde_json::Value {
        let times = |list: &[Latency]| {
            let of = |get: fn(&Latency) -> f64| {
                spread(list.iter().map(get)).map(|[median, p95, max]| json!({"median": median, "p95": p95, "max": max}))
            };
            json!({
                "touches": list.len(), "generate": of(|l| l.generate), "work": of(|l| l.work), "total": of(|l| l.total),
            })
        };
        json!({
            "event": "summary", "done": self.fresh.len() + self.backlog.len(), "skipped": self.skipped,
            "failed": self.failed, "latency_ms": times(&self.fresh), "existing_ms": times(&self.backlog),
        })
    }

    fn text(&self) -> String {
        let (fresh, backlog) = (&self.fresh, &self.backlog);
        let mut text =
            format!("{} done, {} skipped, {} failed", fresh.len() + backlog.len(), self.skipped, self.failed);
        if let Some([median, p95, max]) = spread(fresh.iter().map(|l| l.total)) {
            text += &format!(
                "\nlatency, file closed to result written, {} touches: median {median:.0} ms, p95 {p95:.0} ms, worst {max:.0} ms",
                fresh.len()
            );
        }
        // Touches that lay there before have no latency that means something.
        if let Some([median, p95, _]) = spread(backlog.iter().map(|l| l.work)) {
            text += &format!(
                "\nwork on {} touches that lay there: median {median:.0} ms, p95 {p95:.0} ms each",
                backlog.len()
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn percentiles_are_times_that_were_measured() {
        assert_eq!(spread(std::iter::empty()), None);
        assert_eq!(spread([7.0].into_iter()), Some([7.0; 3]));
        assert_eq!(spread((1..=100).rev().map(f64::from)), Some([50.0, 95.0, 100.0]));
        assert_eq!(spread((1..=20).map(f64::from)), Some([10.0, 19.0, 20.0]));
    }
}
