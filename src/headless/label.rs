//! `touch2touch label`: masks drawn or taken over, review states and accepted poses, as the studio stores them.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use serde::Serialize;

use super::args::{DatasetArgs, FingerArg, keyed};
use super::contact_mask::MaskArgs;
use super::output::says;
use super::pose::parse_start;
use super::predict::{ModelArgs, Predictor};
use super::{Common, Output, ToolArgs, VerbResult, find_pair};
use crate::domain::align::Ask;
use crate::domain::contact::MaskBasis;
use crate::domain::dataset::PairId;
use crate::domain::frames::PlanarPose;
use crate::domain::grid::Mask;
use crate::domain::hand::AcceptedPose;
use crate::domain::label::{fill_holes, largest_island};
use crate::domain::pose::{Registration, ToolModel};
use crate::domain::rig::PadId;
use crate::domain::sample::Sample;
use crate::io::dataset::Dataset;
use crate::work::job::JobCx;
use crate::work::labels::{HandMask, ImprintSource, Labels, PairLabels, Review, Revision};
use crate::work::mask::{Contact, MaskInputs};
use crate::work::pose::pose;
use crate::work::tool::load_tool;

/// Arguments of `label`.
#[derive(Debug, Args)]
pub(super) struct LabelArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The pair to label, by its name or a part of it that no other has; without it, all labels are listed.
    #[arg(long)]
    pair: Option<String>,
    /// Set the review state.
    #[arg(long, requires = "pair", value_parser = keyed::<Review>())]
    review: Option<Review>,
    /// Accept the pose of this imprint: what the registration answers, or `--pose`.
    #[arg(long, value_name = "IMPRINT", requires = "pair", value_parser = keyed::<ImprintSource>())]
    accept: Option<ImprintSource>,
    /// The pose to accept instead: `DEGREES,Y_MM,Z_MM` of the tool in the hand, such as `10,0,-2`.
    #[arg(long, value_name = "DEG,MM,MM", requires = "accept", value_parser = parse_start, allow_hyphen_values = true)]
    pose: Option<PlanarPose>,
    /// Withdraw the accepted pose of this imprint.
    #[arg(long, value_name = "IMPRINT", requires = "pair", value_parser = keyed::<ImprintSource>())]
    withdraw: Option<ImprintSource>,
    /// Make the mask of `--mask` the corrected one.
    #[arg(long, requires = "pair", conflicts_with = "remove_mask")]
    adopt: bool,
    /// Fill the holes of the mask.
    #[arg(long, requires = "pair", conflicts_with = "remove_mask")]
    fill_holes: bool,
    /// Keep only the largest connected part of the mask.
    #[arg(long, requires = "pair", conflicts_with = "remove_mask")]
    largest_island: bool,
    /// Remove the corrected mask: the automatic source is in force again.
    #[arg(long, requires = "pair")]
    remove_mask: bool,
    /// Whose mask is changed: the name of one, or `both`.
    #[arg(long, default_value = "both")]
    finger: FingerArg,
    /// The imprint that masks are made from.
    #[arg(long, default_value = ImprintSource::Measured.key(), value_parser = keyed::<ImprintSource>())]
    imprint: ImprintSource,
    /// The registration.
    #[arg(long, default_value = Registration::default().key(), value_parser = keyed::<Registration>())]
    engine: Registration,
    #[command(flatten)]
    mask: MaskArgs,
    #[command(flatten)]
    tool: ToolArgs,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    common: Common,
}

/// What is stored of a pair.
#[derive(Debug, Serialize)]
struct Stored {
    name: String,
    review: &'static str,
    /// The fingers with a corrected mask, and how many pixels it has.
    masks: Vec<(String, usize)>,
    /// From the measured, from the predicted imprint.
    accepted: [Option<AcceptedPose>; 2],
}

impl Stored {
    fn new(name: &str, labels: &PairLabels, dataset: &Dataset) -> Self {
        let count = |mask: &Mask| mask.as_slice().iter().filter(|&&m| m).count();
        let mask = |(pad, hand): (PadId, &HandMask)| (dataset.rig.pad_key(pad).to_string(), count(&hand.mask));
        Self {
            name: name.to_owned(),
            review: labels.review.stored(),
            masks: labels.masks.entries().map(mask).collect(),
            accepted: labels.accepted,
        }
    }

    fn text(&self) -> String {
        let masks: Vec<String> = self.masks.iter().map(|(pad, px)| format!("{pad} {px} px")).collect();
        let masks = if masks.is_empty() { "no corrected mask".to_owned() } else { masks.join(", ") };
        let mut text = format!("{}: {}; {masks}", self.name, self.review);
        for (of, accepted) in ["measured", "predicted"].iter().zip(self.accepted) {
            if let Some(accepted) = accepted {
                let place = accepted.pose.planar.inverse();
                let by = if accepted.by_hand { ", by hand" } else { "" };
                text += &format!("; {of} pose {:.1}° accepted{by}", place.theta_rad.to_degrees());
            }
        }
        text
    }
}

#[derive(Debug, Serialize)]
struct Report {
    /// Where labels lie.
    folder: PathBuf,
    /// The labeled pair, or all that are labeled.
    pairs: Vec<Stored>,
}

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
            labels.save(&entry.name, &stored)?;
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
        let imprints = self.predictor.imprints(&self.sample, imprint, &JobCx::unwatched())?;
        let inputs = MaskInputs { sample: &self.sample, tool: self.tool.as_ref().ok(), labels };
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
    for &pad in pads.iter().filter(|_| args.remove_mask) {
        labels.draw(pad, None);
    }
    if args.adopt || args.fill_holes || args.largest_island {
        let found = Touch::load(args, dataset, id)?.contact(args.imprint, (!args.adopt).then_some(&*labels))?;
        for pad in pads {
            let Some(one) = &found.masks[pad] else { continue };
            let base = match (&labels.masks[pad], one.basis) {
                (Some(hand), MaskBasis::Hand) => hand.base.clone(),
                _ => one.basis.label(&found.recipe.label(found.model.as_deref().unwrap_or_default())),
            };
            let mut mask = one.mask.clone();
            if args.fill_holes {
                mask = fill_holes(&mask);
            }
            if args.largest_island {
                mask = largest_island(&mask);
            }
            if args.adopt || mask != one.mask {
                labels.draw(pad, Some(HandMask { mask: Arc::new(mask), revision: Revision::default(), base }));
            }
        }
    }
    if let Some(imprint) = args.withdraw {
        labels.accepted[imprint as usize] = None;
    }
    if let Some(imprint) = args.accept {
        labels.accepted[imprint as usize] = Some(match args.pose {
            Some(planar) => AcceptedPose { pose: planar.into(), by_hand: true },
            None => Touch::load(args, dataset, id)?.pose(imprint, labels)?.into(),
        });
    }
    if let Some(review) = args.review {
        labels.review = review;
    }
    Ok(())
}
