//! One touch: prediction, masks, pose, files.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use serde_json::Value;

use super::super::output::says;
use super::super::recipe::{misgiving, warm_up};
use super::done::{Done, PoseMetrics, figures};
use super::summary::Latency;
use super::{Source, WatchArgs, recipe, write};
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::{PadId, Rig};
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::compare;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::dataset::{Dataset, read_in_meters};
use touch2touch_pipeline::io::follow::Ready;
use touch2touch_pipeline::job::{Cancel, JobCx};
use touch2touch_pipeline::labels::{ImprintSource, PairLabels};
use touch2touch_pipeline::steps::estimate::{Touch, estimate};
use touch2touch_pipeline::steps::models::Models;
use touch2touch_pipeline::steps::pose::PoseResult;
use touch2touch_pipeline::steps::recipe::{Recipe, Stage};
use touch2touch_pipeline::steps::tool::{load_tool, named_tool};

/// The tool of a touch.
pub(super) struct HeldTool {
    pub(super) name: String,
    pub(super) model: Arc<ToolModel>,
}

/// A touch that arrived, with what its result is called and depends on.
#[derive(Clone, Copy)]
pub(super) struct Arrived<'a> {
    pub(super) ready: &'a Ready,
    /// The name of its tool, where it has a CAD model.
    pub(super) tool: Option<&'a str>,
    /// When it was found whole.
    pub(super) found: SystemTime,
    /// When its reading began, and ended.
    pub(super) start: Instant,
    pub(super) read: Instant,
    /// Path of its results, without an ending.
    pub(super) stem: &'a Path,
    pub(super) source: &'a Source,
    pub(super) recipe: &'a Value,
}

/// The models, loaded once, and the tools met so far.
pub(super) struct Worker<'a> {
    args: &'a WatchArgs,
    recipe: Recipe,
    models: Models,
    tools: BTreeMap<String, Arc<ToolModel>>,
    stop: Cancel,
    /// Seconds that loading and the first run took.
    pub warm_s: f64,
}

impl<'a> Worker<'a> {
    /// Loads the models and runs them once, so that the first touch does not wait for memory and kernels.
    pub(super) fn new(args: &'a WatchArgs, rig: &Rig, stop: Cancel) -> anyhow::Result<Self> {
        let registration = match args.registration.0.as_slice() {
            [registration] => *registration,
            _ => anyhow::bail!("--engine all is for `touch2touch pose`; one registration is needed here"),
        };
        let recipe = args.model.posed(ImprintSource::Predicted, rig, &args.mask, registration)?;
        let (models, start) = (args.model.models(), Instant::now());
        warm_up(&recipe, &models)?;
        let warm_s = start.elapsed().as_secs_f64();
        Ok(Self { args, recipe, models, tools: BTreeMap::new(), stop, warm_s })
    }

    /// After a bug: the models are loaded anew for the next touch.
    pub(super) fn recover(&self) {
        self.models.forget();
    }

    /// The tool of a touch: what the command line says, else what the file's name says.
    pub(super) fn tool_name(&self, of_pair: Option<String>) -> Option<String> {
        self.args.tool.clone().or(of_pair)
    }

    /// Everything the result depends on besides the touch.
    pub(super) fn recipe(&self, tool: Option<&str>, labels: &PairLabels) -> anyhow::Result<Value> {
        recipe::told(self.args, &self.recipe, tool, labels)
    }

