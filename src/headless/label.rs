//! `touch2touch label`: masks drawn or taken over, review states and accepted poses, as the studio stores them.

mod args;
mod report;

use super::output::says;
use super::predict::Predictor;
use super::{Output, VerbResult, find_pair};
use crate::domain::align::Ask;
use crate::domain::contact::MaskBasis;
use crate::domain::dataset::PairId;
use crate::domain::frames::PlanarPose;
use crate::domain::hand::AcceptedPose;
use crate::domain::label::{Ground, Provenance};
use crate::domain::pose::ToolModel;
use crate::domain::sample::Sample;
use crate::io::dataset::Dataset;
use crate::work::job::JobCx;
use crate::work::labels::{Deed, HandMask, ImprintSource, Labels, MaskPlace, PairLabels, system_person};
use crate::work::mask::{Contact, MaskInputs};
use crate::work::pose::pose;
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
        change(args, &dataset, id, &mut stored)?;
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
    let report = Report { folder, pairs };
    output.finish(&report, || {
        let lines: Vec<String> = report.pairs.iter().map(Stored::text).collect();
        format!("{}\n{} labeled pairs in {}", lines.join("\n"), lines.len(), report.folder.display())
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

/// Makes the changes that the arguments name, masks first: an accepted pose is then of the new ones. The pair itself is
/// only read where something is made from it.
fn change(args: &LabelArgs, dataset: &Dataset, id: PairId, labels: &mut PairLabels) -> anyhow::Result<()> {
    let pads = args.finger.fingers(&dataset.rig)?;
    let mut touch = None;
    if args.remove_mask || args.adopt || args.from.is_some() || !(args.clean.is_empty() && args.draw.is_empty()) {
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
                if let Some(imprint) = &found.imprints[pad] {
                    for drawing in &args.draw {
                        hand.draw(drawing, Ground::new(imprint), by());
                    }
                }
                for clean_up in &args.clean {
                    hand.clean(*clean_up, &dataset.rig);
                }
                if args.adopt || args.from.is_some() || !hand.is_same(&start) {
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
    Ok(())
}
