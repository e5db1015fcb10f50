//! One touch: prediction, masks, pose, files.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use serde_json::Value;

use super::super::output::says;
use super::super::predict::Predictor;
use super::done::{Done, PoseMetrics, figures};
use super::summary::Latency;
use super::{Source, WatchArgs, recipe, write};
use touch2touch_core::align::Ask;
use touch2touch_core::pose::{RegistrationChoice, ToolModel};
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;
use touch2touch_work::compare;
use touch2touch_work::io::dataset::{Dataset, read_in_meters};
use touch2touch_work::io::follow::Ready;
use touch2touch_work::job::{Cancel, JobCx};
use touch2touch_work::labels::{ImprintSource, PairLabels};
use touch2touch_work::mask::{Contact, MaskInputs};
use touch2touch_work::pose;
use touch2touch_work::prediction::Prediction;
use touch2touch_work::tool::{load_tool, named_tool};

/// The models, loaded once, and the tools met so far.
pub(super) struct Worker<'a> {
    args: &'a WatchArgs,
    predictor: Predictor,
    engine: RegistrationChoice,
    tools: BTreeMap<String, ToolModel>,
    stop: Cancel,
    /// Seconds that loading and the first run took.
    pub warm_s: f64,
}

impl<'a> Worker<'a> {
    /// Loads the models and runs them once, so that the first touch does not wait for memory and kernels.
    pub(super) fn new(args: &'a WatchArgs, mut predictor: Predictor, stop: Cancel) -> anyhow::Result<Self> {
        let engine = match args.engine.0.as_slice() {
            [engine] => *engine,
            _ => anyhow::bail!("--engine all is for `touch2touch pose`; one registration is needed here"),
        };
        let start = Instant::now();
        predictor.warm_up(&args.mask.choice())?;
        let warm_s = start.elapsed().as_secs_f64();
        Ok(Self { args, predictor, engine, tools: BTreeMap::new(), stop, warm_s })
    }

    /// After a bug: the models are loaded anew for the next touch.
    pub(super) fn recover(&mut self) {
        self.predictor.recover();
    }

    /// The tool of a touch: what the command line says, else what the file's name says.
    pub(super) fn tool_name(&self, of_pair: Option<String>) -> Option<String> {
        self.args.tool.clone().or(of_pair)
    }

    /// Everything the result depends on besides the touch.
    pub(super) fn recipe(&mut self, tool: Option<&str>, labels: &PairLabels) -> anyhow::Result<Value> {
        recipe::recipe(self.args, &mut self.predictor, self.engine, tool, labels)
    }

    /// The CAD model of a tool, from memory; one that was not there is looked for again.
    fn tool(&mut self, dataset: &Dataset, name: &str) -> Result<&ToolModel, String> {
        if !self.tools.contains_key(name) {
            let model = tool_model(dataset, name, self.args).map_err(|err| says(&err))?;
            self.tools.insert(name.to_owned(), model);
        }
        self.tools.get(name).ok_or_else(|| format!("no CAD model of {name}"))
    }

    /// Predicts, poses and writes. `None` if the run was told to stop meanwhile.
    #[allow(clippy::too_many_arguments, reason = "one call site, and each is a part of the question")]
    pub(super) fn work(
        &mut self,
        dataset: &Dataset,
        sample: &Sample,
        tool: Option<&str>,
        labels: &PairLabels,
        stem: &Path,
        source: &Source,
        recipe: &Value,
        (ready, found, start): (&Ready, SystemTime, Instant),
    ) -> anyhow::Result<Option<Done>> {
        let since = |earlier: SystemTime, later: SystemTime| {
            later.duration_since(earlier).map_or(0.0, |d| d.as_secs_f64() * 1e3)
        };
        let ms = |from: Instant| from.elapsed().as_secs_f64() * 1e3;
        let mut latency = Latency { found: since(ready.stamp.closed, found), load: ms(start), ..Latency::default() };

        let step = Instant::now();
        let Some(drawn) = self.predictions(sample)? else { return Ok(None) };
        let imprints = self.predictor.in_meters(sample, &drawn)?;
        latency.generate = ms(step);
        let step = Instant::now();
        let of = self.predictor.of(ImprintSource::Predicted)?;
        let inputs = MaskInputs { sample, tool: None, labels: self.args.mask.drawn(labels), of: Some(&of) };
        let contact = self.predictor.contact(&self.args.mask, imprints, inputs)?;
        latency.mask = ms(step);
        let step = Instant::now();
        let (pose, no_pose) = match self.pose(dataset, sample, tool, &contact) {
            Ok(pose) => (Some(pose), None),
            Err(why) => (None, Some(why)),
        };
        latency.pose = ms(step);

        let step = Instant::now();
        let files = write::predictions(stem, &sample.rig, &contact, &self.args.save)?;
        latency.write = ms(step);
        latency.total = since(ready.stamp.closed, SystemTime::now());
        let tile = compare::tile_of(dataset, ready.id, sample)?;
        let shift = self.predictor.shift();
        let drawn = |pad: PadId| Some((drawn[pad].as_ref()?, shift));
        let mut done = Done {
            name: ready.name.clone(),
            source: source.clone(),
            recipe: recipe.clone(),
            files,
            notes: sample.notes.iter().cloned().chain(self.predictor.misgiving(sample)?).collect(),
            scale: sample.scale.key(),
            mask_notes: contact.notes(&sample.rig),
            fingers: sample
                .rig
                .pads()
                .filter_map(|pad| figures(sample, pad, &contact, drawn(pad), tile.as_ref()))
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

    /// Predictions of the fingers that have a GelSlim image; `None` if told to stop.
    fn predictions(&mut self, sample: &Sample) -> anyhow::Result<Option<PerPad<Prediction>>> {
        let cx = JobCx::new(self.stop.clone(), Arc::new(|_| {}));
        match self.predictor.predictions(sample, &cx) {
            Err(_) if self.stop.is_cancelled() => Ok(None),
            Ok(made) if made.is_empty() => Err(self.predictor.no_condition()),
            made => made.map(Some),
        }
    }

    /// The pose, or why there is none.
    fn pose(
        &mut self,
        dataset: &Dataset,
        sample: &Sample,
        tool: Option<&str>,
        contact: &Contact,
    ) -> Result<PoseMetrics, String> {
        let name = tool.ok_or("the file's name says no tool; name it with --tool")?;
        if sample.pads.iter().flatten().all(|touch| touch.camera().is_none()) {
            return Err("no bubble camera is known; name a bubble file of the rig with --camera".into());
        }
        let points = contact.points(sample).map_err(|err| err.why)?;
        let registration = self.engine.method();
        let model = self.tool(dataset, name)?;
        let found = pose::pose(&points, model, &*registration, Ask::default(), sample.grasp_from_object);
        let found = found.map_err(|err| err.why)?;
        let place = found.object_from_grasp();
        Ok(PoseMetrics {
            tool: name.to_owned(),
            angle_deg: found.angle_rad.to_degrees(),
            y_m: place.y_m,
            z_m: place.z_m,
            grasp_from_object: found.grasp_from_object,
            rms_m: found.rms_m,
            points: found.num_points,
            stop: found.stop,
            truth_deg: found.truth_rad.map(f64::to_degrees),
            error_deg: found.error_rad.map(f64::to_degrees),
        })
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
    let (model, _) = load_tool(if has_it { dataset } else { &demo }, name)
        .map_err(|err| anyhow::anyhow!("{err} Or name a file with --tool."))?;
    Ok(model)
}
