//! Proposals: masks that are shown over the one in force, to be accepted or not.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::{
    CadPlace, Distances, DistancesKey, EstimateKey, ImprintSource, MaskRecipe, MaskVersion, PairKey, ProposalInputs,
    ProposalKey, ToolKey,
};
use super::super::results;
use super::super::results::{Computes, Demands};
use super::super::services::Services;
use super::super::state::{Absent, Lookup, State};
use touch2touch_core::bits::Bits;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::label::CadPose;
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::masks::propose::{self, Proposal, ProposalSource, hand_pose};
use touch2touch_pipeline::steps::on_pad::OnPad;

const WHAT: &str = "Propose a mask";

/// The pose of the CAD model at a place, `grasp_from_object`; `None` if it is not there.
fn cad_pose(state: &State, place: &CadPlace, pair: PairKey) -> Option<(CadPose, PlanarPose)> {
    Some(match place {
        CadPlace::Truth => (CadPose::Truth, state.results.samples.get(&pair)?.grasp_from_object?),
        CadPlace::Registered(key) => {
            let pose = results::pose_of(state, key)?.grasp_from_object;
            (CadPose::Registered(pose), pose)
        }
        CadPlace::Hand(bits) => (CadPose::Nudged(bits.get()), bits.get()),
    })
}

impl Computes for DistancesKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Distances>> {
        let (imprint, touch) = (results::imprint_of(state, &self.imprint).ready()?.clone(), self.imprint.touch());
        let (at, pose) = cad_pose(state, &self.at, touch.pair)?;
        let (sample, side) = (state.results.samples.get(&touch.pair)?.clone(), self.imprint.side());
        let tool = state.library.entry(touch.pair.pair)?.tool.as_deref()?;
        let tool = ToolKey { dataset: touch.pair.dataset, name: tool.into() };
        let tool = state.results.tools.get(&tool)?.clone();
        Some(Job::new(Worker::Compute, "Distances to the CAD model", move |_| {
            let on = OnPad { sample: &sample, pad: touch.finger };
            let grid = propose::cad_distances(&imprint, side, on, &tool.model, pose)?;
            Ok(Distances { grid, at })
        }))
    }
}

impl Computes for ProposalKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Proposal>> {
        let imprint = results::imprint_of(state, &self.imprint).ready()?.clone();
        let job = |make: Box<dyn FnOnce() -> Result<Proposal, TaskError> + Send>| {
            Some(Job::new(Worker::Compute, WHAT, move |_| make()))
        };
        match &self.of {
            ProposalInputs::Automatic(recipe) => {
                let made = state.results.estimates.get(&automatic(self, recipe))?;
                let found = made.contact().masks[self.imprint.touch().finger].clone()?;
                let model = state.library.mask_model(recipe).to_owned();
                let recipe = recipe.clone();
                job(Box::new(move || Ok(propose::automatic(found, &recipe, &model))))
            }
            ProposalInputs::Cad(at, within) => {
                let key = DistancesKey { imprint: self.imprint.clone(), at: at.clone() };
                let (found, within) = (state.results.distances.get(&key)?.clone(), within.get());
                job(Box::new(move || Ok(propose::near_cad(&found.grid, within, found.at))))
            }
            ProposalInputs::Grow(_) => {
                let hand = results::drawn_mask_on(state, &self.imprint).cloned();
                job(Box::new(move || propose::grown(&imprint, hand.as_ref())))
            }
        }
    }
}

/// The automatic mask that is proposed.
fn automatic(key: &ProposalKey, recipe: &MaskRecipe) -> EstimateKey {
    EstimateKey::mask(&key.imprint, MaskVersion::Auto(recipe.clone()))
}

/// The recipe of the proposal for one finger's imprint; `Ok(None)` while something that it takes is not there yet.
///
/// # Errors
/// Something that is missing, by name.
pub fn proposal_key(state: &State, source: ImprintSource, finger: PadId) -> Result<Option<ProposalKey>, Absent> {
    let imprint = results::imprint_key(state, source, finger)?;
    let within = Bits::from(state.settings.mask.choice.cad_distance_m);
    let of = match state.settings.mask.proposal {
        ProposalSource::Automatic => ProposalInputs::Automatic(results::mask_recipe(state, finger)?),
        ProposalSource::CadTruth => {
            results::tool_name(state)?;
            let sample = results::sample(state).ready();
            if sample.is_some_and(|sample| sample.grasp_from_object.is_none()) {
                return Err(Absent::NoTruth);
            }
            ProposalInputs::Cad(CadPlace::Truth, within)
        }
        ProposalSource::CadRegistered => match results::pose_key(state, source)? {
            Some(key) => ProposalInputs::Cad(CadPlace::Registered(Box::new(key)), within),
            None => return Ok(None),
        },
        ProposalSource::CadHand => {
            results::tool_name(state)?;
            let held = state.workbench.hand(source).map(|hand| hand.pose);
            let pose = hand_pose(held, results::accepted(state, source)).ok_or(Absent::NoHandPose)?;
            ProposalInputs::Cad(CadPlace::Hand(pose.into()), within)
        }
        ProposalSource::Grow => {
            let hand = results::drawn_mask(state, source, finger).filter(|hand| hand.marks.has_hand_work());
            ProposalInputs::Grow(hand.ok_or(Absent::NoStrokes)?.revision)
        }
    };
    Ok(Some(ProposalKey { imprint, of }))
}

/// The proposal for one finger's imprint.
pub fn proposal(state: &State, source: ImprintSource, finger: PadId) -> Lookup<'_, Arc<Proposal>> {
    if results::imprint(state, source, finger).ready().is_none() {
        return results::imprint(state, source, finger).without();
    }
    state.look_or(proposal_key(state, source, finger), || None)
}

/// The proposal that is shown over the mask of one finger's imprint.
pub fn shown_proposal(state: &State, source: ImprintSource, finger: PadId) -> Option<&Arc<Proposal>> {
    let here = finger == state.selection.finger && source == results::worked_on(state, finger);
    proposal(state, source, finger).ready().filter(|_| here && results::proposes(state))
}

/// The proposal, where one is shown, with what it takes.
pub(crate) fn want_proposal(wants: &mut Demands<'_>) {
    let state = wants.state;
    let finger = state.selection.finger;
    let source = results::worked_on(state, finger);
    if !results::proposes(state)
        || state.document.stroke.is_some()
        || results::imprint(state, source, finger).ready().is_none()
    {
        return;
    }
    if state.settings.mask.proposal.is_cad()
        && results::tool_name(state).is_ok()
        && results::tool(state).ready().is_none()
    {
        return results::want_tool(wants);
    }
    let Ok(Some(key)) = proposal_key(state, source, finger) else { return };
    match &key.of {
        ProposalInputs::Automatic(recipe) if !state.results.estimates.contains(&automatic(&key, recipe)) => {
            return wants.ask(automatic(&key, recipe));
        }
        ProposalInputs::Cad(at, _) => {
            let distances = DistancesKey { imprint: key.imprint.clone(), at: at.clone() };
            if cad_pose(state, at, key.imprint.touch().pair).is_none() {
                return;
            }
            if !state.results.distances.contains(&distances) {
                return wants.ask(distances);
            }
        }
        _ => {}
    }
    wants.ask(key);
}
