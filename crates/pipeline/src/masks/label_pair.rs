//! [`label_pair`]: all that one call does to the labels of a pair, one thing after the other. The verb `label` and the Python
//! package call it; the studio makes the same edits ([`crate::masks::label_edit`]) one at a time, as its user does.

use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::{
    DrawnMask, ImprintOf, ImprintSource, Labels, MaskPlace, Operation, PairLabels, Review, system_person,
};
use crate::masks::label_edit::{Edited, LabelEdit, TakenUp, edit};
use crate::masks::propose::{Proposal, ProposalSource, ProposeSetup, propose};
use crate::steps::cloud::seen;
use crate::steps::estimate::{Estimate, Touch, estimate};
use crate::steps::models::Models;
use crate::steps::recipe::{Recipe, Stage};
use crate::steps::tool::load_tool;
use touch2touch_core::contact::MaskBasis;
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::label::{CleanUp, Drawing, Ground, Provenance};
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;

/// Name of the task in errors.
const WHAT: &str = "Label";

/// Origin of the masks that are drawn on and cleaned up.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Begin {
    /// The masks in force.
    #[default]
    AsTheyAre,
    /// None: corrected masks are removed, and the automatic source is in force again.
    Removed,
    /// The automatic masks, which become the corrected ones.
    Adopted,
    /// Proposals, which are accepted.
    Proposed {
        /// Source of the proposals.
        source: ProposalSource,
        /// Replace what was painted by hand as well.
        over_drawn: bool,
    },
}

/// All that is done to the labels of a pair, masks first: an accepted pose is then of the new ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelSetup {
    /// Recipe of masks and poses, with a generator where one of them is of a prediction. Nothing is read of it where
    /// [`Self::asks_recipe`] says so.
    pub recipe: Recipe,
    /// Imprint whose masks are changed.
    pub imprint: ImprintSource,
    /// Fingers whose masks are changed.
    pub pads: Vec<PadId>,
    /// Origin of the masks.
    pub begin: Begin,
    /// Drawings on them, in turn.
    pub draw: Vec<Drawing>,
    /// Clean-ups of them, in turn, after the drawings.
    pub clean: Vec<CleanUp>,
    /// Imprint whose accepted pose is withdrawn.
    pub withdraw: Option<ImprintSource>,
    /// Imprint whose pose is accepted.
    pub accept: Option<ImprintSource>,
    /// Pose that is accepted instead of the registration's, and that proposals from the CAD model by hand are made at.
    pub pose: Option<PlanarPose>,
    /// Review state that is set.
    pub review: Option<Review>,
    /// Note that is written; an empty one removes it.
    pub note: Option<String>,
    /// Person who says all this; else whom the system says.
    pub person: Option<String>,
}

impl LabelSetup {
    /// True where masks are changed, for which the pair itself is read.
    fn makes_masks(&self) -> bool {
        self.begin != Begin::AsTheyAre || !(self.draw.is_empty() && self.clean.is_empty())
    }

    /// True where the recipe decides something.
    pub fn asks_recipe(&self) -> bool {
        self.makes_masks() || self.withdraw.is_some() || self.accept.is_some() || self.review == Some(Review::Done)
    }

    /// The last of the imprints that it is about: predicted where one is.
    pub fn farthest(&self) -> ImprintSource {
        [Some(self.imprint), self.accept, self.withdraw].into_iter().flatten().max().unwrap_or_default()
    }
}

/// Changes the labels of a pair and stores them, each change as a line of its journal. The labels as they are then. Nothing is
/// written of what cannot be done to its end.
///
/// # Errors
/// If something cannot be done, or labels cannot be read or stored.
pub fn label_pair(
    dataset: &Dataset,
    all: &Labels,
    pair: PairId,
    setup: &LabelSetup,
    models: &Models,
) -> Result<PairLabels, TaskError> {
    let entry = dataset.index.get(pair).ok_or_else(|| TaskError::new(WHAT, "there is no such pair"))?;
    let mut stored = all.load(&entry.name)?;
    let mut changes = Changes { now: stored.clone(), made: Vec::new() };
    change(dataset, pair, setup, models, &mut changes)?;
    for Edited { deed, change } in changes.made {
        change.apply_to(&mut stored);
        all.save(&entry.name, &stored, &Operation { person: setup.person.clone(), ..deed })?;
    }
    Ok(stored)
}

