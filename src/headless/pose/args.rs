//! The arguments of `pose`.

use clap::builder::{PossibleValue, TypedValueParser};
use clap::{Args, ValueEnum};
use strum::IntoEnumIterator as _;

use super::super::args::{DatasetArgs, LimitArgs, RegistrationParser};
use super::super::contact_mask::MaskArgs;
use super::super::recipe::ModelArgs;
use super::super::{Common, ToolArgs};
use touch2touch_core::align::{LabIcpConfig, PaperTrap, Register, lab_starts};
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
    /// The registration: the key of one, `default`, `lab` (the paper's), or `all`, one after the other. A key may be
    /// followed by `:gate=MM`, beyond which contacts are let go (for `distance_field`).
    #[arg(long = "engine", value_name = "ENGINE", default_value = "default", value_parser = RegistrationsParser)]
    pub(super) registration: Registrations,
    /// Start here instead of where the registration would: `DEGREES,Y_MM,Z_MM` of the tool in the hand, such as
    /// `10,0,-2`. Repeat for several.
    #[arg(long = "start", value_name = "DEG,MM,MM", value_parser = parse_start, allow_hyphen_values = true)]
    pub(super) starts: Vec<PlanarPose>,
    /// Give the paper's registration its ten random starts, drawn from this seed.
    #[arg(long, value_name = "SEED", conflicts_with = "starts")]
    pub(super) paper_starts: Option<u64>,
    /// Switch on a trap of the paper's registration: `wrong-frame` (starts are applied in the wrong frame),
    /// `rmse-choice` (chosen by model-to-contact distance within 15 mm), `fixed-iterations` (no stop test).
    /// Repeat for several.
    #[arg(long = "paper-trap", value_name = "TRAP", value_parser = parse_trap)]
    pub(super) paper_traps: Vec<PaperTrap>,
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

/// Reads a registration, or one of the short names; lists them all in the help.
#[derive(Debug, Clone, Copy)]
pub(in crate::headless) struct RegistrationsParser;

impl TypedValueParser for RegistrationsParser {
    type Value = Registrations;

    fn parse_ref(
        &self,
        cmd: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<Registrations, clap::Error> {
        Ok(Registrations(match value.to_str() {
            Some("default") => vec![Registration::default()],
            Some("lab") => vec![Registration::LabIcp],
            Some("all") => Registration::iter().collect(),
            _ => vec![RegistrationParser.parse_ref(cmd, arg, value)?],
        }))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let names = [
            PossibleValue::new("default").help("The same as joint"),
            PossibleValue::new("lab").help("The same as lab_icp"),
            PossibleValue::new("all").help("All of the following, one after the other"),
        ];
        Some(Box::new(names.into_iter().chain(RegistrationParser.possible_values()?)))
    }
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

pub(super) fn parse_trap(text: &str) -> Result<PaperTrap, String> {
    text.parse().map_err(|_| {
        let names: Vec<&'static str> = PaperTrap::iter().map(Into::into).collect();
        format!("the traps are {}", names.join(", "))
    })
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

/// The registration as the arguments want it.
pub(super) fn registration(args: &PoseArgs, choice: Registration) -> Box<dyn Register> {
    if choice != Registration::LabIcp {
        return choice.method();
    }
    let mut config = LabIcpConfig { traps: args.paper_traps.clone(), ..LabIcpConfig::default() };
    if let Some(seed) = args.paper_starts {
        config.starts = lab_starts(seed);
    }
    Box::new(config)
}
