//! Masks that people drew with the imprints that they belong to, as the network wants them.

use std::collections::BTreeSet;

use rayon::prelude::*;
use touch2touch_tuning::MaskTouch;

use super::{Entry, MOST_MASKS, Remark, TrainPlan, TrainSetup, WHAT};
use crate::error::TaskError;
use crate::export::DrawnMasks;
use crate::infer::bundle::MaskInput;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::{DrawnMask, ImprintOf, ImprintSource, MaskPlace, PairLabels};
use crate::learn::mask_worth::from_cad;
use crate::steps::bundles::{BundleKind, by_id};
use crate::steps::estimate::Touch;
use crate::steps::imprint::imprint_of;
use crate::steps::models::{Generating, Models};
use crate::steps::tool::Tools;
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::label::Provenance;
use touch2touch_core::resample::{bilinear, nearest_mask};
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::Sample;

/// Pairs in memory at a time.
const CHUNK: usize = 32;

/// A mask that somebody drew, with its imprint.
pub(super) struct Drawn {
    pub(super) id: PairId,
    pub(super) pair: String,
    pub(super) tool: Option<String>,
    pub(super) pad: PadId,
    pub(super) source: ImprintSource,
    /// Meters, raw orientation.
    pub(super) imprint: DepthMap,
    /// As large.
    pub(super) mask: Mask,
    /// Pixels of it that count; all without it.
    pub(super) counted: Option<Mask>,
}

/// All of them.
#[derive(Default)]
pub(super) struct Gathered {
    /// To learn from, in the order of the data set.
    pub(super) learned: Vec<Drawn>,
    /// Left out for the score, likewise.
    pub(super) held: Vec<Drawn>,
    pub(super) persons: BTreeSet<String>,
    pub(super) unusable: Vec<Remark>,
}

impl Drawn {
    /// As large as the network's input and turned as that. Where the sizes differ, what was not measured is 0 m before it
    /// is resized, as for the network itself.
    pub(super) fn touch(&self, input: &MaskInput) -> MaskTouch {
        let [width, height] = input.size;
        let same = self.imprint.size() == input.size;
        let imprint = if same {
            self.imprint.clone()
        } else {
            bilinear(&self.imprint.map(|&v| if v.is_finite() { v } else { 0.0 }), width, height)
        };
        let lying = |mask: &Mask| {
            let sized = nearest_mask(mask, width, height);
            if input.rotation_deg == 180 { sized.rotated_180() } else { sized }.into_vec()
        };
        let turned = if input.rotation_deg == 180 { imprint.rotated_180() } else { imprint };
        MaskTouch {
            imprint_m: turned.into_vec(),
            contact: lying(&self.mask),
            counted: self.counted.as_ref().map(lying),
            predicted: self.source == ImprintSource::Predicted,
        }
    }
}

/// Reads what a plan names.
pub(super) fn gather(
    dataset: &Dataset,
    masks: &DrawnMasks<'_>,
    plan: &TrainPlan,
    setup: &TrainSetup,
    models: &Models,
    cx: &JobCx,
) -> Result<Gathered, TaskError> {
    let mut gathered = Gathered { unusable: plan.unreadable.clone(), ..Gathered::default() };
    let (total, mut tools) = (plan.entries.len(), Tools::new(dataset));
    for (round, entries) in plan.entries.chunks(CHUNK).enumerate() {
        cx.check(WHAT)?;
        cx.progress((round * CHUNK) as u64, total as u64, "reading masks and imprints");
        let samples: Vec<_> = entries.par_iter().map(|entry| dataset.load(entry.id)).collect();
        for (entry, sample) in entries.iter().zip(samples) {
            let refused = |why: String| Remark { name: entry.name.clone(), why };
            let sample = match sample {
                Ok(sample) => sample,
                Err(err) => {
                    gathered.unusable.push(refused(format!("{err} ({})", err.hint)));
                    continue;
                }
            };
            let labels = if entry.cad {
                match cad_masks(dataset, entry, &sample, &mut tools, models) {
                    Ok((labels, lacking)) => {
                        gathered.unusable.extend(lacking.into_iter().map(refused));
                        labels
                    }
                    Err(err) => {
                        gathered.unusable.push(refused(err.why));
                        continue;
                    }
                }
            } else {
                // Who drew what is not on the disk yet is not known there.
                gathered.persons.extend(masks.labels.persons(&entry.name).unwrap_or_default());
                masks.of_pair(&entry.name)?
            };
            for place in &entry.places {
                let Some(hand) = labels.masks.get(place) else { continue };
                gathered.persons.extend(hand.marks.layers().into_iter().filter_map(|(layer, px)| match layer {
                    Provenance::Hand { person } | Provenance::Accepted { person, .. }
                        if px > 0 && !person.is_empty() =>
                    {
                        Some(person.clone())
                    }
                    _ => None,
                }));
                let imprint = match imprint(&sample, place, setup, models, cx) {
                    Err(err) if err.is_cancelled() => return Err(err),
                    imprint => imprint,
                };
                let fits = imprint.and_then(|imprint| match unfit(&imprint, hand) {
                    Some(why) => Err(TaskError::new(WHAT, why)),
                    None => Ok(imprint),
                });
                match fits {
                    Ok(imprint) => gathered.push(
                        entry,
                        Drawn {
                            id: entry.id,
                            pair: entry.name.clone(),
                            tool: entry.tool.clone(),
                            pad: place.pad,
                            source: place.of.source(),
                            imprint,
                            mask: (*hand.mask).clone(),
                            counted: hand.marks.ignored().map(|ignored| ignored.map(|ignored| !ignored)),
                        },
                    ),
                    Err(err) => gathered.unusable.push(refused(format!(
                        "{} finger: {}",
                        dataset.rig.pad_key(place.pad),
                        err.why
                    ))),
                }
            }
        }
    }
    if gathered.learned.is_empty() {
        let first = gathered.unusable.first().map(|first| format!("; {}: {}", first.name, first.why));
        return Err(TaskError::new(WHAT, format!("no mask can be learned from{}", first.unwrap_or_default())));
    }
    Ok(gathered)
}

