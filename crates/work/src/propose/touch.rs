//! [`propose`]: what any source proposes for the fingers of a pair, from what its files say.

use super::super::bundles::BundleInfo;
use super::super::error::TaskError;
use super::super::labels::{ImprintOf, ImprintSource, Labels, MaskPlace, PairLabels};
use super::super::mask::{Contact, MaskChoice, MaskInputs};
use super::super::models::{Masking, Models};
use super::super::pose::pose;
use super::{
    Proposal, ProposalSource, Side, WHAT, automatic, cad_distances, carried_across, carried_from_pair, carries_from,
    grown, near_cad,
};
use crate::infer::engine::EngineChoice;
use crate::io::dataset::Dataset;
use touch2touch_core::align::Ask;
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::hand::HandPose;
use touch2touch_core::label::CadPose;
use touch2touch_core::pose::{RegistrationChoice, ToolModel};
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;

/// What proposes, with its numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct ProposeSetup {
    /// The source.
    pub source: ProposalSource,
    /// The imprint that masks are proposed for.
    pub imprint: ImprintSource,
    /// The automatic source, and the distance to the CAD model.
    pub mask: MaskChoice,
    /// The mask model, where there is one.
    pub mask_model: Option<BundleInfo>,
    /// The engine that runs it.
    pub engine: EngineChoice,
    /// What registers the pose of [`ProposalSource::CadRegistered`].
    pub registration: RegistrationChoice,
    /// Whether a mask that was drawn is in force where there is one.
    pub hand: bool,
    /// The pose of [`ProposalSource::CadHand`]; `None` takes the one accepted for the pair, if a person set it.
    pub pose: Option<HandPose>,
    /// The pair of [`ProposalSource::Carry`]; `None` takes the nearest of the same tool that somebody worked on.
    pub carry_from: Option<PairId>,
}

/// A pair that masks are proposed for.
#[derive(Clone, Copy)]
pub struct Touch<'a> {
    /// The data set.
    pub dataset: &'a Dataset,
    /// Its labels.
    pub all: &'a Labels,
    /// Which pair.
    pub pair: PairId,
    /// The pair itself.
    pub sample: &'a Sample,
    /// Its tool; `Err` says why there is none.
    pub tool: Result<&'a ToolModel, &'a TaskError>,
    /// Its imprints, meters.
    pub imprints: &'a PerPad<DepthMap>,
    /// What they are.
    pub of: &'a ImprintOf,
    /// What was labeled of it.
    pub labels: &'a PairLabels,
}

/// What is proposed for some pads, or why nothing is.
pub type Proposals = Vec<(PadId, Result<Proposal, TaskError>)>;

/// What is proposed for each of `pads`.
///
/// # Errors
/// What the source lacks, for all of them.
pub fn propose(
    touch: Touch<'_>,
    pads: &[PadId],
    setup: &ProposeSetup,
    models: &Models,
) -> Result<Proposals, TaskError> {
    let lacks = |why: &str| TaskError::new(WHAT, why);
    let Touch { sample, imprints, labels, .. } = touch;
    let contact = |labels: Option<&PairLabels>| -> Result<Contact, TaskError> {
        let by = Masking { choice: setup.mask, model: setup.mask_model.as_ref(), engine: setup.engine };
        let inputs = MaskInputs { sample, tool: touch.tool.ok(), labels, of: Some(touch.of) };
        models.contact(by, imprints.clone(), inputs)
    };
    let in_force = || contact(setup.hand.then_some(labels));
    let each = |make: &dyn Fn(PadId, &DepthMap) -> Result<Proposal, TaskError>| {
        let one = |pad: PadId| {
            let imprint = imprints[pad].as_ref().ok_or_else(|| lacks("there is no imprint"));
            (pad, imprint.and_then(|imprint| make(pad, imprint)))
        };
        Ok(pads.iter().copied().map(one).collect())
    };
    let near = |at: CadPose, pose: HandPose| {
        let tool = touch.tool.map_err(Clone::clone)?;
        each(&|pad, imprint| {
            let distances = cad_distances((imprint, setup.imprint), (sample, pad), tool, pose)?;
            Ok(near_cad(&distances, setup.mask.cad_distance_m, at))
        })
    };
    match setup.source {
        ProposalSource::Automatic => {
            let made = contact(None)?;
            each(&|pad, _| {
                let one = made.masks[pad].as_ref().ok_or_else(|| lacks("there is no mask"))?;
                Ok(automatic(one.clone(), &made.recipe, made.model.as_deref().unwrap_or_default()))
            })
        }
        ProposalSource::CadTruth => {
            let truth = sample.grasp_from_object.ok_or_else(|| lacks("the true pose of this pair is not known"))?;
            near(CadPose::Truth, truth.into())
        }
        ProposalSource::CadRegistered => {
            let points = in_force()?.points(sample)?;
            let tool = touch.tool.map_err(Clone::clone)?;
            let found = pose(&points, tool, &*setup.registration.method(), Ask::default(), sample.grasp_from_object)?;
            near(CadPose::Registered(found.grasp_from_object), found.grasp_from_object.into())
        }
        ProposalSource::CadHand => {
            let accepted = labels.accepted(touch.of).filter(|accepted| accepted.by_hand);
            let pose = setup.pose.or(accepted.map(|accepted| accepted.pose));
            let pose = pose.ok_or_else(|| {
                lacks("nobody set the pose of this pair by hand").with_hint("Set it first, or name it with --pose.")
            })?;
            near(CadPose::Nudged(pose), pose)
        }
        ProposalSource::Grow => each(&|pad, imprint| {
            let place = MaskPlace { pad, of: touch.of.clone() };
            grown(imprint, labels.drawn(&place, imprint))
        }),
        ProposalSource::Carry => {
            let reviews = touch.all.reviews().states;
            let review = |name: &str| reviews.get(name).copied().unwrap_or_default();
            let from = setup.carry_from.or_else(|| carries_from(&touch.dataset.index, touch.pair, review));
            let from = from.ok_or_else(|| {
                lacks("nobody worked on another pair of this tool yet").with_hint("Correct the mask of one first.")
            })?;
            let name = &touch.dataset.index.get(from).ok_or_else(|| lacks("there is no such pair"))?.name;
            let other = touch.dataset.load(from).map_err(|err| TaskError::from_error(WHAT, &err))?;
            let other_labels = touch.all.load(name)?;
            each(&|pad, imprint| carried_from_pair(name, (&other, &other_labels), Side { sample, pad, imprint }))
        }
        ProposalSource::OtherFinger => {
            let (rig, found) = (&touch.dataset.rig, in_force()?);
            each(&|pad, imprint| {
                let other = rig.other_pad(pad).ok_or_else(|| lacks("there is no other finger"))?;
                let (Some(there), Some(mask)) = (&found.imprints[other], &found.masks[other]) else {
                    return Err(lacks("the other finger has no mask"));
                };
                let from = Side { sample, pad: other, imprint: there };
                carried_across(&rig.pad_key(other), (from, &mask.mask), Side { sample, pad, imprint })
            })
        }
    }
}
