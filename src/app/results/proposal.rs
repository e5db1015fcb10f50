//! Proposals: masks that are shown over the one in force, to be accepted or not.

use std::sync::Arc;

use super::super::keys::{MaskRecipe, Revision};
use super::super::labels::state::{MaskPlace, Stored};
use super::super::pane::Demand;
use super::imprint::ImprintKey;
use super::mask::{MaskKey, MaskVersion};
use super::pose::PoseKey;
use super::tool::ToolKey;
use super::{Absent, Computes, Demands, ImprintSource, Job, Lane, Lookup, PairKey, SharedServices, State};
use touch2touch_core::bits::Bits;
use touch2touch_core::contact::ContactMask;
use touch2touch_core::grid::Grid;
use touch2touch_core::label::CadPose;
use touch2touch_core::manual::ManualPose;
use touch2touch_core::rig::PadId;
use touch2touch_work::error::TaskError;
use touch2touch_work::on_pad::OnPad;
use touch2touch_work::propose::{self, CadAt, OtherPair, Proposal, Side, Takes, hand_pose};

const WHAT: &str = "Propose a mask";

/// Where the CAD model lies.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CadPlace {
    /// At the true pose.
    Truth,
    /// At a registered one.
    Registered(Box<PoseKey>),
    /// Where a hand holds it: the bits of its six numbers.
    Hand([u64; 6]),
}

impl CadPlace {
    fn hand(pose: ManualPose) -> Self {
        let ManualPose { planar, x_m, pitch_rad, yaw_rad } = pose;
        Self::Hand([planar.theta_rad, planar.y_m, planar.z_m, x_m, pitch_rad, yaw_rad].map(f64::to_bits))
    }

    /// The pose, `grasp_from_object`; `None` if it is not there.
    fn find(&self, state: &State, pair: PairKey) -> Option<(CadPose, ManualPose)> {
        Some(match self {
            Self::Truth => (CadPose::Truth, state.results.samples.get(&pair)?.grasp_from_object?.into()),
            Self::Registered(key) => {
                let pose = state.results.poses.get(key)?.grasp_from_object;
                (CadPose::Registered(pose), pose.into())
            }
            Self::Hand(bits) => {
                let [theta_rad, y_m, z_m, x_m, pitch_rad, yaw_rad] = bits.map(f64::from_bits);
                let planar = touch2touch_core::frames::PlanarPose { theta_rad, y_m, z_m };
                let pose = ManualPose { planar, x_m, pitch_rad, yaw_rad };
                (CadPose::Nudged(pose), pose)
            }
        })
    }
}

/// The distances of an imprint's points from the CAD model.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DistancesKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// Where the model lies.
    pub at: CadPlace,
}

/// The distances, and where the model was.
#[derive(Clone, Debug)]
pub struct Distances {
    /// Meters, negative inside; see [`propose::cad_distances`].
    pub grid: Grid<f64>,
    /// Where the model was.
    pub at: CadPose,
}

impl Computes for DistancesKey {
    type Value = Distances;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Distances>> {
        let (imprint, touch) = (self.imprint.find(state)?, self.imprint.touch());
        let (at, pose) = self.at.find(state, touch.pair)?;
        let (sample, side) = (state.results.samples.get(&touch.pair)?.clone(), self.imprint.side());
        let tool = state.library.entry(touch.pair.pair)?.tool.as_deref()?;
        let tool = ToolKey { dataset: touch.pair.dataset, name: tool.into() };
        let tool = state.results.tools.get(&tool)?.clone();
        Some(Job::new(Lane::Compute, "Distances to the CAD model", move |_| {
            let on = OnPad { sample: &sample, pad: touch.finger };
            let grid = propose::cad_distances(imprint.get()?, side, on, &tool.model, pose)?;
            Ok(Distances { grid, at })
        }))
    }

    fn bytes(found: &Distances) -> usize {
        found.grid.len() * 8
    }
}

/// What a proposal is made of.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ProposalInputs {
    /// An automatic mask.
    Automatic(MaskRecipe),
    /// What is within a distance of the CAD model.
    Cad(CadPlace, Bits),
    /// What was painted, by the revision of the mask.
    Grow(Revision),
    /// The mask of another pair, by its revision where it is known.
    Carry(PairKey, Option<Revision>),
    /// The other finger's mask in force.
    Across(ImprintKey, MaskVersion),
}

