//! One touch: prediction, masks, pose, files, and the result as it is written and said.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::Path;
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use serde::Serialize;
use serde_json::{Value, json};

use super::super::output::says;
use super::super::pose::AnswerRow;
use super::super::recipe::{misgiving, warm_up};
use super::{Latency, WatchArgs, files};
use touch2touch_core::contact::ContactMask;
use touch2touch_core::dataset::Problem;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::pose::ToolModel;
use touch2touch_core::postprocess::{ShiftMode, Stats};
use touch2touch_core::rig::{PadId, Rig};
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::compare;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::follow::Ready;
use touch2touch_pipeline::infer::engine::resolve;
use touch2touch_pipeline::io::dataset::{Dataset, read_in_meters};
use touch2touch_pipeline::job::{Cancel, JobCx};
use touch2touch_pipeline::labels::{ImprintSource, PairLabels};
use touch2touch_pipeline::steps::estimate::{Touch, estimate};
use touch2touch_pipeline::steps::mask::Contact;
use touch2touch_pipeline::steps::models::Models;
use touch2touch_pipeline::steps::pose::PoseResult;
use touch2touch_pipeline::steps::prediction::Prediction;
use touch2touch_pipeline::steps::recipe::{Recipe, Stage};
use touch2touch_pipeline::steps::tool::{load_tool, tool_of};

/// A touch that arrived, with what its result is called and depends on.
#[derive(Clone, Copy)]
pub(super) struct Arrived<'a> {
    pub(super) ready: &'a Ready,
    /// The name of its tool, where it has a CAD model.
    pub(super) tool: Option<&'a str>,
    /// When it was found whole: the time of day, and the clock's.
    pub(super) begun: (SystemTime, Instant),
    /// Path of its results, without an ending.
    pub(super) stem: &'a Path,
    pub(super) source: &'a Value,
    pub(super) recipe: &'a Value,
}

/// The models, loaded once, and the tools met so far.
pub(super) struct Worker {
    recipe: Recipe,
    pub(super) models: Models,
    tools: BTreeMap<String, Arc<ToolModel>>,
    /// The pose of each tool at its last touch.
    last: BTreeMap<String, PlanarPose>,
    stop: Cancel,
    /// Seconds that loading and the first run took.
    pub warm_s: f64,
}

impl Worker {
    /// Loads the models and runs them once, so that the first touch does not wait for memory and kernels.
    pub(super) fn new(args: &WatchArgs, rig: &Rig, stop: Cancel) -> anyhow::Result<Self> {
        let recipe = args.recipe.of(ImprintSource::Predicted, rig)?;
        let (models, start) = (args.recipe.model.models(), Instant::now());
        warm_up(&recipe, &models)?;
        let warm_s = start.elapsed().as_secs_f64();
        Ok(Self { recipe, models, tools: BTreeMap::new(), last: BTreeMap::new(), stop, warm_s })
    }

    /// Everything the result depends on besides the touch.
    pub(super) fn recipe(&self, tool: Option<&str>, labels: &PairLabels) -> anyhow::Result<Value> {
        let generating = self.recipe.generating()?;
        let (recipe, masks) = (&self.recipe, labels.masks.iter().filter(|_| self.recipe.hand));
        let drawn: Vec<(String, String)> =
            masks.map(|(place, hand)| (format!("{place:?}"), digest(&hand.mask))).collect();
        Ok(json!({
            "id": recipe.id(Stage::Pose), "bundle": generating.bundle.name, "config": generating.config,
            "runtime": resolve(recipe.engine)?, "drawn": drawn, "tool": tool, "version": env!("CARGO_PKG_VERSION"),
        }))
    }

    /// Predicts, poses and writes. `None` if the run was told to stop meanwhile.
    pub(super) fn work(&mut self, touch: Touch<'_>, arrived: Arrived<'_>) -> anyhow::Result<Option<Done>> {
        let Arrived { ready, tool, begun: (found, start), stem, source, recipe } = arrived;
        let sample = touch.sample;
        let ms = || start.elapsed().as_secs_f64() * 1e3;
        let waited = found.duration_since(ready.stamp.closed).map_or(0.0, |waited| waited.as_secs_f64() * 1e3);
        let cx = JobCx::new(self.stop.clone(), Arc::new(|_| {}));
        let estimate = match estimate(touch, &self.recipe, Stage::Imprint, &self.models, &cx) {
            Err(_) if self.stop.is_cancelled() => return Ok(None),
            Ok(estimate) if estimate.predictions.is_empty() => {
                return Err(self.recipe.generating()?.no_input(&sample.rig).into());
            }
            estimate => estimate?,
        };
        let generate = ms();
        let estimate = estimate.reach(touch, Stage::Pose, &self.models, &cx)?;
        // Without a tool, that is the reason, whatever else is missing.
        let (pose, no_pose, said) = match (tool, touch.tool.and(estimate.pose())) {
            (Some(name), Ok(found)) => {
                // Of equal answers the one of the touch before: what is followed does not turn over.
                let last = self.last.entry(name.to_owned()).or_insert(found.grasp_from_object);
                let found = &found.clone().kept_to(*last);
                *last = found.grasp_from_object;
                let PlanarPose { y_m, z_m, .. } = found.object_from_grasp();
                let (angle, y, z) = (found.angle_rad.to_degrees(), y_m * 1e3, z_m * 1e3);
                (Some(posed(name, found)), None, format!("{angle:.1} deg, y {y:.2} mm, z {z:.2} mm"))
            }
            (_, Err(err)) => (None, Some(err.why.clone()), format!("no pose: {}", err.why)),
            (None, Ok(_)) => (None, None, "no pose".to_owned()),
        };
        let (contact, shift) = (estimate.contact(), self.recipe.shift);
        let files = files::predictions(stem, &sample.rig, contact)?;
        let tile = compare::tile_of(touch.dataset, touch.pair, sample)?;
        let drawn = |pad: PadId| Some((estimate.predictions[pad].as_ref()?, shift));
        let latency = || Latency { generate, work: ms(), total: waited + ms() };
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
            said,
            latency: latency(),
            error: None,
            fresh: ready.fresh,
        };
        files::result(stem, &done)?;
        done.latency = latency();
        Ok(Some(done))
    }

    /// The name and the CAD model of a touch's tool, or why it has no pose.
    pub(super) fn tool_of(
        &mut self,
        dataset: &Dataset,
        sample: &Sample,
        name: Option<&str>,
    ) -> Result<(String, Arc<ToolModel>), TaskError> {
        let fail = |why: String| TaskError::new("Pose", why);
        let name = name.ok_or_else(|| fail("the file's name says no tool; name it with --tool".into()))?;
        if sample.pads.iter().flatten().all(|touch| touch.camera().is_none()) {
            return Err(fail(
                "no bubble camera is known; put a bubble file of the rig into the folder as rig.pt".into(),
            ));
        }
        let model = match self.tools.get(name) {
            Some(model) => model.clone(),
            None => {
                let model = Arc::new(tool_model(dataset, name).map_err(|err| fail(says(&err)))?);
                self.tools.insert(name.to_owned(), model.clone());
                model
            }
        };
        Ok((name.to_owned(), model))
    }
}