fn change(
    dataset: &Dataset,
    pair: PairId,
    setup: &LabelSetup,
    models: &Models,
    labels: &mut Changes,
) -> Result<(), TaskError> {
    let by = || setup.person.clone().or_else(system_person).unwrap_or_default();
    // The pair itself is only read where something is made from it.
    let load = || Maker::load(dataset, pair, setup, models);
    let maker = setup.makes_masks().then(load).transpose()?;
    if let Some(maker) = &maker {
        maker.masks(&by(), labels)?;
    }
    let of = |imprint| setup.recipe.of(imprint).imprint_of();
    if let Some(imprint) = setup.withdraw {
        let of = of(imprint);
        if !labels.make(LabelEdit::WithdrawPose(of.clone()))? {
            let elsewhere = elsewhere(&labels.now, imprint);
            let why = format!("no pose was accepted of {}, so none is withdrawn{elsewhere}", of.text());
            return Err(TaskError::new(WHAT, why));
        }
    }
    if let Some(imprint) = setup.accept {
        let pose = match (setup.pose, &maker) {
            (Some(planar), _) => AcceptedPose { pose: planar, by_hand: true },
            (None, Some(maker)) => maker.pose(imprint, &labels.now)?.into(),
            (None, None) => load()?.pose(imprint, &labels.now)?.into(),
        };
        labels.make(LabelEdit::AcceptPose(of(imprint), pose))?;
    }
    match setup.review {
        Some(Review::Done) => {
            // Whoever marks the pair done has found the automatic masks right; none of what cannot be made.
            let maker = maker.or_else(|| load().ok());
            let automatic = maker.and_then(|maker| maker.right_as_they_are(&labels.now)).unwrap_or_default();
            labels.make(LabelEdit::Done { automatic, by: by() })?;
        }
        Some(review) => drop(labels.make(LabelEdit::Review(review))?),
        None => {}
    }
    if let Some(text) = &setup.note {
        labels.make(LabelEdit::Note(text))?;
    }
    Ok(())
}

/// The other imprints of a kind that poses were accepted of, as the end of a sentence.
fn elsewhere(labels: &PairLabels, imprint: ImprintSource) -> String {
    let of: Vec<String> = labels.accepted.keys().filter(|of| of.source() == imprint).map(ImprintOf::text).collect();
    if of.is_empty() { String::new() } else { format!("; there is one of {}", of.join(", ")) }
}

/// Changes that are made to the labels of a pair, one after the other.
struct Changes {
    now: PairLabels,
    made: Vec<Edited>,
}

impl Changes {
    /// Does something to them. True where that changes anything.
    fn make(&mut self, one: LabelEdit<'_>) -> Result<bool, TaskError> {
        let Some(edited) = edit(&self.now, one)? else { return Ok(false) };
        edited.change.apply_to(&mut self.now);
        self.made.push(edited);
        Ok(true)
    }
}

/// Inputs that masks and poses of a pair are made from.
struct Maker<'a> {
    dataset: &'a Dataset,
    pair: PairId,
    setup: &'a LabelSetup,
    models: &'a Models,
    sample: Sample,
    tool: Result<ToolModel, TaskError>,
}

impl<'a> Maker<'a> {
    fn load(dataset: &'a Dataset, pair: PairId, setup: &'a LabelSetup, models: &'a Models) -> Result<Self, TaskError> {
        let entry = dataset.index.get(pair).ok_or_else(|| TaskError::new(WHAT, "there is no such pair"))?;
        let tool = match &entry.tool {
            Some(name) => load_tool(dataset, name).map(|loaded| loaded.model),
            None => Err(TaskError::new(WHAT, format!("{}: no tool is named, so there is no CAD model", entry.name))),
        };
        let sample = dataset.load(pair).map_err(|err| TaskError::from_error(format!("Load {}", entry.name), &err))?;
        Ok(Self { dataset, pair, setup, models, sample, tool })
    }

    fn touch<'t>(&'t self, labels: &'t PairLabels) -> Touch<'t> {
        Touch { dataset: self.dataset, pair: self.pair, sample: &self.sample, tool: self.tool.as_ref(), labels }
    }

    fn recipe(&self, imprint: ImprintSource) -> Recipe {
        self.setup.recipe.of(imprint)
    }

    /// The masks of an imprint; with `hand`, those that were drawn where there are some.
    fn contact(&self, imprint: ImprintSource, hand: bool, labels: &PairLabels) -> Result<Estimate, TaskError> {
        self.estimate(&Recipe { hand, ..self.recipe(imprint) }, Stage::Mask, labels)
    }

    fn estimate(&self, recipe: &Recipe, stage: Stage, labels: &PairLabels) -> Result<Estimate, TaskError> {
        estimate(self.touch(labels), recipe, stage, self.models, &JobCx::unwatched())
    }

    fn pose(&self, imprint: ImprintSource, labels: &PairLabels) -> Result<PlanarPose, TaskError> {
        let estimate = self.estimate(&self.recipe(imprint), Stage::Pose, labels)?;
        Ok(estimate.pose().map_err(Clone::clone)?.grasp_from_object)
    }

