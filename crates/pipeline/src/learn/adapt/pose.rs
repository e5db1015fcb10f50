//! The in-hand angle that pictures lead to, where the data have poses.

use super::gather::FitTouch as Gathered;
use super::{AdaptSetup, WHAT};
use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::PairLabels;
use crate::steps::estimate::{Estimate, Touch};
use crate::steps::models::Models;
use crate::steps::recipe::Stage;
use crate::steps::tool::Tools;
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::metrics::AngleSummary;
use touch2touch_core::rig::PerPad;

/// Most grasps that are posed: enough for a mean, and a matter of seconds.
const MOST_GRASPS: usize = 100;

/// The errors of the angle over grasps whose every touch has a picture, from the true pose or that of the measured imprints;
/// `None` where no camera or CAD model is known. A grasp without a pose counts as a failure. `tools` are those of the data set.
pub(super) fn angles(
    dataset: &Dataset,
    setup: &AdaptSetup,
    models: &Models,
    tools: &mut Tools<'_>,
    touches: &[Gathered],
    pictures: &[Option<&Grid<f32>>],
    cx: &JobCx,
) -> Result<Option<AngleSummary>, TaskError> {
    let grasps: Vec<&[Gathered]> = touches.chunk_by(|a, b| a.id == b.id).collect();
    let mut errors = Vec::new();
    let (mut at, stride) = (0, grasps.len().div_ceil(MOST_GRASPS).max(1));
    for (number, grasp) in grasps.iter().enumerate() {
        let own = &pictures[at..at + grasp.len()];
        at += grasp.len();
        let first = &grasp[0];
        let (Some(tool), 0) = (&first.tool, number % stride) else { continue };
        cx.check(WHAT)?;
        let Ok(sample) = dataset.load(first.id) else { continue };
        if sample.pads.iter().flatten().all(|touch| touch.camera().is_none()) {
            continue;
        }
        let Some(tool) = tools.get(tool) else { continue };
        let nothing = PairLabels::default();
        let touch = Touch { dataset, pair: first.id, sample: &sample, tool: Ok(tool), labels: &nothing };
        let cx = &cx.quiet();
        let Some(truth) = Estimate::compared_with(touch, &setup.recipe, models, cx)? else { continue };
        let mut imprints = PerPad::<DepthMap>::default();
        for (touch, picture) in grasp.iter().zip(own) {
            imprints[touch.of_sample] = picture.map(|picture| touch.imprint(picture));
        }
        let estimate = Estimate::of_imprints(&setup.recipe, imprints).without_verdict();
        let estimate = estimate.reach(touch, Stage::Pose, models, cx);
        let off = estimate.ok().and_then(|estimate| Some(estimate.pose().ok()?.off(truth, tool)));
        errors.push(off.map_or(f64::NAN, |off| off.angle_rad));
    }
    Ok((!errors.is_empty()).then(|| AngleSummary::from_errors(&errors)))
}
