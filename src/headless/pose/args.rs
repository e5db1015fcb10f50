//! The arguments of `pose`.

use clap::Args;

use super::super::args::{DatasetArgs, PairArgs, keyed};
use super::super::recipe::RecipeArgs;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::steps::recipe::Recipe;
use touch2touch_pipeline::still::space::SpacePane;

/// Arguments of `pose`.
#[derive(Debug, Args)]
pub(in crate::headless) struct PoseArgs {
    #[command(flatten)]
    pub(super) dataset: DatasetArgs,
    /// Imprints to use.
    #[arg(long, value_parser = keyed::<SpacePane>(), default_value = "measured")]
    pub(super) imprint: SpacePane,
    /// Use the CAD model of another tool: a tool of the data set, or `any`, which tries all, takes the most likely and
    /// lists the others.
    #[arg(long = "tool", value_name = "NAME")]
    pub(super) which: Option<String>,
    /// Start here instead of where the registration would: `DEGREES,Y_MM,Z_MM` of the tool in the hand, such as
    /// `10,0,-2`. Repeat for several.
    #[arg(long = "start", value_name = "DEG,MM,MM", value_parser = parse_start, allow_hyphen_values = true)]
    pub(super) starts: Vec<PlanarPose>,
    #[command(flatten)]
    pub(super) pairs: PairArgs,
    /// Add the whole registration report to each case of the JSON: every start and iteration, and each point's
    /// residual, weight and fate.
    #[arg(long)]
    pub(super) trace: bool,
    #[command(flatten)]
    pub(super) recipe: RecipeArgs,
}

/// Largest angle and shift of a pose that is named: whole turns and a meter say a unit is wrong.
const MAX_DEG: f64 = 360.0;
const MAX_MM: f64 = 1000.0;

pub(in crate::headless) fn parse_start(text: &str) -> Result<PlanarPose, String> {
    let numbers: Vec<f64> =
        text.split(',').filter_map(|n| n.trim().parse().ok()).filter(|n: &f64| n.is_finite()).collect();
    let (&[degrees, y_mm, z_mm], 3) = (numbers.as_slice(), text.split(',').count()) else {
        return Err("three numbers are needed: degrees, millimeters along y, millimeters along z".to_owned());
    };
    if degrees.abs() > MAX_DEG || y_mm.abs() > MAX_MM || z_mm.abs() > MAX_MM {
        return Err(format!("out of range: at most {MAX_DEG} degrees and {MAX_MM} mm either way"));
    }
    Ok(PlanarPose { theta_rad: degrees.to_radians(), y_m: y_mm * 1e-3, z_m: z_mm * 1e-3 })
}

impl PoseArgs {
    /// The recipe of the predicted imprints if they are asked for, else of the measured ones; with the first registration.
    pub(in crate::headless) fn recipe(&self, rig: &Rig) -> anyhow::Result<Recipe> {
        let imprint = self.imprint.farthest();
        self.recipe.model.posed(imprint, rig, &self.recipe.mask, self.recipe.registration.all()?[0])
    }
}
