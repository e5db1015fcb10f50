//! The options that say where contact masks come from, and the mask they name.

use clap::{Args, ValueEnum};

use super::predict::Predictor;
use crate::domain::contact::{ContactMask, LAB_CAD_DISTANCE_M};
use crate::domain::frames::PlanarPose;
use crate::domain::grid::{DepthMap, Mask};
use crate::domain::pose::ToolModel;
use crate::domain::rig::{PadId, PerPad, Rig};
use crate::domain::sample::PadTouch;
use crate::work::mask::{self, MaskRecipe};

/// Where masks come from.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct MaskArgs {
    /// Where the contact masks come from. A flat imprint has no contact whatever the source; where the mask UNet finds none
    /// in an imprint that is clearly not flat, depth decides (`mask` in the JSON says so). `auto`: the CAD model at the true pose for measured imprints whose truth is
    /// known (the lab's labels, an upper bound), else the mask UNet.
    #[arg(long, value_enum, default_value_t = MaskFrom::Auto)]
    pub mask: MaskFrom,
    /// Imprint depth from which a pixel counts as contact, for `--mask threshold`.
    #[arg(long, default_value_t = 7.0)]
    pub threshold_mm: f32,
}

/// A source of masks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum MaskFrom {
    /// The best that is there.
    Auto,
    /// Points within 1 mm of the CAD model at the true pose.
    Cad,
    /// The mask model.
    Unet,
    /// Imprint depth above a threshold.
    Threshold,
    /// The simulator's truth.
    Truth,
}

impl MaskFrom {
    /// The key in the JSON.
    pub(super) fn key(self) -> &'static str {
        match self {
            MaskFrom::Auto => "auto",
            MaskFrom::Cad => "cad",
            MaskFrom::Unet => "unet",
            MaskFrom::Threshold => "threshold",
            MaskFrom::Truth => "truth",
        }
    }
}

/// The mask of one imprint, by the studio's own functions, and what it is made of. `truth` is `grasp_from_object`; `auto`
/// means the mask model here.
///
/// # Errors
/// In words, if what the source needs is not there.
pub(super) fn contact_mask(
    source: MaskFrom,
    args: &MaskArgs,
    imprint: &DepthMap,
    touch: &PadTouch,
    tool: Option<&ToolModel>,
    truth: Option<PlanarPose>,
    predictor: &mut Predictor,
) -> anyhow::Result<ContactMask> {
    let recipe = match source {
        MaskFrom::Unet | MaskFrom::Auto => return predictor.mask(imprint),
        MaskFrom::Threshold => MaskRecipe::Threshold((args.threshold_mm / 1e3).into()),
        MaskFrom::Truth => MaskRecipe::Truth,
        MaskFrom::Cad => MaskRecipe::Cad((LAB_CAD_DISTANCE_M as f32).into()),
    };
    Ok(mask::mask(&recipe, imprint, Some(touch), tool, truth)?)
}

/// The masks of both fingers, with what is to be said about them.
pub(super) struct FingerMasks {
    /// Per finger.
    pub masks: PerPad<Mask>,
    /// What they are made of: the key of the source, `depth` where the model found nothing, `flat` where there is no
    /// contact; of both fingers (right, left) where they differ.
    pub made_of: String,
    /// The same in words, where it is not the source that was asked.
    pub notes: Vec<String>,
}

impl FingerMasks {
    /// From the masks that `source` gave.
    pub(super) fn new(source: MaskFrom, rig: &Rig, found: PerPad<ContactMask>) -> Self {
        let mut keys: Vec<&'static str> = found.iter().flatten().map(|m| m.basis.key(source.key())).collect();
        keys.dedup();
        let made_of = if keys.is_empty() { source.key().to_owned() } else { keys.join(", ") };
        let note =
            |(f, found): (PadId, &ContactMask)| Some(format!("{} finger: {}", rig.pad_key(f), found.basis.note()?));
        let notes = found.entries().filter_map(note).collect();
        Self { masks: found.map(|m| m.map(|m| m.mask)), made_of, notes }
    }
}
