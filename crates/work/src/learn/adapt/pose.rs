//! The in-hand angle that pictures lead to, where the data have poses.

use super::gather::FitTouch as Gathered;
use super::{AdaptSetup, WHAT};
use crate::error::TaskError;
use crate::feel::{Felt, Touch};
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::PairLabels;
use crate::models::Models;
use crate::recipe::Stage;
use crate::tool::Tools;
use touch2touch_core::align::Ask;
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::metrics::AngleSummary;
use touch2touch_core::rig::PerPad;
use touch2touch_core::sample::Scale;

/// Most grasps that are posed: enough for a mean, and a matter of seconds.
const MOST_GRASPS: usize = 100;

/// The errors of the angle over grasps whose every touch has a picture; `None` where no truth, camera or CAD model is
/// known. A grasp without a pose counts as a failure. `tools` are those of the data set.
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
        let (Some(tool), false, 0) = (&first.tool, first.scale == Scale::Assumed, number % stride) else { continue };
        cx.check(WHAT)?;
        let Ok(sample) = dataset.load(first.id) else { continue };
        if sample.grasp_from_object.is_none() || sample.pads.iter().flatten().all(|touch| touch.camera().is_none()) {
            continue;
        }
        let Some(tool) = tools.get(tool) else { continue };
        let mut imprints = PerPad::<DepthMap>::default();
        for (touch, picture) in grasp.iter().zip(own) {
            imprints[touch.pad] = picture.map(|picture| touch.imprint(picture));
        }
        // What people drew on a prediction is of that picture, and each of these is another one.
        let nothing = PairLabels::default();
        let touch = Touch { dataset, pair: first.id, sample: &sample, tool: Ok(tool), labels: &nothing };
        let felt = Felt::of_imprints(&setup.recipe, imprints);
        let felt = felt.reach_asking(touch, Stage::Pose, Ask::default(), models, &cx.quiet());
        let error = felt.ok().and_then(|felt| felt.pose().ok()?.error_rad);
        errors.push(error.unwrap_or(f64::NAN));
    }
    Ok((!errors.is_empty()).then(|| AngleSummary::from_errors(&errors)))
}
