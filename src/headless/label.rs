//! `touch2touch label`: masks drawn or taken over, review states and accepted poses, as the studio stores them.

mod args;
mod report;

use strum::IntoEnumIterator as _;

use super::{Output, VerbResult, find_pair};
use touch2touch_core::contact::MaskBasis;
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::label::{Ground, Provenance};
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;
use touch2touch_work::cloud::seen;
use touch2touch_work::error::TaskError;
use touch2touch_work::feel::{Felt, Touch, feel};
use touch2touch_work::io::dataset::Dataset;
use touch2touch_work::job::JobCx;
use touch2touch_work::label_edit::{self, Edited, LabelEdit, TakenUp};
use touch2touch_work::label_stats::LabelStats;
use touch2touch_work::labels::{
    DrawnMask, ImprintOf, ImprintSource, Labels, MaskPlace, Operation, PairLabels, Review, system_person, take_in,
};
use touch2touch_work::models::Models;
use touch2touch_work::propose::{self, Proposal, ProposeSetup};
use touch2touch_work::recipe::{Recipe, Stage};
use touch2touch_work::tool::load_tool;

pub(super) use args::LabelArgs;
use report::{Report, Stored};

pub(super) fn run(args: &LabelArgs) -> VerbResult {
    if args.pose.is_some() && args.accept.is_none() && args.propose.is_none() {
        anyhow::bail!(
            "--pose alone changes nothing: name the imprint that it is accepted of (--accept), or --propose cad_hand"
        );
    }
    let dataset = args.dataset.open_with(args.tool.tool_scale)?;
    let labels = Labels::of(&dataset);
    let output = Output::new(args.common, "", 0);
    let folder = labels.folder()?.to_owned();
    let (mut pairs, mut complete) = (Vec::new(), true);
    if let Some(kept) = &args.take_in {
        let found = take_in(&dataset, &labels, kept)?;
        found.text().into_iter().for_each(|text| output.note(&text));
        found.failed.iter().for_each(|err| output.note(&err.to_string()));
        complete = found.failed.is_empty();
    }
    if let Some(name) = &args.pair {
        let id = find_pair(&dataset, name)?;
        let entry = &dataset.index.pairs[id.0 as usize];
        let mut stored = labels.load(&entry.name)?;
        labels.journal_problem(&entry.name).into_iter().for_each(|err| output.note(&format!("note: {err}")));
        // Nothing is written of what cannot be done to its end.
        let mut changes = Changes { now: stored.clone(), made: Vec::new() };
        change(args, &dataset, &labels, id, &mut changes)?;
        for Edited { deed, change } in changes.made {
            change.apply_to(&mut stored);
            labels.save(&entry.name, &stored, &Operation { person: args.person.clone(), ..deed })?;
        }
        pairs.push(Stored::new(&entry.name, &stored, &dataset));
    } else {
        for entry in &dataset.index.pairs {
            match labels.load(&entry.name) {
                Ok(stored) if stored.is_empty() => {}
                Ok(stored) => pairs.push(Stored::new(&entry.name, &stored, &dataset)),
                Err(err) => {
                    output.note(&format!("{}: {err}", entry.name));
                    complete = false;
                }
            }
        }
    }
    let counts = LabelStats::of_reviews(&dataset.index, &labels.reviews().states).all;
    let report = Report { folder, pairs, counts };
    output.finish(&report, || {
        let lines: Vec<String> = report.pairs.iter().map(Stored::text).collect();
        let counted = |review: Review| format!("{} {}", report.counts.of(review), review.name());
        let counts: Vec<String> = Review::iter().map(counted).collect();
        let (labeled, folder) = (lines.len(), report.folder.display());
        format!("{}\n{labeled} labeled pairs in {folder}; of all pairs {}", lines.join("\n"), counts.join(", "))
    })?;
    Ok(complete)
}

/// Inputs that masks and poses of a pair are made from.
struct Maker<'a> {
    args: &'a LabelArgs,
    dataset: &'a Dataset,
    pair: PairId,
    sample: Sample,
    tool: Result<ToolModel, TaskError>,
    recipe: Recipe,
    models: Models,
}

impl<'a> Maker<'a> {
    fn load(args: &'a LabelArgs, dataset: &'a Dataset, pair: PairId) -> anyhow::Result<Self> {
        let entry = &dataset.index.pairs[pair.0 as usize];
        let tool = match &entry.tool {
            Some(name) => load_tool(dataset, name).map(|loaded| loaded.model),
            None => Err(TaskError::new("Label", format!("{}: no tool is named, so there is no CAD model", entry.name))),
        };
        let (recipe, models) = (recipe(args, dataset)?, args.model.models());
        Ok(Self { args, dataset, pair, sample: dataset.load(pair)?, tool, recipe, models })
    }

