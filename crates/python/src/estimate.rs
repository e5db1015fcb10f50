//! From a touch to its pose, and from points to a pose.

use std::borrow::Cow;
use std::sync::Arc;

use glam::DVec3;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use rayon::prelude::*;
use touch2touch_core::align::{Ask, Contacts};
use touch2touch_core::pose::Registration;
use touch2touch_core::rig::PadId;
use touch2touch_core::verdict::Grade;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::steps::estimate::{self as way, Estimate as Results};
use touch2touch_pipeline::steps::pose::{PoseResult, pose};
use touch2touch_pipeline::steps::recipe::{Recipe as Whole, Stage};

use crate::arrays::{Array, array, points as points_array, points_of, stack, transform};
use crate::data::Pair;
use crate::picture;
use crate::process::{Process, failed, refused, watched};
use crate::recipe::{self, Recipe, given_or};
use crate::tool::Tool;

/// Pose of a tool in the hand, with how sure it is and whether to rely on it.
#[pyclass(module = "touch2touch", frozen)]
pub(crate) struct Pose {
    result: PoseResult,
}

#[pymethods]
impl Pose {
    /// `grasp_from_object` (4, 4) float64, meters: maps a point of the CAD model to the grasp frame.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Array<'py, f64>> {
        transform(py, &self.result.grasp_from_cad())
    }

    /// In-hand angle as the lab reports it (of `object_from_grasp`), radians.
    #[getter]
    fn angle(&self) -> f64 {
        self.result.angle_rad
    }

    /// Place of the object's origin in the grasp frame (y, z), meters.
    #[getter]
    fn place(&self) -> (f64, f64) {
        (self.result.grasp_from_object.y_m, self.result.grasp_from_object.z_m)
    }

    /// Standard deviations of angle (radians), y and z (meters): (3,) float64; `None` without evidence.
    #[getter]
    fn sigma<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f64>>> {
        let Some(evidence) = self.result.report.evidence.as_ref() else { return Ok(None) };
        let covariance = evidence.uncertainty.covariance;
        array(py, (0..3).map(|i| covariance[i][i].sqrt()).collect(), &[3]).map(Some)
    }

    /// Covariance of angle (radians), y and z (meters) of `grasp_from_object`: (3, 3) float64; `None` without evidence.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f64>>> {
        let evidence = self.result.report.evidence.as_ref();
        let covariance = evidence.map(|evidence| evidence.uncertainty.covariance.concat());
        covariance.map(|covariance| array(py, covariance, &[3, 3])).transpose()
    }

    /// Reliance that it deserves, without the truth: "good", "check" or "wrong"; `None` without evidence.
    #[getter]
    fn verdict(&self) -> Option<String> {
        self.result.verdict.as_ref().map(|verdict| verdict.grade.to_string())
    }

    /// The verdict on the angle and on the place, each alone; their standard deviations are `sigma`.
    #[getter]
    fn grades(&self) -> Option<[String; 2]> {
        self.result.verdict.as_ref().map(|verdict| [verdict.angle, verdict.place].map(|part| part.grade.to_string()))
    }

    /// The reason of the verdict, in a sentence.
    #[getter]
    fn why(&self) -> Option<&str> {
        self.result.verdict.as_ref().map(|verdict| verdict.why.as_str())
    }

    /// Everything that speaks against it, the worst first.
    #[getter]
    fn against(&self) -> Vec<&str> {
        self.result.verdict.iter().flat_map(|verdict| &verdict.against).map(|sign| sign.what.as_str()).collect()
    }

    /// Size of the angle's error, radians, where the truth is known.
    #[getter]
    fn error(&self) -> Option<f64> {
        self.result.error_rad
    }

    /// Contact points that were registered.
    #[getter]
    fn num_points(&self) -> usize {
        self.result.num_points
    }

    /// Root mean square of the residuals, meters.
    #[getter]
    fn rms(&self) -> f64 {
        self.result.rms_m
    }

    /// Time of the registration, milliseconds.
    #[getter]
    fn ms(&self) -> f64 {
        self.result.ms
    }

    fn _repr_html_(&self) -> String {
        let color = match self.result.verdict.as_ref().map(|verdict| verdict.grade) {
            Some(Grade::Good) => "#2e7d32",
            Some(Grade::Check) => "#b26a00",
            Some(Grade::Wrong) => "#c62828",
            None => "#555",
        };
        let why = self.why().unwrap_or_default().replace('&', "&amp;").replace('<', "&lt;");
        format!(
            "<b>{}</b> <span style=\"color:{color}\">{}</span> {why}",
            self.result.angle_text(),
            self.verdict().unwrap_or_default()
        )
    }

    fn __repr__(&self) -> String {
        let (y, z) = self.place();
        let verdict = self.verdict().map_or(String::new(), |verdict| format!(", {verdict}"));
        let off = self.error().map_or(String::new(), |error| format!(", off by {:.1}°", error.to_degrees()));
        format!("Pose({}, y {:.1} mm, z {:.1} mm{verdict}{off})", self.result.angle_text(), 1e3 * y, 1e3 * z)
    }
}

