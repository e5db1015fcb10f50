//! `touch2touch label`: masks drawn or taken over, review states and accepted poses, as the studio stores them.

mod args;
mod report;

use strum::IntoEnumIterator as _;

use super::predict::Predictor;
use super::{Output, VerbResult, find_pair};
use touch2touch_core::align::Ask;
use touch2touch_core::contact::MaskBasis;
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::hand::AcceptedPose;
use touch2touch_core::label::{Ground, Provenance};
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;
use touch2touch_work::cloud::seen;
use touch2touch_work::error::TaskError;
use touch2touch_work::io::dataset::Dataset;
use touch2touch_work::job::JobCx;
use touch2touch_work::label_stats::LabelStats;
use touch2touch_work::labels::{
    Deed, HandMask, ImprintOf, ImprintSource, Labels, MaskPlace, PairLabels, Review, note, system_person, take_in,
};
use touch2touch_work::mask::{Contact, MaskInputs};
use touch2touch_work::pose::pose;
use touch2touch_work::propose::{self, Proposal, ProposeSetup, accepted};
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
    tool: Result<ToolModel, TaskError>,
    predictor: Predictor,
}

impl<'a> Touch<'a> {
    fn load(args: &'a LabelArgs, dataset: &Dataset, id: PairId) -> anyhow::Result<Self> {
        let entry = &dataset.index.pairs[id.0 as usize];
        let tool = match &entry.tool {
            Some(name) => load_tool(dataset, name).map(|(tool, _)| tool),
            None => Err(TaskError::new("Label", format!("{}: no tool is named, so there is no CAD model", entry.name))),
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
        let tool = self.tool.as_ref().map_err(Clone::clone)?;
        let (points, registration) = (contact.points(&self.sample)?, self.args.engine.method());
        Ok(pose(&points, tool, &*registration, Ask::default(), self.sample.grasp_from_object)?.grasp_from_object)
    }
}

impl Touch<'_> {
    /// What `--propose` asks for, for pads of the pair; `imprints` are those of `of`.
    fn proposals(
        &mut self,
        (dataset, all, pair): (&Dataset, &Labels, PairId),
        (imprints, of): (&PerPad<DepthMap>, &ImprintOf),
        pads: &[PadId],
        labels: &PairLabels,
    ) -> anyhow::Result<PerPad<Proposal>> {
        let (args, choice) = (self.args, self.args.mask.choice());
        let carry_from = args.carry_from.as_ref().map(|name| find_pair(dataset, name)).transpose()?;
        let setup = ProposeSetup {
            source: args.propose.unwrap_or_default(),
            imprint: args.imprint,
            mask: choice,
            mask_model: self.predictor.mask_model(&choice)?,
            engine: self.predictor.engine(),
            registration: args.engine,
            hand: !args.mask.no_hand,
            pose: args.pose.map(Into::into),
            carry_from,
        };
        let (sample, tool) = (&self.sample, self.tool.as_ref());
        let touch = propose::Touch { dataset, all, pair, sample, tool, imprints, of, labels };
        let mut out = PerPad::default();
        for (pad, made) in propose::propose(touch, pads, &setup, self.predictor.models())? {
            out[pad] = Some(made?);
        }
        Ok(out)
    }
}

/// The other imprints of a kind that poses were accepted of, as the end of a sentence.
fn elsewhere(labels: &PairLabels, imprint: ImprintSource) -> String {
    let of: Vec<String> = labels.accepted.keys().filter(|of| of.source() == imprint).map(ImprintOf::text).collect();
    if of.is_empty() { String::new() } else { format!("; there is one of {}", of.join(", ")) }
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
            let felt: Vec<PadId> = pads.into_iter().filter(|pad| found.masks[*pad].is_some()).collect();
            let proposed = match args.propose {
                Some(_) => touch.proposals((dataset, all, id), (&found.imprints, &of), &felt, labels)?,
                None => PerPad::default(),
            };
            let mut drawn_on = vec![false; args.draw.len()];
            for pad in felt {
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
                if let Some(proposal) = &proposed[pad] {
                    let imprint = found.imprints[pad].as_ref();
                    let drawn = imprint.and_then(|imprint| labels.drawn(&place(pad), imprint));
                    hand = accepted(drawn, proposal, args.over_hand);
                }
                if let Some(imprint) = &found.imprints[pad] {
                    for (drawing, touches) in args.draw.iter().zip(&mut drawn_on) {
                        let sight = drawing.sight.as_deref();
                        let seen = sight.map(|sight| seen(&touch.sample, &found.imprints.as_ref(), pad, sight));
                        let seen = seen.transpose()?;
                        *touches |= hand.draw(drawing, Ground { seen: seen.as_ref(), ..Ground::new(imprint) }, by());
                    }
                }
                for clean_up in &args.clean {
                    hand.clean(*clean_up, &dataset.rig);
                }
                if makes || !hand.is_same(&start) {
                    labels.draw(&place(pad), Some(hand));
                }
            }
            if let Some(at) = drawn_on.iter().position(|touches| !touches) {
                let drawing = serde_json::to_string(&args.draw[at])?;
                anyhow::bail!(
                    "--draw {drawing} touches no pixel: points are pixels of the image (or of its sight), 0,0 is the center \
                     of the upper left one"
                );
            }
        }
    }
    if let Some(imprint) = args.withdraw {
        let of = Predictor::new(&args.model, &dataset.rig).of(imprint)?;
        if labels.accepted(&of).is_none() {
            anyhow::bail!("no pose was accepted of {}, so none is withdrawn{}", of.text(), elsewhere(labels, imprint));
        }
        labels.accept(&of, None);
    }
    if let Some(imprint) = args.accept {
        let of = Predictor::new(&args.model, &dataset.rig).of(imprint)?;
        let pose = match args.pose {
            Some(planar) => AcceptedPose { pose: planar.into(), by_hand: true },
            None => match &mut touch {
                Some(touch) => touch.pose(imprint, labels)?.into(),
                None => Touch::load(args, dataset, id)?.pose(imprint, labels)?.into(),
            },
        };
        labels.accept(&of, Some(pose));
    }
    if let Some(review) = args.review {
        labels.review = review;
    }
    if let Some(text) = &args.note {
        labels.note = note(text);
    }
    Ok(())
}
