//! `touch2touch label`: masks drawn or taken over, review states and accepted poses, as the studio stores them.

mod args;
mod report;

use strum::IntoEnumIterator as _;

use super::output::says;
use super::predict::Predictor;
use super::{Output, VerbResult, find_pair};
use crate::domain::align::Ask;
use crate::domain::contact::MaskBasis;
use crate::domain::dataset::PairId;
use crate::domain::frames::PlanarPose;
use crate::domain::grid::DepthMap;
use crate::domain::hand::{AcceptedPose, HandPose};
use crate::domain::label::{CadPose, Ground, Provenance};
use crate::domain::pose::ToolModel;
use crate::domain::rig::PadId;
use crate::domain::sample::Sample;
use crate::io::dataset::Dataset;
use crate::work::job::JobCx;
use crate::work::label_stats::LabelStats;
use crate::work::labels::{Deed, HandMask, ImprintSource, Labels, MaskPlace, PairLabels, Review, note, system_person};
use crate::work::mask::{Contact, MaskInputs};
use crate::work::pose::pose;
use crate::work::propose::{self, Proposal, ProposalSource, Side, accepted};
use crate::work::tool::load_tool;

pub(super) use args::LabelArgs;
use report::{Report, Stored};

pub(super) fn run(args: &LabelArgs) -> VerbResult {
    let dataset = args.dataset.open_with(args.tool.tool_scale)?;
    let labels = Labels::of(&dataset);
    let output = Output::new(args.common, "", 0);
    let folder = labels.folder()?.to_owned();
    let (mut pairs, mut complete) = (Vec::new(), true);
    if let Some(name) = &args.pair {
        let id = find_pair(&dataset, name)?;
        let entry = &dataset.index.pairs[id.0 as usize];
        let mut stored = labels.load(&entry.name)?;
        let before = stored.clone();
        change(args, (&dataset, &labels, id), &mut stored)?;
        if stored != before {
            labels.save(&entry.name, &stored, &Deed { person: args.person.clone(), ..Deed::named("label") })?;
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

/// What masks and poses of a pair are made from.
struct Touch<'a> {
    args: &'a LabelArgs,
    sample: Sample,
    tool: anyhow::Result<ToolModel>,
    predictor: Predictor,
}

impl<'a> Touch<'a> {
    fn load(args: &'a LabelArgs, dataset: &Dataset, id: PairId) -> anyhow::Result<Self> {
        let entry = &dataset.index.pairs[id.0 as usize];
        let tool = match &entry.tool {
            Some(name) => load_tool(dataset, name).map(|(tool, _)| tool).map_err(Into::into),
            None => Err(anyhow::anyhow!("{}: no tool is named, so there is no CAD model", entry.name)),
        };
        Ok(Self { args, sample: dataset.load(id)?, tool, predictor: Predictor::new(&args.model, &dataset.rig) })
    }

    fn contact(&mut self, imprint: ImprintSource, labels: Option<&PairLabels>) -> anyhow::Result<Contact> {
        let of = self.predictor.of(imprint)?;
        let imprints = self.predictor.imprints(&self.sample, imprint, &JobCx::unwatched())?;
        let inputs = MaskInputs { sample: &self.sample, tool: self.tool.as_ref().ok(), labels, of: Some(&of) };
        self.predictor.contact(&self.args.mask, imprints, inputs)
    }

    fn pose(&mut self, imprint: ImprintSource, labels: &PairLabels) -> anyhow::Result<PlanarPose> {
        let contact = self.contact(imprint, self.args.mask.drawn(labels))?;
        let tool = self.tool.as_ref().map_err(|err| anyhow::anyhow!("{}", says(err)))?;
        let (points, registration) = (contact.points(&self.sample)?, self.args.engine.method());
        Ok(pose(&points, tool, &*registration, Ask::default(), self.sample.grasp_from_object)?.grasp_from_object)
    }
}

impl Touch<'_> {
    fn near_cad(
        &self,
        (at, pose): (CadPose, HandPose),
        (imprint, pad): (&DepthMap, PadId),
    ) -> anyhow::Result<Proposal> {
        let tool = self.tool.as_ref().map_err(|err| anyhow::anyhow!("{}", says(err)))?;
        let distances = propose::cad_distances((imprint, self.args.imprint), (&self.sample, pad), tool, pose)?;
        Ok(propose::near_cad(&distances, self.args.mask.choice().cad_distance_m, at))
    }

    /// What `--propose` asks for, for a pad of the pair `id`; `found` has the imprints with the masks in force.
    fn proposal(
        &mut self,
        (dataset, all, id): (&Dataset, &Labels, PairId),
        found: &Contact,
        pad: PadId,
        labels: &PairLabels,
    ) -> anyhow::Result<Proposal> {
        let args = self.args;
        let imprint = found.imprints[pad].as_ref().ok_or_else(|| anyhow::anyhow!("there is no imprint"))?;
        Ok(match args.propose.unwrap_or_default() {
            ProposalSource::Automatic => {
                let made = self.contact(args.imprint, None)?;
                let one = made.masks[pad].as_ref().ok_or_else(|| anyhow::anyhow!("there is no mask"))?;
                let provenance = made.recipe.provenance(made.model.as_deref().unwrap_or_default(), one.basis);
                Proposal { mask: one.mask.clone(), provenance, note: one.basis.note().unwrap_or_default() }
            }
            ProposalSource::CadTruth => {
                let truth = self.sample.grasp_from_object;
                let truth = truth.ok_or_else(|| anyhow::anyhow!("the true pose of this pair is not known"))?;
                self.near_cad((CadPose::Truth, truth.into()), (imprint, pad))?
            }
            ProposalSource::CadHand => {
                let pose = args.pose.ok_or_else(|| anyhow::anyhow!("name the pose with --pose DEG,MM,MM"))?;
                self.near_cad((CadPose::Nudged(pose.into()), pose.into()), (imprint, pad))?
            }
            ProposalSource::CadRegistered => {
                let pose = self.pose(args.imprint, labels)?;
                self.near_cad((CadPose::Registered(pose), pose.into()), (imprint, pad))?
            }
            ProposalSource::Grow => {
                let of = self.predictor.of(args.imprint)?;
                propose::grown(imprint, labels.drawn(&MaskPlace { pad, of }, imprint))?
            }
            ProposalSource::Carry => {
                let from = match &args.carry_from {
                    Some(name) => find_pair(dataset, name)?,
                    None => carried_from(dataset, all, id).ok_or_else(|| {
                        anyhow::anyhow!("nobody worked on another pair of this tool yet: name one with --carry-from")
                    })?,
                };
                let name = &dataset.index.pairs[from.0 as usize].name;
                let (sample, labels) = (dataset.load(from)?, all.load(name)?);
                let to = Side { sample: &self.sample, pad, imprint };
                propose::carried_from_pair(name, (&sample, &labels), to)?
            }
            ProposalSource::OtherFinger => {
                let other = dataset.rig.other_pad(pad);
                let other = other.ok_or_else(|| anyhow::anyhow!("there is no other finger"))?;
                let (Some(there), Some(mask)) = (&found.imprints[other], &found.masks[other]) else {
                    anyhow::bail!("the other finger has no mask");
                };
                let side = |pad, imprint| Side { sample: &self.sample, pad, imprint };
                let (from, to) = (side(other, there), side(pad, imprint));
                propose::carried_across(&dataset.rig.pad_key(other), (from, &mask.mask), to)?
            }
        })
    }
}

/// The pair whose mask is carried to another: the nearest of the same tool that somebody worked on.
fn carried_from(dataset: &Dataset, labels: &Labels, to: PairId) -> Option<PairId> {
    let reviews = labels.reviews().states;
    let begun = |name: &str| reviews.get(name).is_some_and(|review| propose::is_begun(*review));
    let tool = dataset.index.pairs[to.0 as usize].tool.as_ref()?;
    let pairs = dataset.index.pairs.iter().enumerate();
    let pairs = pairs.filter(|(_, other)| other.tool.as_ref() == Some(tool) && begun(&other.name));
    propose::nearest_before(to.0 as usize, pairs.map(|(at, _)| (at, PairId(at as u32))))
}

/// Makes the changes that the arguments name, masks first: an accepted pose is then of the new ones. The pair itself is
/// only read where something is made from it.
fn change(
    args: &LabelArgs,
    (dataset, all, id): (&Dataset, &Labels, PairId),
    labels: &mut PairLabels,
) -> anyhow::Result<()> {
    let pads = args.finger.fingers(&dataset.rig)?;
    let mut touch = None;
    let makes = args.adopt || args.from.is_some() || args.propose.is_some();
    if args.remove_mask || makes || !(args.clean.is_empty() && args.draw.is_empty()) {
        let touch = touch.insert(Touch::load(args, dataset, id)?);
        let of = touch.predictor.of(args.imprint)?;
        let place = |pad| MaskPlace { pad, of: of.clone() };
        for &pad in pads.iter().filter(|_| args.remove_mask) {
            labels.draw(&place(pad), None);
        }
        if !args.remove_mask {
            let by = || Provenance::hand(args.person.clone().or_else(system_person).unwrap_or_default());
            let found = touch.contact(args.from.unwrap_or(args.imprint), (!args.adopt).then_some(&*labels))?;
            for pad in pads {
                let Some(one) = &found.masks[pad] else { continue };
                let drawn = match args.from {
                    Some(from) => labels.masks.get(&MaskPlace { pad, of: touch.predictor.of(from)? }),
                    None => labels.masks.get(&place(pad)),
                };
                let model = found.model.as_deref().unwrap_or_default();
                let start = match drawn.filter(|_| one.basis == MaskBasis::Hand) {
                    Some(hand) => hand.clone(),
                    None => HandMask::new(one.mask.clone(), found.recipe.provenance(model, one.basis)),
                };
                let mut hand = args.from.map_or_else(|| start.clone(), |from| start.copied(from));
                if args.propose.is_some() {
                    let proposal = touch.proposal((dataset, all, id), &found, pad, labels)?;
                    let imprint = found.imprints[pad].as_ref();
                    let drawn = imprint.and_then(|imprint| labels.drawn(&place(pad), imprint));
                    hand = accepted(drawn, &proposal, args.over_hand);
                }
                if let Some(imprint) = &found.imprints[pad] {
                    for drawing in &args.draw {
                        hand.draw(drawing, Ground::new(imprint), by());
                    }
                }
                for clean_up in &args.clean {
                    hand.clean(*clean_up, &dataset.rig);
                }
                if makes || !hand.is_same(&start) {
                    labels.draw(&place(pad), Some(hand));
                }
            }
        }
    }
    if let Some(imprint) = args.withdraw {
        labels.accepted[imprint as usize] = None;
    }
    if let Some(imprint) = args.accept {
        labels.accepted[imprint as usize] = Some(match args.pose {
            Some(planar) => AcceptedPose { pose: planar.into(), by_hand: true },
            None => match &mut touch {
                Some(touch) => touch.pose(imprint, labels)?.into(),
                None => Touch::load(args, dataset, id)?.pose(imprint, labels)?.into(),
            },
        });
    }
    if let Some(review) = args.review {
        labels.review = review;
    }
    if let Some(text) = &args.note {
        labels.note = note(text);
    }
    Ok(())
}
