//! Masks and what else people say of pairs: drawn, marked, exported.

use std::collections::BTreeMap;
use std::path::PathBuf;

use pyo3::prelude::*;
use serde_json::json;
use strum::IntoEnumIterator as _;
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::label::{CleanUp, Drawing};
use touch2touch_pipeline::export::{self, Automatic, DrawnMasks, ExportChoice, ExportSetup, Which};
use touch2touch_pipeline::io::exchange::Format;
use touch2touch_pipeline::labels::Review;
use touch2touch_pipeline::masks::label_pair::{Begin, LabelSetup, label_pair};
use touch2touch_pipeline::masks::propose::ProposalSource;
use touch2touch_pipeline::pairs::pads_named;

use crate::data::{Pair, dataset_of};
use crate::process::{refused, watched};
use crate::recipe::{Recipe, choice, given_or};
use crate::tables::python;

/// Changes what people said about a pair, and stores it beside the data as the studio does: each change is a line of the pair's
/// journal, which undo takes back. Nothing is stored of what cannot be done to its end. The function behind `touch2touch label`.
///
/// `draw`: drawings on the mask, one after the other, as dictionaries: `{"tool": "lasso", "paint": "contact", "points": [[x, y],
/// ...]}` in image pixels, (0, 0) the center of the upper left one; tools are "brush" (`radius_px`), "lasso", "polygon",
/// "rectangle" and "wand" (`tolerance_m`); they paint "contact", "free" or "ignore". `clean`: clean-ups after that, "fill_holes",
/// "largest_island", or with a size in millimeters "grow=1.5", "shrink", "smooth". `begin`: what is drawn on: the mask in force
/// (`None`), "adopt" (the automatic one), "remove" (no corrected mask), or a proposal: "automatic", "cad_truth", "cad_registered",
/// "cad_hand", "grow"; `over_drawn`: it replaces what was painted by hand as well. `finger`: "right", "left" or "both".
///
/// `recipe` says which imprint is meant, and what makes automatic masks and poses. `accept`: accept its pose, the registration's
/// or `pose`: (angle, y, z) of `grasp_from_object` in radians and meters. `review`: "todo", "in_progress", "done", "flagged",
/// "skip". `note`: a text; an empty one removes it. `person`: who says so; else whom the system says.
#[pyfunction]
#[pyo3(signature = (pair, *, draw=None, clean=None, begin=None, over_drawn=false, finger="both", recipe=None, accept=false, pose=None, review=None, note=None, person=None))]
#[allow(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn label(
    py: Python<'_>,
    pair: &Pair,
    draw: Option<Vec<Bound<'_, PyAny>>>,
    clean: Option<Vec<String>>,
    begin: Option<&str>,
    over_drawn: bool,
    finger: &str,
    recipe: Option<&Recipe>,
    accept: bool,
    pose: Option<(f64, f64, f64)>,
    review: Option<&str>,
    note: Option<String>,
    person: Option<String>,
) -> PyResult<()> {
    let ((dataset, id), Some(labels)) = (pair.place().ok_or_else(nowhere)?, pair.all_labels()) else {
        return Err(nowhere());
    };
    let recipe = given_or(py, recipe, "measured")?;
    let reviews = Review::iter().map(|review| (review.into(), review));
    let setup = LabelSetup {
        imprint: recipe.imprint,
        pads: pads_named(&dataset.rig, finger).map_err(refused)?,
        begin: begin.map(|name| begun(name, over_drawn)).transpose()?.unwrap_or_default(),
        draw: draw.unwrap_or_default().iter().map(|one| drawing(py, one)).collect::<PyResult<_>>()?,
        clean: clean
            .unwrap_or_default()
            .iter()
            .map(|text| text.parse())
            .collect::<Result<Vec<CleanUp>, _>>()
            .map_err(refused)?,
        withdraw: None,
        accept: accept.then_some(recipe.imprint),
        pose: pose.map(planar).transpose()?,
        review: review.map(|name| choice("review", name, reviews)).transpose()?,
        note,
        person,
        recipe,
    };
    watched(py, None, |process, _| {
        if setup.asks_recipe() {
            process.run_models(setup.recipe.engine)?;
        }
        label_pair(dataset, labels, id, &setup, &process.models)
    })?;
    Ok(())
}

