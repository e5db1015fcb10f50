//! Arguments of `label`.

use std::path::PathBuf;

use clap::Args;

use super::super::args::{DatasetArgs, keyed};
use super::super::pose::parse_start;
use super::super::recipe::RecipeArgs;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::label::{CleanUp, Drawing};
use touch2touch_pipeline::labels::{ImprintSource, Review};
use touch2touch_pipeline::masks::propose::ProposalSource;

/// Arguments of `label`.
#[derive(Debug, Args)]
pub(in super::super) struct LabelArgs {
    #[command(flatten)]
    pub(super) dataset: DatasetArgs,
    /// The pair to label, by its name or a unique part of it; without it, all labels are listed.
    #[arg(long)]
    pub(super) pair: Option<String>,
    /// Set the review state.
    #[arg(long, requires = "pair", value_parser = keyed::<Review>())]
    pub(super) review: Option<Review>,
    /// Write a note about the pair; an empty one removes it.
    #[arg(long, value_name = "TEXT", requires = "pair")]
    pub(super) note: Option<String>,
    /// Save a pose for this imprint: the registered one, or `--pose`.
    #[arg(long, value_name = "IMPRINT", requires = "pair", value_parser = keyed::<ImprintSource>())]
    pub(super) accept: Option<ImprintSource>,
    /// The pose to accept instead, or that of `--propose cad_hand`: `DEGREES,Y_MM,Z_MM` of the tool in the hand, such as
    /// `10,0,-2`.
    #[arg(long, value_name = "DEG,MM,MM", requires = "pair", value_parser = parse_start, allow_hyphen_values = true)]
    pub(super) pose: Option<PlanarPose>,
    /// Withdraw the accepted pose of this imprint.
    #[arg(long, value_name = "IMPRINT", requires = "pair", value_parser = keyed::<ImprintSource>())]
    pub(super) withdraw: Option<ImprintSource>,
    /// Copy the automatic mask of `--mask` as the hand-drawn one.
    #[arg(long, requires = "pair", conflicts_with = "remove_mask")]
    pub(super) adopt: bool,
    /// Propose a mask and accept it: what was painted by hand stays, unless `--over-drawn`. Numbers of it
    /// are those of `--mask`, such as `--mask cad:mm=1`.
    #[arg(long, value_name = "SOURCE", requires = "pair", conflicts_with_all = ["adopt", "remove_mask"], value_parser = keyed::<ProposalSource>())]
    pub(super) propose: Option<ProposalSource>,
    /// Let the proposal also replace hand-drawn pixels.
    #[arg(long, requires = "propose")]
    pub(super) over_drawn: bool,
    /// Clean up the mask: `fill_holes`, `largest_island`, or with a size in millimeters `smooth=MM`, `grow=MM`, `shrink=MM`.
    /// Several are done in turn.
    #[arg(long, value_name = "WHAT[=MM]", requires = "pair", conflicts_with = "remove_mask")]
    pub(super) clean: Vec<CleanUp>,
    /// Draw on the mask: `{"tool": "lasso", "paint": "contact", "points": [[X, Y], ...]}` in image pixels; tools are
    /// `brush` (`radius_px`), `lasso`, `polygon`, `rectangle` and `wand` (`tolerance_m`), they paint `contact`, `free` or
    /// `ignore`. Several are done in turn, before clean-ups. With a `sight` (`clip_from_grasp`, `size_px`, `layers`: `front`
    /// or `all`), points are pixels of that picture of the points in space, as a drawing in 3D has it in the journal.
    #[arg(long, value_name = "JSON", requires = "pair", conflicts_with = "remove_mask")]
    pub(super) draw: Vec<Drawing>,
    /// Remove the hand-drawn mask and go back to the automatic one.
    #[arg(long, requires = "pair")]
    pub(super) remove_mask: bool,
    /// Take in labels that the studio saved to this folder because it could not write them beside the data. Masks that changed
    /// meanwhile are merged by pixel.
    #[arg(long, value_name = "FOLDER", conflicts_with = "pair")]
    pub(super) take_in: Option<PathBuf>,
    /// Name of the person who labels (default: the user of this computer).
    #[arg(long, requires = "pair")]
    pub(super) person: Option<String>,
    /// The finger whose mask is changed: its name, or `both`.
    #[arg(long, default_value = "both")]
    pub(super) finger: String,
    /// The imprint whose mask is changed. A prediction is the one that `--bundle`, `--seed` and the like name.
    #[arg(long, default_value = ImprintSource::Measured.key(), value_parser = keyed::<ImprintSource>())]
    pub(super) imprint: ImprintSource,
    #[command(flatten)]
    pub(super) recipe: RecipeArgs,
}