/// Results of a touch, as far as they were asked for; what was not is `None`.
#[pyclass(module = "touch2touch", frozen)]
pub(crate) struct Estimate {
    results: Results,
    pair: Pair,
}

impl Estimate {
    fn of(results: Results, pair: &Pair) -> Self {
        Self { results, pair: pair.clone() }
    }

    fn pads(&self) -> impl Iterator<Item = PadId> {
        self.pair.sample.rig.pads()
    }
}

#[pymethods]
impl Estimate {
    /// The imprints, measured or predicted: (2, 140, 175) float32, meters, the camera's orientation.
    #[getter]
    fn imprint<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f32>>> {
        let of = &self.results.imprints;
        stack(py, self.pads().map(|pad| of.get(pad)), f32::NAN)
    }

    /// The contact masks: (2, 140, 175) bool.
    #[getter]
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, bool>>> {
        if !self.results.has(Stage::Mask) {
            return Ok(None);
        }
        let masks = &self.results.contact().masks;
        stack(py, self.pads().map(|pad| masks.get(pad).map(|found| &*found.mask)), false)
    }

    /// The contact points of both fingers: (N, 3) float64, meters, grasp frame; `None` where there are none.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Option<Array<'py, f64>>> {
        if !self.results.has(Stage::Cloud) {
            return Ok(None);
        }
        self.results.points().ok().map(|points| points_array(py, points)).transpose()
    }

    /// The pose; `None` where there is none, and `why_not` says why.
    #[getter]
    fn pose(&self) -> Option<Pose> {
        let found = self.results.has(Stage::Pose).then(|| self.results.pose().ok()).flatten();
        found.map(|result| Pose { result: result.clone() })
    }

    /// Why there is no pose, in words; `None` where there is one, or none was asked for.
    #[getter]
    fn why_not(&self) -> Option<String> {
        if !self.results.has(Stage::Pose) {
            return None;
        }
        self.results.pose().err().map(ToString::to_string)
    }

    /// The verdict on the pose: "good", "check" or "wrong"; `None` without a pose.
    #[getter]
    fn verdict(&self) -> Option<String> {
        self.pose().and_then(|pose| pose.verdict())
    }

    /// The pair that it is of.
    #[getter]
    fn pair(&self) -> Pair {
        self.pair.clone()
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let results = &slf.get().results;
        let imprints = results.imprints.entries().map(|(_, imprint)| imprint);
        let images = picture::imprints(slf.py(), imprints)?;
        let source = results.recipe().imprint.name();
        slf.py().import("touch2touch._scene")?.call_method1("estimate_html", (slf, source, images))
    }

    fn __repr__(&self) -> String {
        match (self.pose(), self.why_not()) {
            (Some(pose), _) => format!("Estimate({})", pose.__repr__()),
            (None, Some(why)) => format!("Estimate(no pose: {why})"),
            (None, None) if self.results.has(Stage::Mask) => "Estimate(up to the mask)".to_owned(),
            (None, None) => "Estimate(up to the imprint)".to_owned(),
        }
    }
}

fn estimated(
    pair: &Pair,
    tool: Option<&Arc<Tool>>,
    recipe: &Whole,
    stage: Stage,
    process: &Process,
    cx: &JobCx,
) -> Result<Results, TaskError> {
    let decides = recipe.until(stage);
    if decides.generator.is_some() || decides.mask_model.is_some() {
        process.run_models(recipe.engine)?;
    }
    pair.with_touch(tool, |touch| way::estimate(touch, recipe, stage, &process.models, cx))
}