    fn touch<'t>(&'t self, labels: &'t PairLabels) -> Touch<'t> {
        Touch { dataset: self.dataset, pair: self.pair, sample: &self.sample, tool: self.tool.as_ref(), labels }
    }

    /// The masks of an imprint; with `hand`, those that were drawn where there are some.
    fn contact(&self, imprint: ImprintSource, hand: bool, labels: &PairLabels) -> anyhow::Result<Felt> {
        self.felt(&Recipe { hand, ..self.recipe.of(imprint) }, Stage::Mask, labels)
    }

    fn felt(&self, recipe: &Recipe, stage: Stage, labels: &PairLabels) -> anyhow::Result<Felt> {
        Ok(feel(self.touch(labels), recipe, stage, &self.models, &JobCx::unwatched())?)
    }

    fn pose(&self, imprint: ImprintSource, labels: &PairLabels) -> anyhow::Result<PlanarPose> {
        let felt = self.felt(&self.recipe.of(imprint), Stage::Pose, labels)?;
        Ok(felt.pose().map_err(Clone::clone)?.grasp_from_object)
    }

    /// Changes the masks of pads as the arguments say.
    fn masks(&self, all: &Labels, pads: Vec<PadId>, labels: &mut Changes) -> anyhow::Result<()> {
        let args = self.args;
        let by = Provenance::hand(args.person.clone().or_else(system_person).unwrap_or_default());
        let start = self.contact(args.from.unwrap_or(args.imprint), !args.adopt, &labels.now)?;
        let imprints = match args.from {
            Some(_) => self.felt(&self.recipe.of(args.imprint), Stage::Imprint, &labels.now)?.imprints,
            None => start.imprints.clone(),
        };
        let pads: Vec<PadId> = pads.into_iter().filter(|pad| start.contact().masks[*pad].is_some()).collect();
        let proposed = match args.propose {
            Some(_) => self.proposals(all, &start, &pads, &labels.now)?,
            None => PerPad::default(),
        };
        let mut drawn_on = vec![false; args.draw.len()];
        for pad in pads {
            let place = MaskPlace { pad, of: self.recipe.of(args.imprint).imprint_of() };
            let Some(begun) = taken_up(&start, pad, &labels.now) else { continue };
            if args.adopt {
                labels.make(LabelEdit::Adopt(begun.clone()))?;
            } else if args.from.is_some() {
                let size = imprints[pad].as_ref().map(DepthMap::size);
                labels.make(LabelEdit::TakeOver { from: begun.clone(), to: place.clone(), size })?;
            } else if let Some(proposal) = &proposed[pad] {
                let (place, over_drawn) = (place.clone(), args.over_drawn);
                labels.make(LabelEdit::AcceptProposal { place, proposal, over_drawn })?;
            }
            let Some(imprint) = &imprints[pad] else { continue };
            let on = |labels: &PairLabels| {
                let mask = labels.drawn(&place, imprint).unwrap_or(&begun.mask).clone();
                TakenUp { place: place.clone(), mask }
            };
            for (drawing, touches) in args.draw.iter().zip(&mut drawn_on) {
                let sight = drawing.sight.as_deref();
                let seen = sight.map(|sight| seen(&self.sample, &(*imprints).as_ref(), pad, sight)).transpose()?;
                let on = on(&labels.now);
                let mut mask = on.mask.clone();
                *touches |= mask.draw(drawing, Ground { seen: seen.as_ref(), ..Ground::new(imprint) }, by.clone());
                labels.make(LabelEdit::Draw { on, mask, drawing })?;
            }
            for &clean_up in &args.clean {
                labels.make(LabelEdit::CleanUp { on: on(&labels.now), clean_up, rig: &self.dataset.rig })?;
            }
        }
        if let Some(at) = drawn_on.iter().position(|touches| !touches) {
            let drawing = serde_json::to_string(&args.draw[at])?;
            anyhow::bail!(
                "--draw {drawing} touches no pixel: points are pixels of the image (or of its sight), 0,0 is the center \
                 of the upper left one"
            );
        }
        Ok(())
    }

    /// Proposals that `--propose` asks for, for pads of the pair; `felt` are its imprints.
    fn proposals(
        &self,
        all: &Labels,
        felt: &Felt,
        pads: &[PadId],
        labels: &PairLabels,
    ) -> anyhow::Result<PerPad<Proposal>> {
        let args = self.args;
        let carry_from = args.carry_from.as_ref().map(|name| find_pair(self.dataset, name)).transpose()?;
        let setup = ProposeSetup {
            source: args.propose.unwrap_or_default(),
            recipe: self.recipe.of(args.imprint),
            pose: args.pose.map(Into::into),
            carry_from,
        };
        let mut out = PerPad::default();
        for (pad, made) in propose::propose(self.touch(labels), all, felt, pads, &setup, &self.models)? {
            out[pad] = Some(made?);
        }
        Ok(out)
    }
}

