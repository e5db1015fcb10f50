//! Proposals: masks that a person looks at, and accepts or not. Nothing here changes a mask.
//!
//! Masks by threshold, share and mask model are those of [`crate::steps::mask`]; what comes here takes more than the imprint: a
//! pose, strokes.

use std::borrow::Cow;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

use crate::error::TaskError;
use crate::job::JobCx;
use crate::labels::{DrawnMask, ImprintSource, MaskPlace};
use crate::steps::estimate::{Estimate, Touch};
use crate::steps::mask::MaskRecipe;
use crate::steps::models::Models;
use crate::steps::on_pad::OnPad;
use crate::steps::recipe::{Recipe, Stage};
use touch2touch_core::contact::{ContactMask, signed_distances, without_grain};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, Grid, Mask};
use touch2touch_core::label::{CadPose, Provenance, grow_from};
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::{PadId, Rig};
use touch2touch_core::sample::PadTouch;

const WHAT: &str = "Propose a mask";

/// The greatest distance to the CAD model that a mask can be made of, meters.
pub const FARTHEST_M: f64 = 0.01;

/// Source of a proposed mask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, EnumIter, EnumString, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ProposalSource {
    /// The automatic source as it is set.
    #[default]
    Automatic,
    /// Near the CAD model at the true pose.
    CadTruth,
    /// Near the CAD model at the pose that the registration answers.
    CadRegistered,
    /// Near the CAD model at the pose set by hand.
    CadHand,
    /// Grown from what a person painted.
    Grow,
}

impl ProposalSource {
    /// The name in files and on the command line.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Automatic => "Automatic source",
            Self::CadTruth => "CAD at the true pose",
            Self::CadRegistered => "CAD at the registered pose",
            Self::CadHand => "CAD at the pose by hand",
            Self::Grow => "Grow from strokes",
        }
    }

    /// Description in a line.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Automatic => "What the automatic source below says, with its numbers",
            Self::CadTruth => "Pixels whose membrane point lies near the CAD model at the true pose",
            Self::CadRegistered => {
                "Pixels whose membrane point lies near the CAD model at the pose that was registered from the mask in force"
            }
            Self::CadHand => "Pixels whose membrane point lies near the CAD model where the pose tool holds it",
            Self::Grow => {
                "From the strokes painted by hand, contact and free, to the steps of the imprint between them"
            }
        }
    }

    /// It measures the distance to the CAD model.
    pub fn is_cad(self) -> bool {
        matches!(self, Self::CadTruth | Self::CadRegistered | Self::CadHand)
    }
}

/// The pose by hand of an imprint: the one that is held, else the accepted one, if a person set that.
pub fn hand_pose(held: Option<PlanarPose>, accepted: Option<AcceptedPose>) -> Option<PlanarPose> {
    held.or(accepted.filter(|accepted| accepted.by_hand).map(|accepted| accepted.pose))
}

/// Source of proposals, with its numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct ProposeSetup {
    /// The source.
    pub source: ProposalSource,
    /// The imprint that masks are proposed for, the automatic mask and the one in force, the distance to the CAD model, and
    /// what registers the pose of [`ProposalSource::CadRegistered`].
    pub recipe: Recipe,
    /// The pose of [`ProposalSource::CadHand`]; `None` takes the one accepted for the pair, if a person set it.
    pub pose: Option<PlanarPose>,
}

/// Proposals for some pads, or reasons why there are none.
pub type Proposals = Vec<(PadId, Result<Proposal, TaskError>)>;

/// Proposals for each of `pads`; `estimate` has the imprints of the touch by the recipe of `setup`.
///
/// # Errors
/// The reason that holds for all of them: what the source lacks.
pub fn propose(
    touch: Touch<'_>,
    estimate: &Estimate,
    pads: &[PadId],
    setup: &ProposeSetup,
    models: &Models,
) -> Result<Proposals, TaskError> {
    let lacks = |why: &str| TaskError::new(WHAT, why);
    let (sample, labels, imprints, of) = (touch.sample, touch.labels, &estimate.imprints, setup.recipe.imprint_of());
    let reach = |recipe: &Recipe, stage| estimate.again(recipe).reach(touch, stage, models, &JobCx::unwatched());
    let each = |make: &dyn Fn(PadId, &DepthMap) -> Result<Proposal, TaskError>| {
        let one = |pad: PadId| {
            let imprint = imprints[pad].as_ref().ok_or_else(|| lacks("there is no imprint"));
            (pad, imprint.and_then(|imprint| make(pad, imprint)))
        };
        Ok(pads.iter().copied().map(one).collect())
    };
    let near = |at: CadPose, pose: PlanarPose| {
        let tool = touch.tool.map_err(Clone::clone)?;
        each(&|pad, imprint| {
            let distances = cad_distances(imprint, setup.recipe.imprint, OnPad { sample, pad }, tool, pose)?;
            Ok(near_cad(&distances, setup.recipe.mask.cad_distance_m, at))
        })
    };
    match setup.source {
        ProposalSource::Automatic => {
            let made = reach(&Recipe { hand: false, ..setup.recipe.clone() }, Stage::Mask)?;
            let made = made.contact();
            each(&|pad, _| {
                let one = made.masks[pad].as_ref().ok_or_else(|| lacks("there is no mask"))?;
                Ok(automatic(one.clone(), &made.recipe, made.model.as_deref().unwrap_or_default()))
            })
        }
        ProposalSource::CadTruth => {
            let truth = sample.grasp_from_object.ok_or_else(|| lacks("the true pose of this pair is not known"))?;
            near(CadPose::Truth, truth)
        }
        ProposalSource::CadRegistered => {
            let estimate = reach(&setup.recipe, Stage::Pose)?;
            let found = estimate.pose().map_err(Clone::clone)?.grasp_from_object;
            near(CadPose::Registered(found), found)
        }
        ProposalSource::CadHand => {
            let pose = hand_pose(setup.pose, labels.accepted(&of)).ok_or_else(|| {
                lacks("nobody set the pose of this pair by hand").with_hint("Set it first, or name it with --pose.")
            })?;
            near(CadPose::Nudged(pose), pose)
        }
        ProposalSource::Grow => each(&|pad, imprint| {
            let place = MaskPlace { pad, of: of.clone() };
            grown(imprint, labels.drawn(&place, imprint))
        }),
    }
}