    /// Changes the masks of the fingers.
    fn masks(&self, by: &str, labels: &mut Changes) -> Result<(), TaskError> {
        let setup = self.setup;
        let to = self.recipe(setup.imprint).imprint_of();
        let place = |pad| MaskPlace { pad, of: to.clone() };
        if setup.begin == Begin::Removed {
            for &pad in &setup.pads {
                labels.make(LabelEdit::Remove(place(pad)))?;
            }
            return Ok(());
        }
        let start = self.contact(setup.imprint, setup.begin != Begin::Adopted, &labels.now)?;
        let imprints = start.imprints.clone();
        let pads: Vec<PadId> = setup.pads.iter().copied().filter(|pad| start.contact().masks[*pad].is_some()).collect();
        let proposed = self.proposals(&start, &pads, &labels.now)?;
        let mut drawn_on = vec![false; setup.draw.len()];
        for pad in pads {
            let Some(begun) = taken_up(&start, pad, &labels.now) else { continue };
            match setup.begin {
                Begin::AsTheyAre | Begin::Removed => {}
                Begin::Adopted => drop(labels.make(LabelEdit::Adopt(begun.clone()))?),
                Begin::Proposed { over_drawn, .. } => {
                    if let Some(proposal) = &proposed[pad] {
                        labels.make(LabelEdit::AcceptProposal { place: place(pad), proposal, over_drawn })?;
                    }
                }
            }
            let Some(imprint) = &imprints[pad] else { continue };
            let on = |labels: &PairLabels| {
                let mask = labels.drawn(&place(pad), imprint).unwrap_or(&begun.mask).clone();
                TakenUp { place: place(pad), mask }
            };
            for (drawing, touches) in setup.draw.iter().zip(&mut drawn_on) {
                let sight = drawing.sight.as_deref();
                let seen = sight.map(|sight| seen(&self.sample, &(*imprints).as_ref(), pad, sight)).transpose()?;
                let on = on(&labels.now);
                let mut mask = on.mask.clone();
                let ground = Ground { seen: seen.as_ref(), ..Ground::new(imprint) };
                *touches |= mask.draw(drawing, ground, Provenance::hand(by.to_owned()));
                labels.make(LabelEdit::Draw { on, mask, drawing })?;
            }
            for &clean_up in &setup.clean {
                labels.make(LabelEdit::CleanUp { on: on(&labels.now), clean_up, rig: &self.dataset.rig })?;
            }
        }
        if let Some(at) = drawn_on.iter().position(|touches| !touches) {
            let drawing = serde_json::to_string(&setup.draw[at]).unwrap_or_default();
            return Err(TaskError::new(WHAT, format!("the drawing {drawing} touches no pixel")).with_hint(
                "Points are pixels of the image (or of its sight); 0,0 is the center of the upper left one.",
            ));
        }
        Ok(())
    }

    /// The proposals that are asked for; `estimate` has the imprints.
    fn proposals(
        &self,
        estimate: &Estimate,
        pads: &[PadId],
        labels: &PairLabels,
    ) -> Result<PerPad<Proposal>, TaskError> {
        let mut out = PerPad::default();
        let Begin::Proposed { source, .. } = self.setup.begin else { return Ok(out) };
        let recipe = self.recipe(self.setup.imprint);
        let setup = ProposeSetup { source, recipe, pose: self.setup.pose };
        for (pad, made) in propose(self.touch(labels), estimate, pads, &setup, self.models)? {
            out[pad] = Some(made?);
        }
        Ok(out)
    }

    /// The automatic masks of measured imprints that nobody corrected; `None` where they cannot be made.
    fn right_as_they_are(&self, labels: &PairLabels) -> Option<Vec<TakenUp>> {
        let estimate = self.contact(ImprintSource::Measured, true, labels).ok()?;
        let by_hand =
            |pad: &PadId| estimate.contact().masks[*pad].as_ref().is_some_and(|mask| mask.basis == MaskBasis::Hand);
        let pads = self.setup.pads.iter().copied().filter(|pad| !by_hand(pad));
        Some(pads.filter_map(|pad| taken_up(&estimate, pad, labels)).collect())
    }
}

/// The mask in force on an imprint, as a hand takes it up.
fn taken_up(estimate: &Estimate, pad: PadId, labels: &PairLabels) -> Option<TakenUp> {
    let (contact, place) = (estimate.contact(), MaskPlace { pad, of: estimate.recipe().imprint_of() });
    let found = contact.masks[pad].as_ref()?;
    let model = contact.model.as_deref().unwrap_or_default();
    let mask = match labels.masks.get(&place).filter(|_| found.basis == MaskBasis::Hand) {
        Some(drawn) => drawn.clone(),
        None => DrawnMask::new(found.mask.clone(), contact.recipe.provenance(model, found.basis)),
    };
    Some(TakenUp { place, mask })
}