/// A proposal for one imprint.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ProposalKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// What it is made of.
    pub of: ProposalInputs,
}

impl Computes for ProposalKey {
    type Value = Proposal;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Proposal>> {
        let (imprint, touch) = (self.imprint.find(state)?, self.imprint.touch());
        let sample = state.results.samples.get(&touch.pair)?.clone();
        let job = |make: Box<dyn FnOnce() -> Result<Proposal, TaskError> + Send>| {
            Some(Job::new(Lane::Compute, WHAT, move |_| make()))
        };
        match &self.of {
            ProposalInputs::Automatic(recipe) => {
                let found = state.results.masks.get(&self.automatic(recipe))?.clone();
                let model = state.model_of(recipe).to_owned();
                let recipe = recipe.clone();
                job(Box::new(move || {
                    let (mask, basis, unsure) = ((*found.mask).clone(), found.basis, found.unsure);
                    Ok(propose::automatic(ContactMask { mask, basis, unsure }, &recipe, &model))
                }))
            }
            ProposalInputs::Cad(at, within) => {
                let key = DistancesKey { imprint: self.imprint.clone(), at: at.clone() };
                let (found, within) = (state.results.distances.get(&key)?.clone(), within.get());
                job(Box::new(move || Ok(propose::near_cad(&found.grid, within, found.at))))
            }
            ProposalInputs::Grow(_) => {
                let hand = state.drawn_mask_on(&self.imprint).cloned();
                job(Box::new(move || propose::grown(imprint.get()?, hand.as_ref())))
            }
            ProposalInputs::Carry(from, _) => {
                let source = state.library.open.as_ref()?.source.clone();
                let name = state.library.entry(from.pair)?.name.clone();
                let known = state.document.stored.get(&name) == Some(&Stored::Loaded);
                let labels = known.then(|| state.document.labels.get(&name).cloned()).flatten();
                let loaded = state.results.samples.get(from).cloned();
                let (other, pad) = (from.pair, touch.finger);
                Some(Job::new(Lane::Files, WHAT, move |_| {
                    let labels = labels.map_or_else(|| source.load_labels(&name), Ok)?;
                    let from = loaded.map_or_else(|| source.load(other).map(Arc::new), Ok)?;
                    let to = Side { sample: &sample, pad, imprint: imprint.get()? };
                    propose::carried_from_pair(OtherPair { name: &name, sample: &from, labels: &labels }, to)
                }))
            }
            ProposalInputs::Across(other, version) => {
                let mask = version.find(state, other)?;
                let (from, pad) = (other.find(state)?, other.touch().finger);
                let name = state.finger_name(pad).to_lowercase();
                job(Box::new(move || {
                    let from = Side { sample: &sample, pad, imprint: from.get()? };
                    let to = Side { sample: &sample, pad: touch.finger, imprint: imprint.get()? };
                    propose::carried_across(&name, from, &mask, to)
                }))
            }
        }
    }

    fn bytes(found: &Proposal) -> usize {
        found.mask.len()
    }
}

impl ProposalKey {
    fn automatic(&self, recipe: &MaskRecipe) -> MaskKey {
        MaskKey { imprint: self.imprint.clone(), recipe: recipe.clone() }
    }
}

impl State {
    /// Whether a proposal is shown over the masks.
    pub fn proposes(&self) -> bool {
        self.selection.proposing && self.needs(Demand::Masks)
    }

    /// Whether the proposal needs the pose of an imprint.
    pub(crate) fn proposes_at_pose(&self, source: ImprintSource) -> bool {
        self.proposes()
            && self.settings.mask.proposal.takes() == Takes::CadModel(CadAt::Registered)
            && self.worked_on(self.selection.finger) == source
    }

    /// The pair whose mask would be carried to the selected one.
    pub(crate) fn carries_from(&self) -> Option<PairKey> {
        let (open, to) = (self.library.open.as_ref()?, self.selection.pair?);
        let from = propose::carries_from(open.source.index(), to, |name| self.document.review(name))?;
        Some(open.key(from))
    }