fn nowhere() -> PyErr {
    refused("a pair that was simulated here has no place for labels: write a data set with `touch2touch simulate`")
}

fn begun(name: &str, over_drawn: bool) -> PyResult<Begin> {
    let mut all = vec![("adopt", Begin::Adopted), ("remove", Begin::Removed)];
    let proposed = |source: ProposalSource| Begin::Proposed { source, over_drawn };
    all.extend(ProposalSource::iter().map(|source| (source.key(), proposed(source))));
    choice("begin", name, all)
}

fn drawing(py: Python<'_>, one: &Bound<'_, PyAny>) -> PyResult<Drawing> {
    let text: String = py.import("json")?.call_method1("dumps", (one,))?.extract()?;
    text.parse().map_err(|why| refused(format!("draw: {why}")))
}

fn planar((theta_rad, y_m, z_m): (f64, f64, f64)) -> PyResult<PlanarPose> {
    let finite = [theta_rad, y_m, z_m].iter().all(|v| v.is_finite());
    finite.then_some(PlanarPose { theta_rad, y_m, z_m }).ok_or_else(|| refused("pose: it must be of finite numbers"))
}

/// Writes masks for training into a folder (empty, missing, or a previous export), and checks what was written by the rules of its
/// form: the function behind `touch2touch masks export`. How many went to each part, as a dictionary.
///
/// `format`: "lab" (a folder as the lab's UNet loader reads it), or as the verb has it. `pairs`: "done", "begun" or "all", for which
/// `recipe` makes the masks that nobody drew. `test_in_train`: pairs that the data set keeps for tests are divided like the rest.
/// `by_tool`: all pairs of a tool go to one part. `manual_checked`: only pixels that a person painted count. `seed`: of the division.
#[pyfunction]
#[pyo3(signature = (data, out, *, format=None, pairs="done", test_in_train=false, by_tool=false, manual_checked=false, seed=0, recipe=None, progress=None))]
#[allow(clippy::too_many_arguments, reason = "keywords in Python")]
pub(crate) fn export_masks<'py>(
    py: Python<'py>,
    data: &Bound<'py, PyAny>,
    out: PathBuf,
    format: Option<&str>,
    pairs: &str,
    test_in_train: bool,
    by_tool: bool,
    manual_checked: bool,
    seed: u64,
    recipe: Option<&Recipe>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let data = dataset_of(py, data)?;
    let formats = Format::iter().map(|format| (format.key(), format));
    let format = format.map(|name| choice("format", name, formats)).transpose()?.unwrap_or_default();
    let which = choice("pairs", pairs, Which::iter().map(|which| (which.key(), which)))?;
    let setup = ExportSetup {
        pairs: Some(data.get().ids.iter().map(|id| PairId(*id as u32)).collect()),
        choice: ExportChoice { which, test_in_train, by_tool, manual_checked, seed, format },
    };
    let recipe = given_or(py, recipe, "measured")?;
    let (plan, _) = watched(py, progress, |process, cx| {
        let opened = &data.get().opened;
        let masks = DrawnMasks { labels: &opened.labels, changed: &BTreeMap::new() };
        if which == Which::All {
            process.run_models(recipe.engine)?;
        }
        let automatic =
            (which == Which::All).then(|| Automatic::new(&opened.source, &recipe, &process.models, &|_| ()));
        export::export_masks(&opened.source, &masks, &setup, &out, automatic, cx)
    })?;
    let [train, val, test] = plan.counts;
    let left_out: usize = plan.left_out.values().sum();
    python(py, &json!({"train": train, "val": val, "test": test, "by_hand": plan.by_hand, "left_out": left_out}))
}
