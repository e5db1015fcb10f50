//! Doubt of the mask model about the imprints of a grasp.

use crate::error::TaskError;
use crate::infer::mask::contact_of;
use crate::labels::{MaskPlace, PairLabels};
use crate::steps::estimate::Estimate;
use crate::steps::models::Models;
use touch2touch_core::grid::Mask;
use touch2touch_core::label::Doubt;

/// Reasons to look at the masks of the measured imprints; none without a mask model.
pub(super) fn doubt(estimate: &mut Estimate, labels: &PairLabels, models: &Models) -> Result<Doubt, TaskError> {
    let mut doubt = Doubt::default();
    if estimate.recipe().mask_model.is_none() {
        return Ok(doubt);
    }
    let imprints = estimate.imprints.clone();
    for (pad, imprint) in imprints.entries() {
        let hand = labels.drawn(&MaskPlace::measured(pad), imprint);
        // Where nothing was measured there is nothing to be sure of.
        if imprint.as_slice().iter().all(|v| !v.is_finite()) {
            continue;
        }
        let (found, least) = estimate.probability(pad, models)?;
        let probability = &found.0;
        let mut model = contact_of(probability, imprint, least).mask;
        if let Some((hand, ignored)) = hand.and_then(|hand| Some((hand, hand.marks.ignored()?))) {
            // Where a person says nothing there is nothing to disagree about.
            let said = |x: usize, y: usize| if ignored[(x, y)] { hand.mask[(x, y)] } else { model[(x, y)] };
            model = Mask::from_fn(model.width(), model.height(), said).into();
        }
        doubt = doubt.or(Doubt::of(probability, &model, hand.map(|hand| &*hand.mask)));
    }
    Ok(doubt)
}
