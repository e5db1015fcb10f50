//! The options that say where contact masks come from, and the mask they name.

use clap::{Args, ValueEnum};

use super::predict::Predictor;
use crate::app::jobs::compute;
use crate::app::keys::MaskRecipe;
use crate::domain::contact::LAB_CAD_DISTANCE_M;
use crate::domain::frames::PlanarPose;
use crate::domain::grid::{DepthMap, Mask};
use crate::domain::pose::ToolModel;
use crate::domain::sample::PadTouch;

/// Where masks come from.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct MaskArgs {
    /// Where the contact masks come from. `auto`: the CAD model at the true pose for measured imprints whose truth is
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

/// The mask of one imprint, by the studio's own functions. `truth` is `grasp_from_object`; `auto` means the mask model here.
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
) -> anyhow::Result<Mask> {
    let recipe = match source {
        MaskFrom::Unet | MaskFrom::Auto => return predictor.mask(imprint),
        MaskFrom::Threshold => MaskRecipe::Threshold((args.threshold_mm / 1e3).into()),
        MaskFrom::Truth => MaskRecipe::Truth,
        MaskFrom::Cad => MaskRecipe::Cad((LAB_CAD_DISTANCE_M as f32).into()),
    };
    compute::mask(&recipe, imprint, Some(touch), tool, truth).map_err(|err| anyhow::anyhow!("{err}"))
}