    /// The recipe of the proposal for one finger's imprint; `Ok(None)` while something that it takes is not there yet.
    ///
    /// # Errors
    /// What is missing.
    pub fn proposal_key(&self, source: ImprintSource, finger: PadId) -> Result<Option<ProposalKey>, Absent> {
        let imprint = self.imprint_key(source, finger)?;
        let within = Bits::from(self.settings.mask.choice.cad_distance_m);
        let of = match self.settings.mask.proposal.takes() {
            Takes::AutomaticMask => ProposalInputs::Automatic(self.mask_recipe(finger)?),
            Takes::CadModel(CadAt::Truth) => {
                self.tool_name()?;
                let sample = self.sample().ready();
                if sample.is_some_and(|sample| sample.grasp_from_object.is_none()) {
                    return Err(Absent::NoTruth);
                }
                ProposalInputs::Cad(CadPlace::Truth, within)
            }
            Takes::CadModel(CadAt::Registered) => match self.pose_key(source)? {
                Some(key) => ProposalInputs::Cad(CadPlace::Registered(Box::new(key)), within),
                None => return Ok(None),
            },
            Takes::CadModel(CadAt::Hand) => {
                self.tool_name()?;
                let held = self.workbench.hand(source).map(|hand| hand.pose);
                let pose = hand_pose(held, self.accepted(source)).ok_or(Absent::NoHandPose)?;
                ProposalInputs::Cad(CadPlace::hand(pose), within)
            }
            Takes::DrawnMask => {
                let hand = self.drawn_mask(source, finger).filter(|hand| hand.marks.has_hand_work());
                ProposalInputs::Grow(hand.ok_or(Absent::NoStrokes)?.revision)
            }
            Takes::OtherPair => {
                let from = self.carries_from().ok_or(Absent::NoOtherMask)?;
                let name = self.library.entry(from.pair).map(|entry| entry.name.as_str()).unwrap_or_default();
                let hand = self.document.drawn_mask(name, &MaskPlace::measured(finger));
                ProposalInputs::Carry(from, hand.map(|hand| hand.revision))
            }
            Takes::OtherPad => {
                let other = self.rig().other_pad(finger).ok_or(Absent::NoFinger)?;
                let key = self.imprint_key(source, other)?;
                match self.mask_in_force(source, other) {
                    Ok(mask) => ProposalInputs::Across(key, mask.version),
                    Err(Lookup::Absent(absent)) => return Err(absent),
                    Err(_) => return Ok(None),
                }
            }
        };
        Ok(Some(ProposalKey { imprint, of }))
    }

    /// The proposal for one finger's imprint.
    pub fn proposal(&self, source: ImprintSource, finger: PadId) -> Lookup<'_, Arc<Proposal>> {
        if self.imprint(source, finger).ready().is_none() {
            return self.imprint(source, finger).without();
        }
        self.look_or(self.proposal_key(source, finger), || None)
    }

    /// The proposal that is shown over the mask of one finger's imprint.
    pub fn shown_proposal(&self, source: ImprintSource, finger: PadId) -> Option<&Arc<Proposal>> {
        let here = finger == self.selection.finger && source == self.worked_on(finger);
        self.proposal(source, finger).ready().filter(|_| here && self.proposes())
    }
}

impl Demands<'_> {
    /// The proposal, where one is shown, with what it takes.
    pub(crate) fn proposal(&mut self) {
        let state = self.state;
        let finger = state.selection.finger;
        let source = state.worked_on(finger);
        if !state.proposes() || state.document.stroke.is_some() || state.imprint(source, finger).ready().is_none() {
            return;
        }
        let takes = state.settings.mask.proposal.takes();
        if matches!(takes, Takes::CadModel(_)) && state.tool_name().is_ok() && state.tool().ready().is_none() {
            return self.tool();
        }
        if takes == Takes::OtherPad
            && let Some(other) = state.rig().other_pad(finger)
        {
            self.mask(source, other);
        }
        let Ok(Some(key)) = state.proposal_key(source, finger) else { return };
        match &key.of {
            ProposalInputs::Automatic(recipe) if !state.results.masks.contains(&key.automatic(recipe)) => {
                return self.ask(key.automatic(recipe));
            }
            ProposalInputs::Cad(at, _) => {
                let distances = DistancesKey { imprint: key.imprint.clone(), at: at.clone() };
                if at.find(state, key.imprint.touch().pair).is_none() {
                    return;
                }
                if !state.results.distances.contains(&distances) {
                    return self.ask(distances);
                }
            }
            _ => {}
        }
        self.ask(key);
    }
}
