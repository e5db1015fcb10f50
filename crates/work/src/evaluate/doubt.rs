//! How sure the mask model is of the imprints of a grasp; it sees each of them once.

use crate::error::TaskError;
use crate::infer::mask::contact_of;
use crate::labels::{MaskPlace, PairLabels};
use crate::mask::{self, MaskInputs};
use crate::models;
use crate::models::Masking;
use touch2touch_core::contact::ContactMask;
use touch2touch_core::grid::{DepthMap, Grid, Mask};
use touch2touch_core::label::Doubt;
use touch2touch_core::rig::{PadId, PerPad};

/// What the mask model said of the imprints of a grasp.
pub(super) struct Seen<'a> {
    by: Masking<'a>,
    models: &'a models::Models,
    /// The probability of contact, and from which one on it is contact.
    probabilities: PerPad<(Grid<f32>, f32)>,
}

impl<'a> Seen<'a> {
    pub(super) fn new(by: Masking<'a>, models: &'a models::Models) -> Self {
        Self { by, models, probabilities: PerPad::default() }
    }

    /// As [`models::Models::contact_mask`].
    pub(super) fn contact_mask(
        &mut self,
        imprint: &DepthMap,
        pad: PadId,
        inputs: MaskInputs<'_>,
    ) -> Result<ContactMask, TaskError> {
        mask::contact_mask(&self.by.recipe()?, imprint, pad, inputs, |imprint| {
            let (probability, least) = self.probability(imprint, pad)?;
            Ok(contact_of(probability, imprint, *least))
        })
    }

    /// Reasons to look at the masks of the measured imprints; none without a mask model.
    pub(super) fn doubt(
        &mut self,
        imprints: &PerPad<DepthMap>,
        labels: Option<&PairLabels>,
    ) -> Result<Doubt, TaskError> {
        let mut doubt = Doubt::default();
        if self.by.model.is_none() {
            return Ok(doubt);
        }
        for (pad, imprint) in imprints.entries() {
            let hand = labels.and_then(|labels| labels.drawn(&MaskPlace::measured(pad), imprint));
            // Where nothing was measured there is nothing to be sure of.
            if imprint.as_slice().iter().all(|v| !v.is_finite()) {
                continue;
            }
            let (probability, least) = self.probability(imprint, pad)?;
            let mut model = contact_of(probability, imprint, *least).mask;
            if let Some((hand, ignored)) = hand.and_then(|hand| Some((hand, hand.marks.ignored()?))) {
                // Where a person says nothing there is nothing to disagree about.
                let said = |x: usize, y: usize| if ignored[(x, y)] { hand.mask[(x, y)] } else { model[(x, y)] };
                model = Mask::from_fn(model.width(), model.height(), said);
            }
            doubt = doubt.or(Doubt::of(probability, &model, hand.map(|hand| &*hand.mask)));
        }
        Ok(doubt)
    }

    fn probability(&mut self, imprint: &DepthMap, pad: PadId) -> Result<&(Grid<f32>, f32), TaskError> {
        if self.probabilities[pad].is_none() {
            let by = self.by;
            let model = by.model.ok_or_else(|| TaskError::new("Contact mask", "no mask model was found"))?;
            let (probability, least) = self.models.probability(model, by.engine, imprint)?;
            self.probabilities[pad] = Some((probability, by.choice.probability.unwrap_or(least)));
        }
        self.probabilities[pad].as_ref().ok_or_else(|| TaskError::new("Contact mask", "no mask model was found"))
    }
}