/// The results of a touch up to a stage ("imprint", "mask", "cloud", "pose"), as the studio and `touch2touch pose` have them.
///
/// `recipe`: a `Recipe` (default: the measured imprint, the shipped mask model, the default registration). `tool`: another
/// CAD model than that of the pair.
#[pyfunction]
#[pyo3(signature = (pair, recipe=None, *, stage="pose", tool=None))]
pub(crate) fn estimate(
    py: Python<'_>,
    pair: &Pair,
    recipe: Option<&Recipe>,
    stage: &str,
    tool: Option<&Tool>,
) -> PyResult<Estimate> {
    let (stage, tool) = (recipe::stage(stage)?, tool.map(|tool| Arc::new(Tool::of(&tool.name, tool.model.clone()))));
    let whole = given_or(py, recipe, "measured")?;
    let results = watched(py, None, |process, cx| estimated(pair, tool.as_ref(), &whole, stage, process, cx))?;
    Ok(Estimate::of(results, pair))
}

/// [`estimate`] for many pairs on all cores, in their order; a pair that fails raises, as alone.
///
/// `progress`: a function of (done, total, text).
#[pyfunction]
#[pyo3(signature = (pairs, recipe=None, *, stage="pose", progress=None))]
pub(crate) fn estimate_many(
    py: Python<'_>,
    pairs: Vec<Py<Pair>>,
    recipe: Option<&Recipe>,
    stage: &str,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<Estimate>> {
    let stage = recipe::stage(stage)?;
    let whole = given_or(py, recipe, "measured")?;
    let pairs: Vec<&Pair> = pairs.iter().map(Py::get).collect();
    let results = watched(py, progress, |process, cx| {
        let done = std::sync::atomic::AtomicU64::new(0);
        let one = |pair: &&Pair| {
            cx.check("Estimate")?;
            let results = estimated(pair, None, &whole, stage, process, &cx.quiet())?;
            let so_far = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
            cx.progress(so_far, pairs.len() as u64, "estimating");
            Ok(results)
        };
        pairs.par_iter().map(one).collect::<Result<Vec<_>, TaskError>>()
    })?;
    Ok(results.into_iter().zip(pairs).map(|(results, pair)| Estimate::of(results, pair)).collect())
}

fn registered(points: &[DVec3], tool: &Tool, by: Registration, evidence: bool) -> Result<PoseResult, TaskError> {
    let contacts = Contacts::from(points);
    pose(contacts, &tool.model, &*by.method(), Ask { evidence, ..Ask::default() }, None)
}

/// The pose of a tool from contact points (N, 3), float64, meters, grasp frame: for any grasp, not only ours. An array that lies
/// row by row is read where it is: another thread must not write to it meanwhile.
///
/// `engine`: the registration; points alone have no membrane, so "joint" goes by them as "distance_field" does. `evidence`:
/// with standard deviations and verdict, which cost about as much as the pose.
#[pyfunction]
#[pyo3(signature = (points, tool, *, engine="joint", evidence=true))]
pub(crate) fn register(
    py: Python<'_>,
    points: PyReadonlyArray2<'_, f64>,
    tool: &Tool,
    engine: &str,
    evidence: bool,
) -> PyResult<Pose> {
    let (points, by) = (points_of(&points, "points")?, engine.parse::<Registration>().map_err(refused)?);
    let result = py.detach(|| registered(&points, tool, by, evidence)).map_err(|err| failed(&err))?;
    Ok(Pose { result })
}

/// [`register`] for many clouds of one tool, on all cores: a `Pose` for each, `None` where there is none.
#[pyfunction]
#[pyo3(signature = (clouds, tool, *, engine="joint", evidence=true, progress=None))]
pub(crate) fn register_many(
    py: Python<'_>,
    clouds: Vec<PyReadonlyArray2<'_, f64>>,
    tool: &Tool,
    engine: &str,
    evidence: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<Option<Pose>>> {
    let by = engine.parse::<Registration>().map_err(refused)?;
    let clouds = clouds.iter().map(|points| points_of(points, "points")).collect::<PyResult<Vec<_>>>()?;
    let found = watched(py, progress, |_, cx| {
        let one = |points: &Cow<'_, [DVec3]>| {
            cx.check("Register")?;
            Ok(registered(points, tool, by, evidence).ok())
        };
        clouds.par_iter().map(one).collect::<Result<Vec<_>, TaskError>>()
    })?;
    Ok(found.into_iter().map(|found| found.map(|result| Pose { result })).collect())
}
