//! [`propose`]: what any source proposes for the fingers of a pair, from what its files say.

use super::{CadAt, Proposal, ProposalSource, Takes, WHAT, automatic, cad_distances, grown, hand_pose, near_cad};
use crate::error::TaskError;
use crate::job::JobCx;
use crate::labels::MaskPlace;
use crate::steps::estimate::{Estimate, Touch};
use crate::steps::models::Models;
use crate::steps::on_pad::OnPad;
use crate::steps::recipe::{Recipe, Stage};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::label::CadPose;
use touch2touch_core::rig::PadId;

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
    match setup.source.takes() {
        Takes::AutomaticMask => {
            let made = reach(&Recipe { hand: false, ..setup.recipe.clone() }, Stage::Mask)?;
            let made = made.contact();
            each(&|pad, _| {
                let one = made.masks[pad].as_ref().ok_or_else(|| lacks("there is no mask"))?;
                Ok(automatic(one.clone(), &made.recipe, made.model.as_deref().unwrap_or_default()))
            })
        }
        Takes::CadModel(CadAt::Truth) => {
            let truth = sample.grasp_from_object.ok_or_else(|| lacks("the true pose of this pair is not known"))?;
            near(CadPose::Truth, truth)
        }
        Takes::CadModel(CadAt::Registered) => {
            let estimate = reach(&setup.recipe, Stage::Pose)?;
            let found = estimate.pose().map_err(Clone::clone)?.grasp_from_object;
            near(CadPose::Registered(found), found)
        }
        Takes::CadModel(CadAt::Hand) => {
            let pose = hand_pose(setup.pose, labels.accepted(&of)).ok_or_else(|| {
                lacks("nobody set the pose of this pair by hand").with_hint("Set it first, or name it with --pose.")
            })?;
            near(CadPose::Nudged(pose), pose)
        }
        Takes::DrawnMask => each(&|pad, imprint| {
            let place = MaskPlace { pad, of: of.clone() };
            grown(imprint, labels.drawn(&place, imprint))
        }),
    }
}