    /// Predicts, poses and writes. `None` if the run was told to stop meanwhile.
    pub(super) fn work(&self, touch: Touch<'_>, arrived: Arrived<'_>) -> anyhow::Result<Option<Done>> {
        let Arrived { ready, tool, found, start, read, stem, source, recipe } = arrived;
        let sample = touch.sample;
        let since = |earlier: SystemTime, later: SystemTime| {
            later.duration_since(earlier).map_or(0.0, |d| d.as_secs_f64() * 1e3)
        };
        let ms = |from: Instant| from.elapsed().as_secs_f64() * 1e3;
        let load = (read - start).as_secs_f64() * 1e3;
        let mut latency = Latency { found: since(ready.stamp.closed, found), load, ..Latency::default() };

        let cx = JobCx::new(self.stop.clone(), Arc::new(|_| {}));
        let estimate = match estimate(touch, &self.recipe, Stage::Imprint, &self.models, &cx) {
            Err(_) if self.stop.is_cancelled() => return Ok(None),
            Ok(estimate) if estimate.predictions.is_empty() => {
                return Err(self.recipe.generating()?.no_input(&sample.rig).into());
            }
            estimate => estimate?,
        };
        latency.generate = ms(read);
        let step = Instant::now();
        let estimate = estimate.reach(touch, Stage::Mask, &self.models, &cx)?;
        latency.mask = ms(step);
        let step = Instant::now();
        let estimate = estimate.reach(touch, Stage::Pose, &self.models, &cx)?;
        // Without a tool, that is the reason, whatever else is missing.
        let (pose, no_pose) = match (tool, touch.tool.and(estimate.pose())) {
            (Some(name), Ok(found)) => (Some(PoseMetrics::new(name, found)), None),
            (_, Err(err)) => (None, Some(err.why.clone())),
            (None, Ok(_)) => (None, None),
        };
        let (contact, shift) = (estimate.contact(), self.recipe.shift);
        latency.pose = ms(step);

        let step = Instant::now();
        let files = write::predictions(stem, &sample.rig, contact, &self.args.save)?;
        latency.write = ms(step);
        latency.total = since(ready.stamp.closed, SystemTime::now());
        let tile = compare::tile_of(touch.dataset, touch.pair, sample)?;
        let drawn = |pad: PadId| Some((estimate.predictions[pad].as_ref()?, shift));
        let mut done = Done {
            name: ready.name.clone(),
            source: source.clone(),
            recipe: recipe.clone(),
            files,
            notes: sample.notes.iter().cloned().chain(misgiving(&self.recipe, sample)).collect(),
            scale: sample.scale.key(),
            mask_notes: contact.notes(&sample.rig),
            fingers: sample
                .rig
                .pads()
                .filter_map(|pad| figures(sample, pad, contact, drawn(pad), tile.as_ref()))
                .collect(),
            pose,
            no_pose,
            latency,
            error: None,
            fresh: ready.fresh,
        };
        write::result(stem, &done)?;
        done.latency.write = ms(step);
        done.latency.total = since(ready.stamp.closed, SystemTime::now());
        Ok(Some(done))
    }

    /// The name and the CAD model of a touch's tool, or why it has no pose.
    pub(super) fn tool_of(
        &mut self,
        dataset: &Dataset,
        sample: &Sample,
        name: Option<&str>,
    ) -> Result<HeldTool, TaskError> {
        let fail = |why: String| TaskError::new("Pose", why);
        let name = name.ok_or_else(|| fail("the file's name says no tool; name it with --tool".into()))?;
        if sample.pads.iter().flatten().all(|touch| touch.camera().is_none()) {
            return Err(fail("no bubble camera is known; name a bubble file of the rig with --camera".into()));
        }
        if !self.tools.contains_key(name) {
            let model = tool_model(dataset, name, self.args).map_err(|err| fail(says(&err)))?;
            self.tools.insert(name.to_owned(), Arc::new(model));
        }
        let model = self.tools.get(name).ok_or_else(|| fail(format!("no CAD model of {name}")))?;
        Ok(HeldTool { name: name.to_owned(), model: model.clone() })
    }
}

impl PoseMetrics {
    fn new(tool: &str, found: &PoseResult) -> Self {
        let place = found.object_from_grasp();
        Self {
            tool: tool.to_owned(),
            angle_deg: found.angle_rad.to_degrees(),
            y_m: place.y_m,
            z_m: place.z_m,
            grasp_from_object: found.grasp_from_object,
            angle_sd_deg: found.angle_sd_rad().map(f64::to_degrees),
            covariance: found.report.evidence.map(|evidence| evidence.uncertainty.covariance),
            verdict: found.verdict.clone(),
            rms_m: found.rms_m,
            points: found.num_points,
            stop: found.stop.clone(),
            truth_deg: found.truth_rad.map(f64::to_degrees),
            error_deg: found.error_rad.map(f64::to_degrees),
        }
    }
}

/// The CAD model of a tool: a file, one of the data set's, or one of the demo's.
fn tool_model(dataset: &Dataset, name: &str, args: &WatchArgs) -> anyhow::Result<ToolModel> {
    if Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("stl")) {
        let mesh = read_in_meters(Path::new(name), args.unit.tool_scale);
        let mesh = mesh.map_err(|err| anyhow::anyhow!("{err}: {}", err.hint()))?;
        return Ok(named_tool(name, mesh)?.model);
    }
    let demo = Dataset::demo();
    let has_it = dataset.tool_mesh_file(name).is_some() || demo.tool_mesh(name).ok().flatten().is_none();
    let loaded = load_tool(if has_it { dataset } else { &demo }, name)
        .map_err(|err| anyhow::anyhow!("{err} Or name a file with --tool."))?;
    Ok(loaded.model)
}
