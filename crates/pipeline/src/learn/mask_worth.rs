//! Worth of a mask model where CAD models and true poses are known: [`mask_worth`].

use std::collections::BTreeSet;

use serde::Serialize;

use crate::error::TaskError;
use crate::infer::engine::EngineChoice;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::{ImprintSource, PairLabels};
use crate::masks::propose::{ProposalSource, Proposals, ProposeSetup, propose};
use crate::steps::bundles::BundleInfo;
use crate::steps::estimate::{Estimate, Touch, estimate};
use crate::steps::mask::{MaskChoice, MaskSource};
use crate::steps::models::Models;
use crate::steps::recipe::{Recipe, Stage};
use crate::steps::tool::Tools;
use touch2touch_core::dataset::PairId;
use touch2touch_core::label::agreement;
use touch2touch_core::metrics::AngleSummary;
use touch2touch_core::pose::Registration;
use touch2touch_core::rig::PadId;

/// Worth of a mask model on measured imprints whose tool and true pose are known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MaskWorth {
    /// Grasps that were looked at.
    pub grasps: usize,
    /// Mean over the masks of the pixels in both over the pixels in either: the model's mask, and the one from the CAD
    /// model at the true pose.
    pub iou: f64,
    /// Errors of the in-hand angle that is registered from the model's masks.
    pub angle: AngleSummary,
}

impl MaskWorth {
    /// In words.
    pub fn text(&self) -> String {
        let mean = self.angle.mean_deg.map_or("no pose found".into(), |mean| format!("angle error {mean:.1}°"));
        format!("IoU {:.2} with masks from CAD, {mean}, {:.0} % within 5°", self.iou, self.angle.success_5)
    }
}

/// Masks from the CAD model at the true pose of a touch, for each of its fingers that felt something.
///
/// # Errors
/// If the true pose or the CAD model is not known, or nothing was measured.
pub(super) fn from_cad(touch: Touch<'_>, models: &Models) -> Result<Proposals, TaskError> {
    let recipe = Recipe { hand: false, ..Recipe::default() };
    let estimate = estimate(touch, &recipe, Stage::Imprint, models, &JobCx::unwatched())?;
    let pads: Vec<PadId> = estimate.imprints.entries().map(|(pad, _)| pad).collect();
    let setup = ProposeSetup { source: ProposalSource::CadTruth, recipe, pose: None };
    propose(touch, &estimate, &pads, &setup, models)
}

/// A mask model on pairs; `None` where tool, CAD model or true pose of none of them is known. What people drew plays no part.
///
/// # Errors
/// If the job was told to stop, or the model cannot be run.
pub fn mask_worth(
    dataset: &Dataset,
    pairs: &BTreeSet<PairId>,
    (model, engine, registration): (&BundleInfo, EngineChoice, Registration),
    models: &Models,
    cx: &JobCx,
) -> Result<Option<MaskWorth>, TaskError> {
    const WHAT: &str = "Try the mask model";
    let recipe = Recipe {
        imprint: ImprintSource::Measured,
        mask: MaskChoice { source: MaskSource::Unet, ..MaskChoice::default() },
        mask_model: Some(model.clone().into()),
        hand: false,
        registration,
        engine,
        ..Recipe::default()
    };
    let (mut tools, nothing) = (Tools::new(dataset), PairLabels::default());
    let (mut errors, mut overlaps) = (Vec::new(), Vec::new());
    for (done, &pair) in pairs.iter().enumerate() {
        cx.check(WHAT)?;
        cx.progress(done as u64, pairs.len() as u64, format!("poses by {}", model.name));
        let Some(tool) = dataset.index.get(pair).and_then(|entry| entry.tool.as_deref()) else { continue };
        let (Some(tool), Ok(sample)) = (tools.get(tool), dataset.load(pair)) else { continue };
        let touch = Touch { dataset, pair, sample: &sample, tool: Ok(tool), labels: &nothing };
        let Ok(cad) = from_cad(touch, models) else { continue };
        let estimate = Estimate::new(&recipe).without_verdict().reach(touch, Stage::Pose, models, &cx.quiet())?;
        for (pad, proposal) in cad {
            let (Ok(proposal), Some(found)) = (proposal, estimate.contact().masks[pad].as_ref()) else { continue };
            overlaps.extend(agreement(&found.mask, &proposal.mask).map(|agreed| agreed.iou));
        }
        errors.push(estimate.pose().ok().and_then(|pose| pose.error_rad).unwrap_or(f64::NAN));
    }
    if errors.is_empty() || overlaps.is_empty() {
        return Ok(None);
    }
    let iou = overlaps.iter().sum::<f64>() / overlaps.len() as f64;
    Ok(Some(MaskWorth { grasps: errors.len(), iou, angle: AngleSummary::from_errors(&errors) }))
}
