//! Contact masks that need no model: [`mask`].

use std::sync::Arc;

use super::error::TaskError;
use crate::domain::bits::Bits;
use crate::domain::contact::{self, ContactMask};
use crate::domain::frames::PlanarPose;
use crate::domain::grid::DepthMap;
use crate::domain::pose::ToolModel;
use crate::domain::sample::PadTouch;

/// An automatic mask's recipe.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MaskRecipe {
    /// Imprint above a depth in meters.
    Threshold(Bits),
    /// The deepest share of the pixels, in percent.
    TopPercent(Bits),
    /// Within a distance (meters) of the CAD model at the true pose.
    Cad(Bits),
    /// A mask model, by its bundle's identity.
    Unet(Arc<str>),
    /// The simulator's truth.
    Truth,
}

/// An automatic mask that needs no model, and what it is made of in the end: a flat imprint has no contact.
///
/// `tool` and `truth` (`grasp_from_object`) are needed for [`MaskRecipe::Cad`], `touch` for it and for
/// [`MaskRecipe::Truth`].
///
/// # Errors
/// If something the recipe needs is not there, or the sizes differ.
pub fn mask(
    recipe: &MaskRecipe,
    imprint: &DepthMap,
    touch: Option<&PadTouch>,
    tool: Option<&ToolModel>,
    truth: Option<PlanarPose>,
) -> Result<ContactMask, TaskError> {
    const WHAT: &str = "Contact mask";
    let mask = match recipe {
        MaskRecipe::Threshold(min_m) => contact::threshold(imprint, min_m.get()),
        MaskRecipe::TopPercent(percent) => contact::top_percent(imprint, f64::from(percent.get()), f32::NEG_INFINITY),
        MaskRecipe::Cad(limit_m) => {
            let camera = touch
                .and_then(PadTouch::camera)
                .ok_or_else(|| TaskError::new(WHAT, "this source has no depth camera"))?;
            let tool = tool.ok_or_else(|| TaskError::new(WHAT, "the tool's CAD model is not there"))?;
            let truth = truth.ok_or_else(|| TaskError::new(WHAT, "the true pose is not known"))?;
            contact::cad_signed_distance(imprint, camera, &tool.distance, truth.inverse(), f64::from(limit_m.get()))
                .map_err(|err| TaskError::from_error(WHAT, &err))?
        }
        MaskRecipe::Truth => {
            let truth = touch
                .and_then(|t| t.depth()?.truth.as_ref())
                .ok_or_else(|| TaskError::new(WHAT, "only simulated data knows the true contact"))?;
            truth.contact.clone()
        }
        MaskRecipe::Unet(_) => return Err(TaskError::new(WHAT, "the mask model runs on another lane")),
    };
    Ok(contact::settled(imprint, mask))
}
