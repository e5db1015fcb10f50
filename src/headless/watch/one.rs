//! One touch: prediction, masks, pose, files.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use serde::Serialize;
use serde_json::{Value, json};

use super::super::contact_mask::MaskFrom;
use super::super::output::says;
use super::super::predict::Predictor;
use super::summary::Latency;
use super::write::{self, FingerResult};
use super::{Source, WatchArgs};
use crate::domain::contact::MaskBasis;
use crate::domain::dataset::Problem;
use crate::domain::frames::PlanarPose;
use crate::domain::grid::{Grid, RgbGrid};
use crate::domain::pose::{Engine, FingerInput, Fingers, ToolModel, estimate};
use crate::domain::rig::Text;
use crate::domain::sample::Sample;
use crate::domain::units::angle_error;
use crate::infer::engine::resolve;
use crate::io::dataset::{Dataset, read_in_meters};
use crate::io::follow::Ready;
use crate::work::imprint::imprint_of;
use crate::work::job::{Cancel, JobCx};
use crate::work::mask::MaskRecipe;
use crate::work::{compare, mask};

/// The models, loaded once, and the tools met so far.
pub(super) struct Worker<'a> {
    args: &'a WatchArgs,
    predictor: Predictor,
    engine: Engine,
    tools: BTreeMap<String, ToolModel>,
    stop: Cancel,
    /// Seconds that loading and the first run took.
    pub warm_s: f64,
}

/// Figures of one finger.
#[derive(Debug, Clone, Serialize)]
pub(super) struct FingerFigures {
    finger: Text,
    min_m: f64,
    max_m: f64,
    mean_m: f64,
    contact_px: Option<usize>,
    /// What the mask is made of: the source's key, `depth` where the mask model found nothing, `flat` where there is no
    /// contact.
    mask: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    psnr_db: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ssim: Option<f64>,
}

/// A pose, in the lab's sense of the angle.
#[derive(Debug, Clone, Serialize)]
pub(super) struct PoseFigures {
    tool: String,
    angle_deg: f64,
    y_m: f64,
    z_m: f64,
    grasp_from_object: PlanarPose,
    rms_m: f64,
    points: usize,
    stop: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    truth_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error_deg: Option<f64>,
}

/// A result, as it is written and said.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Done {
    pub name: String,
    source: Source,
    recipe: Value,
    files: Vec<String>,
    /// What is odd about the touch's files.
    pub notes: Vec<Problem>,
    scale: &'static str,
    fingers: Vec<FingerFigures>,
    /// Why masks are not made of the source that was asked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mask_notes: Vec<String>,
    pose: Option<PoseFigures>,
    /// Why there is no pose.
    no_pose: Option<String>,
    /// Up to the writing of this very file; the event and the summary include it.
    pub latency: Latency,
    error: Option<String>,
    #[serde(skip)]
    pub fresh: bool,
}

impl Done {
    pub(super) fn text(&self) -> String {
        let pose = match (&self.pose, &self.no_pose) {
            (Some(p), _) => format!("{:.1} deg, y {:.2} mm, z {:.2} mm", p.angle_deg, p.y_m * 1e3, p.z_m * 1e3),
            (None, Some(why)) => format!("no pose: {why}"),
            (None, None) => "no pose".to_owned(),
        };
        let l = &self.latency;
        let when = if self.fresh { format!("{:.0} ms after it was closed", l.total) } else { "lay there".to_owned() };
        format!("{}: {pose} ({when}; generator {:.0} ms)", self.name, l.generate)
    }
}

