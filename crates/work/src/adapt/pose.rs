//! The in-hand angle that pictures lead to, where the data have poses.

use super::gather::Touch;
use super::{AdaptSetup, WHAT};
use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::mask::MaskInputs;
use crate::models::{Masking, Models};
use crate::pose::pose;
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
    touches: &[Touch],
    pictures: &[Option<&Grid<f32>>],
    cx: &JobCx,
) -> Result<Option<AngleSummary>, TaskError> {
    let (choice, model) = (setup.mask.0, setup.mask.1.as_ref());
    let by = Masking { choice, model, engine: setup.engine };
    let registration = setup.registration.method();
    let grasps: Vec<&[Touch]> = touches.chunk_by(|a, b| a.id == b.id).collect();
    let mut errors = Vec::new();
    let (mut at, stride) = (0, grasps.len().div_ceil(MOST_GRASPS).max(1));
    for (number, grasp) in grasps.iter().enumerate() {
        let own = &pictures[at..at + grasp.len()];
        at += grasp.len();
        let first = &grasp[0];
        let (Some(tool), false, 0) = (&first.tool, first.scale == Scale::Assumed, number % stride) else { continue };
        cx.check(WHAT)?;
        let Ok(sample) = dataset.load(first.id) else { continue };
        let Some(truth) = sample.grasp_from_object else { continue };
        if sample.pads.iter().flatten().all(|touch| touch.camera().is_none()) {
            continue;
        }
        let Some(tool) = tools.get(tool) else { continue };
        let mut imprints = PerPad::<DepthMap>::default();
        for (touch, picture) in grasp.iter().zip(own) {
            imprints[touch.pad] = picture.map(|picture| touch.imprint(picture));
        }
        // What people drew on a prediction is of that picture, and each of these is another one.
        let inputs = MaskInputs { sample: &sample, tool: Some(tool), labels: None, of: None };
        let found = models
            .contact(by, imprints, inputs)
            .and_then(|contact| contact.points(&sample))
            .and_then(|points| pose(&points, tool, &*registration, Ask::default(), Some(truth)));
        errors.push(found.ok().and_then(|found| found.error_rad).unwrap_or(f64::NAN));
    }
    Ok((!errors.is_empty()).then(|| AngleSummary::from_errors(&errors)))
}