/// The mask in force on a felt imprint, as a hand takes it up.
fn taken_up(felt: &Felt, pad: PadId, labels: &PairLabels) -> Option<TakenUp> {
    let (contact, place) = (felt.contact(), MaskPlace { pad, of: felt.recipe().imprint_of() });
    let found = contact.masks[pad].as_ref()?;
    let model = contact.model.as_deref().unwrap_or_default();
    let mask = match labels.masks.get(&place).filter(|_| found.basis == MaskBasis::Hand) {
        Some(drawn) => drawn.clone(),
        None => DrawnMask::new(found.mask.clone(), contact.recipe.provenance(model, found.basis)),
    };
    Some(TakenUp { place, mask })
}

/// The recipe of the arguments; a generator is looked for where one of them is about a prediction.
fn recipe(args: &LabelArgs, dataset: &Dataset) -> anyhow::Result<Recipe> {
    let imprints = [Some(args.imprint), args.from, args.accept, args.withdraw];
    let imprint = imprints.into_iter().flatten().max().unwrap_or_default();
    args.model.posed(imprint, &dataset.rig, &args.mask, args.registration)
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
    /// Does something to them; whether that changes anything.
    fn make(&mut self, edit: LabelEdit<'_>) -> Result<bool, TaskError> {
        let Some(edited) = label_edit::edit(&self.now, edit)? else { return Ok(false) };
        edited.change.apply_to(&mut self.now);
        self.made.push(edited);
        Ok(true)
    }
}

/// The automatic masks of measured imprints that nobody corrected: whoever marks the pair done has found them right. None of what cannot be
/// made.
fn right_as_they_are(
    args: &LabelArgs,
    dataset: &Dataset,
    id: PairId,
    maker: Option<Maker<'_>>,
    labels: &PairLabels,
) -> anyhow::Result<Vec<TakenUp>> {
    let Some(maker) = maker.or_else(|| Maker::load(args, dataset, id).ok()) else { return Ok(Vec::new()) };
    let Ok(felt) = maker.contact(ImprintSource::Measured, true, labels) else { return Ok(Vec::new()) };
    let by_hand = |pad: &PadId| felt.contact().masks[*pad].as_ref().is_some_and(|mask| mask.basis == MaskBasis::Hand);
    let pads = args.finger.fingers(&dataset.rig)?.into_iter().filter(|pad| !by_hand(pad));
    Ok(pads.filter_map(|pad| taken_up(&felt, pad, labels)).collect())
}

/// Makes the changes that the arguments name, masks first: an accepted pose is then of the new ones. The pair itself is
/// only read where something is made from it.
fn change(args: &LabelArgs, dataset: &Dataset, all: &Labels, id: PairId, labels: &mut Changes) -> anyhow::Result<()> {
    let mut maker = None;
    let makes = args.adopt || args.from.is_some() || args.propose.is_some();
    if args.remove_mask || makes || !(args.clean.is_empty() && args.draw.is_empty()) {
        let maker = maker.insert(Maker::load(args, dataset, id)?);
        let pads = args.finger.fingers(&dataset.rig)?;
        if args.remove_mask {
            let of = maker.recipe.of(args.imprint).imprint_of();
            for pad in pads {
                labels.make(LabelEdit::Remove(MaskPlace { pad, of: of.clone() }))?;
            }
        } else {
            maker.masks(all, pads, labels)?;
        }
    }
    if let Some(imprint) = args.withdraw {
        let of = recipe(args, dataset)?.of(imprint).imprint_of();
        if !labels.make(LabelEdit::WithdrawPose(of.clone()))? {
            let elsewhere = elsewhere(&labels.now, imprint);
            anyhow::bail!("no pose was accepted of {}, so none is withdrawn{elsewhere}", of.text());
        }
    }
    if let Some(imprint) = args.accept {
        let of = recipe(args, dataset)?.of(imprint).imprint_of();
        let pose = match args.pose {
            Some(planar) => AcceptedPose { pose: planar.into(), by_hand: true },
            None => match &maker {
                Some(maker) => maker.pose(imprint, &labels.now)?.into(),
                None => Maker::load(args, dataset, id)?.pose(imprint, &labels.now)?.into(),
            },
        };
        labels.make(LabelEdit::AcceptPose(of, pose))?;
    }
    match args.review {
        Some(Review::Done) => {
            let by = args.person.clone().or_else(system_person).unwrap_or_default();
            let automatic = right_as_they_are(args, dataset, id, maker, &labels.now)?;
            labels.make(LabelEdit::Done { automatic, by })?;
        }
        Some(review) => drop(labels.make(LabelEdit::Review(review))?),
        None => {}
    }
    if let Some(text) = &args.note {
        labels.make(LabelEdit::Note(text))?;
    }
    Ok(())
}