impl<'a> Worker<'a> {
    /// Loads the models and runs them once, so that the first touch does not wait for memory and kernels.
    pub(super) fn new(args: &'a WatchArgs, mut predictor: Predictor, stop: Cancel) -> anyhow::Result<Self> {
        let engine = match args.engine.0.as_slice() {
            [engine] => *engine,
            _ => anyhow::bail!("--engine all is for `touch2touch pose`; one registration is needed here"),
        };
        let start = Instant::now();
        predictor.warm_up(matches!(args.mask.mask, MaskFrom::Unet | MaskFrom::Auto))?;
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
    pub(super) fn recipe(&mut self, tool: Option<&str>) -> anyhow::Result<Value> {
        let config = self.predictor.config()?;
        let shift = self.predictor.shift();
        let engine = resolve(self.predictor.engine())?;
        let bundle = self.predictor.bundle()?;
        let mask = match self.args.mask.mask {
            MaskFrom::Threshold => json!({"threshold_mm": self.args.mask.threshold_mm}),
            _ => json!("unet"),
        };
        Ok(json!({
            "bundle": bundle.name, "bundle_hash": *bundle.id, "runtime": engine,
            "sampler": config.sampler, "steps": config.steps, "seed": config.seed, "eta": config.eta,
            "spacing": config.spacing, "guidance": config.guidance, "shift": shift, "mask": mask, "registration": self.engine, "tool": tool,
            "camera": self.args.camera, "version": env!("CARGO_PKG_VERSION"),
        }))
    }

    /// The CAD model of a tool, from memory; one that was not there is looked for again.
    fn tool(&mut self, dataset: &Dataset, name: &str) -> Result<&ToolModel, String> {
        if !self.tools.contains_key(name) {
            let model = load_tool(dataset, name, self.args).map_err(|err| says(&err))?;
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
        let Some(mut fingers) = self.imprints(sample)? else { return Ok(None) };
        latency.generate = ms(step);
        let step = Instant::now();
        for f in &mut fingers {
            let found = match self.args.mask.mask {
                MaskFrom::Threshold => {
                    let recipe = MaskRecipe::Threshold((self.args.mask.threshold_mm / 1e3).into());
                    mask::mask(&recipe, &f.imprint, None, None, None).map_err(|err| anyhow::anyhow!("{err}"))?
                }
                _ => self.predictor.mask(&f.imprint)?,
            };
            f.basis = found.basis;
            f.mask = Some(found.mask);
        }
        let source_key = match self.args.mask.mask {
            MaskFrom::Auto => MaskFrom::Unet.key(),
            asked => asked.key(),
        };
        latency.mask = ms(step);
        let step = Instant::now();
        let (pose, no_pose) = match self.pose(dataset, sample, tool, &fingers) {
            Ok(pose) => (Some(pose), None),
            Err(why) => (None, Some(why)),
        };
        latency.pose = ms(step);

        let step = Instant::now();
        let files = write::predictions(stem, &fingers, &self.args.save)?;
        latency.write = ms(step);
        latency.total = since(ready.stamp.closed, SystemTime::now());
        let mut done = Done {
            name: ready.name.clone(),
            source: source.clone(),
            recipe: recipe.clone(),
            files,
            notes: sample.notes.clone(),
            scale: sample.scale.key(),
            mask_notes: fingers
                .iter()
                .filter_map(|f| Some(format!("{} finger: {}", f.name, f.basis.note()?)))
                .collect(),
            fingers: fingers.iter().map(|f| figures(sample, f, source_key)).collect(),
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

    /// Imprints of the fingers that have a GelSlim image, in one batch; `None` if told to stop.
    fn imprints(&mut self, sample: &Sample) -> anyhow::Result<Option<Vec<FingerResult>>> {
        let touched = self.predictor.conditions(sample)?;
        if touched.is_empty() {
            return Err(self.predictor.no_condition());
        }
        let cx = JobCx::new(self.stop.clone(), Arc::new(|_| {}));
        let differences: Vec<&RgbGrid> = touched.iter().map(|(_, picture)| &**picture).collect();
        let made = match self.predictor.predict(&differences, &cx) {
            Err(_) if self.stop.is_cancelled() => return Ok(None),
            other => other?,
        };
        let shift = self.predictor.shift();
        let mut out = Vec::new();
        for ((finger, _), made) in touched.iter().zip(&made) {
            let imprint = imprint_of(made, shift, sample, *finger)?;
            let name = sample.rig.pad_key(*finger);
            out.push(FingerResult { finger: *finger, name, imprint, mask: None, basis: MaskBasis::Source });
        }
        Ok(Some(out))
    }

    /// The pose, or why there is none.
    fn pose(
        &mut self,
        dataset: &Dataset,
        sample: &Sample,
        tool: Option<&str>,
        fingers: &[FingerResult],
    ) -> Result<PoseFigures, String> {
        let engine = self.engine;
        let name = tool.ok_or("the file's name says no tool; name it with --tool")?;
        let inputs = Fingers::new(&sample.rig, |finger| {
            let f = fingers.iter().find(|f| f.finger == finger)?;
            let camera = sample.pad(finger)?.camera()?;
            Some(FingerInput { imprint: &f.imprint, camera, mask: f.mask.as_ref() })
        });
        if inputs.is_empty() {
            return Err("no bubble camera is known; name a bubble file of the rig with --camera".into());
        }
        let model = self.tool(dataset, name)?;
        let found = estimate(&inputs, model, engine, false).map_err(|err| err.to_string())?;
        let truth = sample.grasp_from_object.map(|p| p.inverse().theta_rad);
        let theta = found.object_from_grasp.theta_rad;
        Ok(PoseFigures {
            tool: name.to_owned(),
            angle_deg: theta.to_degrees(),
            y_m: found.object_from_grasp.y_m,
            z_m: found.object_from_grasp.z_m,
            grasp_from_object: found.grasp_from_object,
            rms_m: found.report.inlier_rms_m,
            points: found.cloud.points.len(),
            stop: found.report.stop.to_string(),
            truth_deg: truth.map(f64::to_degrees),
            error_deg: truth.map(|t| angle_error(theta, t).to_degrees()),
        })
    }
}

/// The CAD model of a tool: a file, one of the dataset's, or one of the demo's.
fn load_tool(dataset: &Dataset, name: &str, args: &WatchArgs) -> anyhow::Result<ToolModel> {
    let mesh = if Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("stl")) {
        Some(
            read_in_meters(Path::new(name), args.unit.tool_scale)
                .map_err(|err| anyhow::anyhow!("{err}: {}", err.hint()))?,
        )
    } else {
        match dataset.tool_mesh(name).map_err(|err| anyhow::anyhow!("{err}: {}", err.hint()))? {
            Some(mesh) => Some(mesh),
            None => Dataset::demo().tool_mesh(name).ok().flatten(),
        }
    };
    let mesh = mesh.ok_or_else(|| {
        anyhow::anyhow!("no CAD model of {name}: put {name}.stl into tools_stls, or name a file with --tool")
    })?;
    Ok(ToolModel::new(mesh)?)
}

/// Numbers of one prediction, against the measurement where there is one.
fn figures(sample: &Sample, result: &FingerResult, source: &'static str) -> FingerFigures {
    let stats = crate::domain::postprocess::Stats::of(&result.imprint);
    let measured = sample.pad(result.finger).and_then(|t| t.depth()).map(|b| &b.imprint);
    let measured = measured.filter(|m| m.size() == result.imprint.size());
    let compared = measured.and_then(|m| compare::compare(&result.imprint, m, sample.scale).ok());
    let count = |mask: &Grid<bool>| mask.as_slice().iter().filter(|&&m| m).count();
    FingerFigures {
        finger: sample.rig.pad_key(result.finger),
        min_m: stats.min,
        max_m: stats.max,
        mean_m: stats.mean,
        contact_px: result.mask.as_ref().map(count),
        mask: result.basis.key(source),
        psnr_db: compared.as_ref().and_then(|c| c.psnr_db),
        ssim: compared.as_ref().and_then(|c| c.ssim),
    }
}
