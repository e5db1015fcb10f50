//! What `label` is asked.

use clap::Args;

use super::super::args::{DatasetArgs, FingerArg, RegistrationParser, keyed};
use super::super::contact_mask::MaskArgs;
use super::super::pose::parse_start;
use super::super::predict::ModelArgs;
use super::super::{Common, ToolArgs};
use crate::domain::frames::PlanarPose;
use crate::domain::pose::RegistrationChoice;
use crate::work::labels::{ImprintSource, Review};

/// Arguments of `label`.
#[derive(Debug, Args)]
pub(in super::super) struct LabelArgs {
    #[command(flatten)]
    pub(super) dataset: DatasetArgs,
    /// The pair to label, by its name or a part of it that no other has; without it, all labels are listed.
    #[arg(long)]
    pub(super) pair: Option<String>,
    /// Set the review state.
    #[arg(long, requires = "pair", value_parser = keyed::<Review>())]
    pub(super) review: Option<Review>,
    /// Accept the pose of this imprint: what the registration answers, or `--pose`.
    #[arg(long, value_name = "IMPRINT", requires = "pair", value_parser = keyed::<ImprintSource>())]
    pub(super) accept: Option<ImprintSource>,
    /// The pose to accept instead: `DEGREES,Y_MM,Z_MM` of the tool in the hand, such as `10,0,-2`.
    #[arg(long, value_name = "DEG,MM,MM", requires = "accept", value_parser = parse_start, allow_hyphen_values = true)]
    pub(super) pose: Option<PlanarPose>,
    /// Withdraw the accepted pose of this imprint.
    #[arg(long, value_name = "IMPRINT", requires = "pair", value_parser = keyed::<ImprintSource>())]
    pub(super) withdraw: Option<ImprintSource>,
    /// Make the mask of `--mask` the corrected one.
    #[arg(long, requires = "pair", conflicts_with = "remove_mask")]
    pub(super) adopt: bool,
    /// Fill the holes of the mask.
    #[arg(long, requires = "pair", conflicts_with = "remove_mask")]
    pub(super) fill_holes: bool,
    /// Keep only the largest connected part of the mask.
    #[arg(long, requires = "pair", conflicts_with = "remove_mask")]
    pub(super) largest_island: bool,
    /// Remove the corrected mask: the automatic source is in force again.
    #[arg(long, requires = "pair")]
    pub(super) remove_mask: bool,
    /// Whose mask is changed: the name of one, or `both`.
    #[arg(long, default_value = "both")]
    pub(super) finger: FingerArg,
    /// The imprint that masks are made from.
    #[arg(long, default_value = ImprintSource::Measured.key(), value_parser = keyed::<ImprintSource>())]
    pub(super) imprint: ImprintSource,
    /// The registration.
    #[arg(long, default_value_t = RegistrationChoice::default(), value_parser = RegistrationParser)]
    pub(super) engine: RegistrationChoice,
    #[command(flatten)]
    pub(super) mask: MaskArgs,
    #[command(flatten)]
    pub(super) tool: ToolArgs,
    #[command(flatten)]
    pub(super) model: ModelArgs,
    #[command(flatten)]
    pub(super) common: Common,
}
