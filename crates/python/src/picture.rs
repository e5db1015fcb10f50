//! Pictures of pairs: the figure that `touch2touch figure` draws.

use std::sync::Arc;

use pyo3::prelude::*;
use strum::IntoEnumIterator as _;
use touch2touch_core::rig::PerPad;
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::images::figure::{FigureLook, FigureMakers, FigurePane, FigureSetup, figure as draw, note};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::steps::recipe::Recipe as Whole;

use crate::data::Pair;
use crate::process::{refused, watched};
use crate::recipe::{Recipe, given_or};

/// Columns that need a renderer or a second recipe, which a package without a window has not.
fn can_draw(pane: FigurePane) -> bool {
    pane.space().is_none() && pane != FigurePane::Compare
}

/// Both fingers of a pair as SVG text: the figure of `touch2touch figure`.
///
/// `columns`: some of "gelslim", "raw", "reference", "measured", "predicted", "error"; the last two need a recipe with
/// `imprint="predicted"`.
#[pyfunction]
#[pyo3(signature = (pair, recipe=None, *, columns=None))]
pub(crate) fn figure(
    py: Python<'_>,
    pair: &Pair,
    recipe: Option<&Recipe>,
    columns: Option<Vec<String>>,
) -> PyResult<String> {
    let whole = given_or(py, recipe, "measured")?;
    let Some(columns) = columns else { return filled(py, pair, &whole) };
    let panes = columns.iter().map(|name| {
        let pane = name.parse::<FigurePane>().ok().filter(|pane| can_draw(*pane));
        pane.ok_or_else(|| {
            let all: Vec<&str> = FigurePane::iter().filter(|pane| can_draw(*pane)).map(FigurePane::key).collect();
            refused(format!("columns: there is no {name:?}; there are {}", all.join(", ")))
        })
    });
    svg(py, pair, &whole, panes.collect::<PyResult<_>>()?)
}

/// The figure with the columns that a recipe fills: a prediction and its error where it makes one.
pub(crate) fn filled(py: Python<'_>, pair: &Pair, recipe: &Whole) -> PyResult<String> {
    let mut panes = vec![FigurePane::GelSlim, FigurePane::Measured];
    if recipe.generator.is_some() {
        panes.extend([FigurePane::Predicted, FigurePane::Error]);
    }
    svg(py, pair, recipe, panes)
}

fn svg(py: Python<'_>, pair: &Pair, recipe: &Whole, panes: Vec<FigurePane>) -> PyResult<String> {
    let Some((dataset, id)) = pair.place() else {
        return Err(refused("a grasp that was simulated here has no figure: it lies in no data set"));
    };
    let predicted = panes.iter().any(|pane| pane.is_predicted());
    let made = recipe.generator.as_ref().filter(|_| predicted);
    let setup = FigureSetup {
        pairs: vec![id],
        fingers: dataset.rig.pads().collect(),
        shift: recipe.shift,
        look: FigureLook { panes, ..FigureLook::default() },
        note: made.map_or_else(String::new, |(bundle, config)| note(&bundle.name, config, recipe.shift)),
    };
    watched(py, None, |process, cx| {
        let nothing = || TaskError::new("Figure", "there is no renderer in the package");
        let makers = FigureMakers {
            predict: |_, sample: &Arc<Sample>, cx: &JobCx| recipe.generating()?.pair(&process.models, sample, cx),
            space: |_, _: &Sample, _: &_, _: &JobCx| Err(nothing()),
            apart: |_, _: &Arc<Sample>, _: &JobCx| Ok(PerPad::default()),
        };
        if made.is_some() {
            process.run_models(recipe.engine)?;
        }
        draw(dataset, &setup, makers, cx)?.svg()
    })
}