impl Gathered {
    fn push(&mut self, entry: &Entry, drawn: Drawn) {
        let to = if entry.held_out { &mut self.held } else { &mut self.learned };
        if to.len() < MOST_MASKS {
            to.push(drawn);
        }
    }
}

/// The masks that the CAD model of a pair's tool makes at the true pose, and why there is none of a finger.
fn cad_masks(
    dataset: &Dataset,
    entry: &Entry,
    sample: &Sample,
    tools: &mut Tools<'_>,
    models: &Models,
) -> Result<(PairLabels, Vec<String>), TaskError> {
    let tool = entry.tool.as_deref().and_then(|tool| tools.get(tool));
    let tool = tool.ok_or_else(|| TaskError::new(WHAT, "the CAD model of its tool cannot be used"))?;
    let nothing = PairLabels::default();
    let touch = Touch { dataset, pair: entry.id, sample, tool: Ok(tool), labels: &nothing };
    let (mut labels, mut lacking) = (PairLabels::default(), Vec::new());
    for (pad, proposal) in from_cad(touch, models)? {
        match proposal {
            Ok(proposal) => {
                labels.put(&MaskPlace::measured(pad), Some(DrawnMask::new(proposal.mask, proposal.provenance)));
            }
            Err(err) => lacking.push(format!("{} finger: {}", dataset.rig.pad_key(pad), err.why)),
        }
    }
    Ok((labels, lacking))
}

/// Why nothing can be learned from a mask of an imprint.
fn unfit(imprint: &DepthMap, hand: &DrawnMask) -> Option<String> {
    let ([width, height], [w, h]) = (imprint.size(), hand.mask.size());
    let all = |bits: &Mask| bits.as_slice().iter().all(|&bit| bit);
    if [width, height] != [w, h] {
        return Some(format!("the mask is of {w} x {h} pixels, the imprint of {width} x {height}"));
    }
    if imprint.as_slice().iter().all(|v| !v.is_finite()) {
        return Some("nothing of the imprint was measured".into());
    }
    hand.marks.ignored().is_some_and(all).then(|| "all pixels of the mask are ignored".into())
}

/// The imprint that a mask belongs to; a prediction is made again by what decided it.
fn imprint(
    sample: &Sample,
    place: &MaskPlace,
    setup: &TrainSetup,
    models: &Models,
    cx: &JobCx,
) -> Result<DepthMap, TaskError> {
    let touch = sample.pad(place.pad).ok_or_else(|| TaskError::new(WHAT, "the pair has no such finger"))?;
    let ImprintOf::Predicted(of) = &place.of else {
        let depth = touch.depth().ok_or_else(|| TaskError::new(WHAT, "the finger has no imprint"))?;
        return Ok(depth.imprint.clone());
    };
    let unknown = || TaskError::new(WHAT, "what decided the prediction that the mask is of cannot be read");
    let (bundle, config, shift) = of.parts().ok_or_else(unknown)?;
    let known = by_id(&setup.generators, bundle).filter(|known| known.kind == BundleKind::Generator);
    let generator = known
        .ok_or_else(|| TaskError::new(WHAT, "the model whose prediction the mask is of is not among the bundles"))?;
    let ends = generator.ends(&sample.rig).and_then(Result::ok);
    let picture = ends.and_then(|ends| touch.picture(ends.input));
    let picture = picture.ok_or_else(|| TaskError::new(WHAT, "the finger has no picture to predict from"))?;
    let generating = Generating { bundle: generator, engine: setup.engine, config: &config };
    let made = generating.of(models, &[picture], &cx.quiet())?.pop();
    let made = made.ok_or_else(|| TaskError::new(WHAT, "the generator returned no prediction"))?;
    imprint_of(&made, shift, sample, place.pad)
}
