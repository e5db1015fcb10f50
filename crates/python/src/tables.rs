//! Evaluations, fits and bundles: answers as the verbs' JSON objects.

use std::path::PathBuf;

use pyo3::prelude::*;
use serde::Serialize;
use serde_json::json;
use touch2touch_core::dataset::PairId;
use touch2touch_core::evaluation::{self, GraspScore, paper_rows};
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::infer::bundle::Origin;
use touch2touch_pipeline::learn::adapt::{AdaptSetup, Tuning, adapt as fit};
use touch2touch_pipeline::learn::tuning::unfinished_folder;
use touch2touch_pipeline::scores::evaluate::{Evaluation, Report, Setup, evaluate as score};
use touch2touch_pipeline::steps::bundles::{self as found, BundleInfo, BundleKind};
use touch2touch_pipeline::steps::recipe::Recipe as Whole;

use crate::data::dataset_of;
use crate::process::{refused, watched};
use crate::recipe::{Recipe, given_or};

/// A JSON object as Python's dictionaries and lists.
pub(crate) fn python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(refused)?;
    py.import("json")?.call_method1("loads", (text,))
}

/// The paper's results table of a data set, with every grasp behind it.
#[pyclass(module = "touch2touch", frozen)]
pub(crate) struct Scores {
    evaluation: Evaluation,
}

impl Scores {
    /// The figures of a pair by the rows whose name has `source` in it, of the generators where that is empty.
    pub(crate) fn of(&self, pair: &str, source: &str) -> Vec<&GraspScore> {
        let named = |row: &&evaluation::Scores| match source {
            "" => !row.upper_bound,
            source => row.method.to_lowercase().contains(source),
        };
        let of = |row: &'_ evaluation::Scores| row.grasps.iter().position(|grasp| grasp.pair == pair);
        self.evaluation.scores.iter().filter(named).filter_map(|row| Some(&row.grasps[of(row)?])).collect()
    }
}

#[pymethods]
impl Scores {
    /// Everything, as `touch2touch evaluate --json --pairs` prints it.
    #[pyo3(signature = (*, paper=false))]
    fn json<'py>(&self, py: Python<'py>, paper: bool) -> PyResult<Bound<'py, PyAny>> {
        let published = if paper { paper_rows() } else { Vec::new() };
        let report = Report { evaluation: &self.evaluation, published, pairs: Some(&self.evaluation.scores) };
        python(py, &report)
    }

    /// The table for people.
    fn __str__(&self) -> String {
        evaluation::text(&self.evaluation.rows)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("touch2touch._scene")?.call_method1("scores_html", (slf,))
    }

    fn __repr__(&self) -> String {
        let methods: Vec<&str> = self.evaluation.rows.iter().map(|row| row.method.as_str()).collect();
        let grasps = self.evaluation.scores.first().map_or(0, |scores| scores.grasps.len());
        format!("Scores({grasps} grasps by {})", methods.join(", "))
    }
}

fn take(kind: BundleKind, all: &[BundleInfo], rig: &Rig) -> Option<Origin> {
    all.iter()
        .find(|bundle| bundle.kind == kind && !bundle.is_own() && bundle.fits(rig))
        .map(|bundle| bundle.origin.clone())
}

/// Scores every grasp of a data set, or of a part of one, by each generator, beside the measured imprints: the function behind
/// `touch2touch evaluate`.
///
/// `bundles`: folders of generators (default: the shipped one). `recipe`: mask, registration, mapping and runtime that they
/// have in common. `grasps`: at most so many of each tool. `steps`, `seed`: instead of each bundle's own. `resamples`:
/// drawings for the intervals.
#[pyfunction]
#[pyo3(signature = (data, *, bundles=None, recipe=None, grasps=None, steps=None, seed=None, resamples=400, progress=None))]
#[allow(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn evaluate(
    py: Python<'_>,
    data: &Bound<'_, PyAny>,
    bundles: Option<Vec<PathBuf>>,
    recipe: Option<&Recipe>,
    grasps: Option<usize>,
    steps: Option<u32>,
    seed: Option<u64>,
    resamples: usize,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Scores> {
    let data = dataset_of(py, data)?;
    let whole = given_or(py, recipe, "measured")?;
    let evaluation = watched(py, progress, |process, cx| {
        let (all, rig) = (found::find(&[]).bundles, &data.get().opened.source.rig);
        let named = bundles.map(|folders| folders.iter().map(Origin::from).collect::<Vec<_>>());
        let bundles = named.unwrap_or_else(|| take(BundleKind::Generator, &all, rig).into_iter().collect());
        let setup = Setup {
            bundles,
            classifier: take(BundleKind::Classifier, &all, rig),
            recipe: Whole { generator: None, ..whole },
            steps,
            seed,
            pairs: Some(data.get().ids.iter().map(|id| PairId(*id as u32)).collect()),
            grasps_per_tool: grasps,
            resamples,
            ..Setup::default()
        };
        process.run_models(setup.recipe.engine)?;
        score(&data.get().opened.source, &setup, &process.models, cx)
    })?;
    Ok(Scores { evaluation })
}

/// Fits a generator to pairs of one's own sensors: the function behind `touch2touch adapt`. The answer as its JSON object.
///
/// `out`: folder of the new bundle (without it, the fit is only tried). `recipe`: with `imprint="predicted"` it names the
/// generator. `tune`: steps of tuning the networks. `validate`: parts in which pairs are left out in turn; 0 leaves none out.
#[pyfunction]
#[pyo3(signature = (data, out=None, *, recipe=None, tune=0, validate=3, force=false, replace=false, progress=None))]
#[allow(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn adapt<'py>(
    py: Python<'py>,
    data: &Bound<'py, PyAny>,
    out: Option<PathBuf>,
    recipe: Option<&Recipe>,
    tune: u32,
    validate: usize,
    force: bool,
    replace: bool,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    if validate == 1 {
        return Err(refused("validate must be 0, or 2 or more parts"));
    }
    let data = dataset_of(py, data)?;
    let whole = given_or(py, recipe, "predicted")?;
    let adapted = watched(py, progress, |process, cx| {
        let setup = AdaptSetup {
            recipe: whole,
            pairs: data.get().ids.iter().map(|id| PairId(*id as u32)).collect(),
            folds: validate,
            tuning: (tune > 0).then_some(Tuning::Steps(tune)),
            unfinished: unfinished_folder(),
            out,
            force,
            replace,
        };
        process.run_models(setup.recipe.engine)?;
        fit(&data.get().opened.source, &setup, &process.models, cx)
    })?;
    python(py, &adapted)
}

/// The model bundles that are there: shipped with the package, and in the user's folders. Name, kind, folder, identity.
#[pyfunction]
pub(crate) fn bundles(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    let one = |bundle: &BundleInfo| {
        let (kind, fits) = (bundle.kind.name(), bundle.fits(&Rig::lab()));
        json!({"name": bundle.name, "kind": kind, "at": bundle.origin.to_string(), "id": &*bundle.id, "fits": fits})
    };
    let all: Vec<_> = py.detach(|| found::find(&[]).bundles.iter().map(one).collect());
    python(py, &all)
}
