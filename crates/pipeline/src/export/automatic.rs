//! [`Automatic`]: masks that nobody drew, made by a recipe.

use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::PairLabels;
use crate::steps::estimate::{Estimate, Touch};
use crate::steps::models::Models;
use crate::steps::recipe::{Recipe, Stage};
use crate::steps::tool::Tools;
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::Mask;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;

const WHAT: &str = "Contact mask";

/// Maker of the masks that nobody drew on measured imprints.
pub struct Automatic<'a> {
    dataset: &'a Dataset,
    recipe: &'a Recipe,
    models: &'a Models,
    tools: Tools<'a>,
    note: &'a dyn Fn(&str),
}

impl<'a> Automatic<'a> {
    /// A maker by the masks of `recipe`; `note` hears where one is not of the source that was asked.
    pub fn new(dataset: &'a Dataset, recipe: &'a Recipe, models: &'a Models, note: &'a dyn Fn(&str)) -> Self {
        Self { dataset, recipe, models, tools: Tools::new(dataset), note }
    }

    /// The mask of one finger of a pair.
    pub(super) fn mask(
        &mut self,
        pair: PairId,
        sample: &Sample,
        finger: PadId,
        tool: Option<&str>,
    ) -> Result<Mask, TaskError> {
        let tool = tool.and_then(|name| self.tools.get(name));
        let there = sample.pad(finger).ok_or_else(|| TaskError::new(WHAT, "it has no such finger"))?;
        let bubble = there.depth().ok_or_else(|| TaskError::new(WHAT, "it has no such imprint"))?;
        let lacks = TaskError::new(WHAT, "the tool's CAD model is not there");
        let labels = PairLabels::default();
        let touch = Touch { dataset: self.dataset, pair, sample, tool: tool.ok_or(&lacks), labels: &labels };
        let mut only = PerPad::default();
        only[finger] = Some(bubble.imprint.clone());
        let estimate =
            Estimate::of_imprints(self.recipe, only).reach(touch, Stage::Mask, self.models, &JobCx::unwatched())?;
        let found =
            estimate.contact().masks[finger].as_ref().ok_or_else(|| TaskError::new(WHAT, "there is no mask"))?;
        if let Some(note) = found.basis.note() {
            (self.note)(&format!("note: {} finger: {note}", sample.rig.pad_key(finger)));
        }
        Ok((*found.mask).clone())
    }
}