/// Tells one drawn mask from another.
fn digest(mask: &Mask) -> String {
    let mut hasher = DefaultHasher::new();
    (mask.size(), mask.as_slice()).hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}

/// A result, as it is written and said.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Done {
    pub(super) name: String,
    pub(super) source: Value,
    pub(super) recipe: Value,
    pub(super) files: Vec<String>,
    /// Oddities of the touch's files.
    pub(super) notes: Vec<Problem>,
    pub(super) scale: &'static str,
    /// Metrics of each finger's prediction, against the measurement where there is one.
    pub(super) fingers: Vec<Value>,
    /// Why masks are not made of the source that was asked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) mask_notes: Vec<String>,
    pub(super) pose: Option<Value>,
    /// Why there is no pose.
    pub(super) no_pose: Option<String>,
    /// Up to the writing of this very file; the event and the summary include it.
    pub(super) latency: Latency,
    pub(super) error: Option<String>,
    #[serde(skip)]
    pub(super) fresh: bool,
    /// The pose for people.
    #[serde(skip)]
    pub(super) said: String,
}

impl Done {
    pub(super) fn text(&self) -> String {
        let Latency { generate, total, .. } = self.latency;
        let when =
            if self.fresh { format!("{total:.0} ms after it was closed") } else { "was already there".to_owned() };
        format!("{}: {} ({when}; generator {generate:.0} ms)", self.name, self.said)
    }
}

/// Numbers of one prediction, against the measurement where there is one.
fn figures(
    sample: &Sample,
    pad: PadId,
    contact: &Contact,
    drawn: Option<(&Prediction, ShiftMode)>,
    tile: Option<&DepthMap>,
) -> Option<Value> {
    let imprint = contact.imprints[pad].as_ref()?;
    let stats = Stats::of(imprint);
    let compared = compare::of_pad(imprint, drawn, sample, pad, tile).ok().flatten();
    let mask = contact.masks[pad].as_ref();
    let count = |found: &ContactMask| found.mask.as_slice().iter().filter(|&&m| m).count();
    // The basis of the mask: the source's key, `depth` where the mask model found nothing, `flat` without contact.
    let source = contact.source().key();
    Some(json!({
        "finger": sample.rig.pad_key(pad), "min_m": stats.min, "max_m": stats.max, "mean_m": stats.mean,
        "contact_px": mask.map(count), "mask": mask.map_or(source, |found| found.basis.key(source)),
        "psnr_db": compared.as_ref().and_then(|c| c.psnr_db), "ssim": compared.as_ref().and_then(|c| c.ssim),
    }))
}

/// A pose, in the lab's sense of the angle; the covariance is that of `grasp_from_object`: radians and meters.
fn posed(tool: &str, found: &PoseResult) -> Value {
    let place = found.object_from_grasp();
    json!({
        "tool": tool, "angle_deg": found.angle_rad.to_degrees(), "y_m": place.y_m, "z_m": place.z_m,
        "grasp_from_object": found.grasp_from_object, "angle_sd_deg": found.angle_sd_rad().map(f64::to_degrees),
        "covariance": found.report.evidence.map(|evidence| evidence.uncertainty.covariance),
        "verdict": found.verdict, "answers": found.report.answers.iter().map(AnswerRow::new).collect::<Vec<_>>(),
        "rms_m": found.rms_m, "points": found.num_points, "stop": found.stop,
        "truth_deg": found.truth_rad.map(f64::to_degrees), "error_deg": found.error_rad.map(f64::to_degrees),
    })
}

/// The CAD model of a tool: a file, one of the data set's, or one of the demo's.
fn tool_model(dataset: &Dataset, name: &str) -> anyhow::Result<ToolModel> {
    if Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("stl")) {
        let mesh = read_in_meters(Path::new(name), None);
        let mesh = mesh.map_err(|err| anyhow::anyhow!("{err}: {}", err.hint))?;
        return Ok(tool_of(name, mesh)?);
    }
    let demo = Dataset::demo();
    let has_it = dataset.tool_mesh_file(name).is_some() || demo.tool_mesh(name).ok().flatten().is_none();
    let loaded = load_tool(if has_it { dataset } else { &demo }, name)
        .map_err(|err| anyhow::anyhow!("{err} Or name a file with --tool."))?;
    Ok(loaded.model)
}