/// A proposed mask.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// The contact, as large as the imprint.
    pub mask: Mask,
    /// Origin of the mask.
    pub provenance: Provenance,
    /// Remark on the mask, in words; empty if there is none.
    pub note: String,
}

/// Radius around a pixel in which a measured imprint is looked at to tell grain from membrane, millimeters. On
/// simulated touches of unseen tools at the true pose, masks of 1 mm then have an IoU of 0.93 with the truth, and of
/// 0.82 with the grain.
const GRAIN_MM: f64 = 1.7;

/// The imprint as distances to the CAD model are measured from it: what was measured without its grain, a prediction, which
/// has none, as it is.
pub(crate) fn smooth_imprint<'a>(imprint: &'a DepthMap, of: ImprintSource, rig: &Rig) -> Cow<'a, DepthMap> {
    let radius_px = (GRAIN_MM * rig.depth_px_per_mm()).round();
    match of {
        ImprintSource::Measured if radius_px >= 1.0 => Cow::Owned(without_grain(imprint, radius_px as usize)),
        _ => Cow::Borrowed(imprint),
    }
}

/// The mask of an automatic source; of the mask model's it says how sure that is. `model` is its name.
pub fn automatic(found: ContactMask, recipe: &MaskRecipe, model: &str) -> Proposal {
    let provenance = recipe.provenance(model, found.basis);
    let unsure = found.unsure.map(|share| format!("the model is unsure of {:.1} % of the picture", share * 100.0));
    let note = found.basis.note().into_iter().chain(unsure).collect::<Vec<_>>().join("; ");
    Proposal { mask: Arc::unwrap_or_clone(found.mask), provenance, note }
}

/// The signed distance of each membrane point to the CAD model, meters, negative inside; NaN without depth. From it
/// [`near_cad`] makes a mask of any distance at once.
///
/// # Errors
/// If sizes differ or the camera's numbers cannot be right.
pub fn cad_distances(
    imprint: &DepthMap,
    of: ImprintSource,
    OnPad { sample, pad }: OnPad<'_>,
    tool: &ToolModel,
    grasp_from_object: PlanarPose,
) -> Result<Grid<f64>, TaskError> {
    let camera = sample.pad(pad).and_then(PadTouch::camera);
    let camera = camera.ok_or_else(|| TaskError::new(WHAT, "this source has no depth camera"))?;
    let imprint = smooth_imprint(imprint, of, &sample.rig);
    let object_from_grasp = grasp_from_object.to_affine().inverse();
    signed_distances(&imprint, camera, &tool.distance, object_from_grasp, FARTHEST_M)
        .map_err(|err| TaskError::from_error(WHAT, &err))
}

/// The pixels within a distance of the CAD model.
pub fn near_cad(distances: &Grid<f64>, within_m: f32, at: CadPose) -> Proposal {
    Proposal {
        mask: distances.map(|d| *d <= f64::from(within_m)),
        provenance: Provenance::Cad { within_m, at },
        note: String::new(),
    }
}

/// Grown from what was painted by hand on the mask.
///
/// # Errors
/// If nothing was painted.
pub fn grown(imprint: &DepthMap, hand: Option<&DrawnMask>) -> Result<Proposal, TaskError> {
    let nothing = || {
        TaskError::new(WHAT, "there is nothing to grow from")
            .with_hint("Paint a short stroke of contact, and with the right button one where there is none.")
    };
    let hand = hand.ok_or_else(nothing)?;
    let painted = hand.marks.manual_checked();
    let which = |contact: bool| {
        let (painted, mask) = (painted.as_slice(), hand.mask.as_slice());
        let seeds = painted.iter().zip(mask).map(|(painted, in_contact)| *painted && *in_contact == contact);
        Mask::from_vec(imprint.width(), imprint.height(), seeds.collect())
    };
    let (Ok(contact), Ok(free)) = (which(true), which(false)) else {
        return Err(TaskError::new(WHAT, "the mask is not as large as the imprint"));
    };
    let mask = grow_from(imprint, &contact, &free).ok_or_else(nothing)?;
    let note =
        if free.as_slice().contains(&true) { "" } else { "no stroke says what is free: the edge of the image is" };
    Ok(Proposal { mask, provenance: Provenance::Grown, note: note.into() })
}

/// The mask that accepting a proposal whole makes. Of the one that was drawn, what a person painted stays unless
/// `over_drawn`, and ignored pixels stay so.
#[must_use]
pub fn accepted(drawn: Option<&DrawnMask>, proposal: &Proposal, over_drawn: bool) -> DrawnMask {
    let Some(drawn) = drawn else { return DrawnMask::new(proposal.mask.clone(), proposal.provenance.clone()) };
    let mut hand = drawn.clone();
    hand.replace(&proposal.mask, proposal.provenance.clone(), !over_drawn);
    hand
}
