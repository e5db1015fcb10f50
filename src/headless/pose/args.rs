//! The arguments of `pose`.

use std::str::FromStr;

use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use strum::IntoEnumIterator as _;

use super::super::args::{DatasetArgs, LimitArgs, Listed, listed};
use super::super::contact_mask::MaskArgs;
use super::super::recipe::ModelArgs;
use super::super::{Common, ToolArgs};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::pose::Registration;
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::steps::recipe::Recipe;

/// Arguments of `pose`.
#[derive(Debug, Args)]
pub(in crate::headless) struct PoseArgs {
    #[command(flatten)]
    pub(super) dataset: DatasetArgs,
    /// Imprints to align.
    #[arg(long, value_enum, default_value_t = Imprints::Measured)]
    pub(super) imprint: Imprints,
    #[command(flatten)]
    pub(super) mask: MaskArgs,
    /// Align another tool's CAD model than the pair's own: a tool of the data set, or `any`, which tries them all, answers
    /// with the likeliest and lists the others.
    #[arg(long = "tool", value_name = "NAME")]
    pub(super) which: Option<String>,
    #[command(flatten)]
    pub(super) tool: ToolArgs,
    /// The registration. `distance_field` may be followed by `:gate=MM`, beyond which contacts are let go.
    #[arg(long = "engine", value_name = "ENGINE", default_value = "joint", value_parser = registrations())]
    pub(super) registration: Registrations,
    /// Start here instead of where the registration would: `DEGREES,Y_MM,Z_MM` of the tool in the hand, such as
    /// `10,0,-2`. Repeat for several.
    #[arg(long = "start", value_name = "DEG,MM,MM", value_parser = parse_start, allow_hyphen_values = true)]
    pub(super) starts: Vec<PlanarPose>,
    /// Only this pair, by its name or a part of it that no other has.
    #[arg(long, conflicts_with = "limit")]
    pub(super) pair: Option<String>,
    #[command(flatten)]
    pub(super) limit: LimitArgs,
    /// Add the whole registration report to each case of the JSON: every start and iteration, and each point's
    /// residual, weight and fate.
    #[arg(long)]
    pub(super) trace: bool,
    #[command(flatten)]
    pub(super) model: ModelArgs,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Imprints {
    Measured,
    Predicted,
    Both,
}

/// The registrations to run, in this order.
#[derive(Debug, Clone)]
pub(in crate::headless) struct Registrations(pub(in crate::headless) Vec<Registration>);

impl FromStr for Registrations {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(Self(if text == "all" { Registration::iter().collect() } else { vec![text.parse()?] }))
    }
}

impl Registrations {
    /// The only one.
    pub(in crate::headless) fn one(&self) -> anyhow::Result<Registration> {
        match self.0.as_slice() {
            [registration] => Ok(*registration),
            _ => anyhow::bail!("--engine all is for `touch2touch pose`; one registration is needed here"),
        }
    }
}

/// Parser of them.
pub(in crate::headless) fn registrations() -> Listed<Registrations> {
    listed(|| {
        let one = Registration::iter().map(|by| PossibleValue::new(by.key()).help(by.description()));
        one.chain([PossibleValue::new("all").help("All of them, one after the other")]).collect()
    })
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
        return Err(format!("no hand holds a tool so: at most {MAX_DEG} degrees and {MAX_MM} mm either way"));
    }
    Ok(PlanarPose { theta_rad: degrees.to_radians(), y_m: y_mm * 1e-3, z_m: z_mm * 1e-3 })
}

impl PoseArgs {
    /// The recipe of the predicted imprints if they are asked for, else of the measured ones; with the first registration.
    pub(in crate::headless) fn recipe(&self, rig: &Rig) -> anyhow::Result<Recipe> {
        let imprint = match self.imprint {
            Imprints::Measured => ImprintSource::Measured,
            Imprints::Predicted | Imprints::Both => ImprintSource::Predicted,
        };
        self.model.posed(imprint, rig, &self.mask, self.registration.0[0])
    }
}
