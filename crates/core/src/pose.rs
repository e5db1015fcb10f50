//! Contact points to the tool's pose by one of the registrations.

use std::str::FromStr;

use serde::{Deserialize, Serialize};
use strum::IntoEnumIterator as _;

use super::align::{
    AlignConfig, AlignError, AlignReport, Ask, Contacts, Evidence, JointConfig, LabIcp, Range, Register, Scene,
};

pub use super::tool::{ToolError, ToolModel};

/// Gates that can be chosen, meters.
const GATE_M: std::ops::RangeInclusive<f64> = 1e-5..=0.05;

/// Gate of the registration on the distance field: beyond it contacts are let go, gradually. A whole number of nanometers is
/// the same number in a key, in a text and in the arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Gate {
    nm: u32,
}

impl Gate {
    /// A gate from its length, meters.
    ///
    /// # Errors
    /// If it is not a length that makes sense.
    pub fn new(distance_m: f64) -> Result<Self, String> {
        if GATE_M.contains(&distance_m) {
            return Ok(Self { nm: (distance_m * 1e9).round() as u32 });
        }
        Err(format!("a gate must be between {} and {} mm", GATE_M.start() * 1e3, GATE_M.end() * 1e3))
    }

    /// Length, meters.
    pub fn meters(self) -> f64 {
        f64::from(self.nm) / 1e9
    }

    /// Length, millimeters.
    pub fn millimeters(self) -> f64 {
        f64::from(self.nm) / 1e6
    }
}

/// Registration that answers. As text its key, with `:gate=MM` behind it where another gate was chosen: `joint`, `joint:range=180,40`,
/// `distance_field:gate=1.5`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[derive(Serialize, Deserialize, strum::EnumIter, strum::IntoStaticStr)]
#[serde(try_from = "String", into = "String")]
#[strum(serialize_all = "snake_case")]
pub enum Registration {
    /// The membranes' images against the tent over the tool, and the mask; among these poses.
    Joint(Range),
    /// Robust registration on the distance field of the tool's silhouette, with another gate than its own where one is named.
    DistanceField(Option<Gate>),
    /// The lab's planar point-to-point loop.
    LabIcp,
}

impl Default for Registration {
    fn default() -> Self {
        Self::Joint(Range::default())
    }
}

impl Registration {
    /// Name in settings, files and on the command line, such as `distance_field`, without a gate.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// Name for people, with the gate or the range that was chosen.
    pub fn label(self) -> String {
        match self {
            Self::Joint(range) if range == Range::default() => "Joint (membrane and mask)".to_owned(),
            Self::Joint(range) => format!("Joint (membrane and mask), range {range}"),
            Self::DistanceField(None) => "ICP (distance field)".to_owned(),
            Self::DistanceField(Some(gate)) => format!("ICP (distance field), gate {} mm", gate.millimeters()),
            Self::LabIcp => "ICP (paper)".to_owned(),
        }
    }

    /// Description of its method, in one line.
    pub fn description(self) -> &'static str {
        match self {
            Self::DistanceField(_) => "The mask alone: robust least squares on the distance field of the silhouette",
            Self::Joint(_) => {
                "The default: the whole membrane against the sheet that the tool would lift, with the mask as a weaker term"
            }
            Self::LabIcp => "The paper's loop: planar point to point, one start, up to 200 iterations, no rejection",
        }
    }

    /// The registration with its own gate.
    pub fn with_own_gate(self) -> Self {
        if let Self::DistanceField(_) = self { Self::DistanceField(None) } else { self }
    }

    /// The registration with another gate.
    ///
    /// # Errors
    /// If it has none.
    pub fn with_gate(self, gate: Gate) -> Result<Self, String> {
        match self {
            Self::DistanceField(_) => Ok(Self::DistanceField(Some(gate))),
            _ => {
                let (label, key) = (self.label(), Self::DistanceField(None).key());
                Err(format!("{label} has no gate: it takes all contacts; one that has is {key}"))
            }
        }
    }

    /// The registration among more poses.
    ///
    /// # Errors
    /// If it has no range.
    pub fn with_range(self, range: Range) -> Result<Self, String> {
        match self {
            Self::Joint(_) => Ok(Self::Joint(range)),
            _ => Err(format!("{} has no range; one that has is {}", self.label(), Self::default().key())),
        }
    }

    /// The registration with the settings that the product uses, apart from the gate.
    pub fn method(self) -> Box<dyn Register> {
        match self {
            Self::Joint(range) => Box::new(JointConfig { range }),
            Self::DistanceField(gate) => {
                let mut config = AlignConfig::default();
                if let Some(gate) = gate {
                    config.kernels_m.retain(|wider| *wider > gate.meters());
                    config.kernels_m.push(gate.meters());
                }
                Box::new(config)
            }
            Self::LabIcp => Box::new(LabIcp),
        }
    }
}

impl std::fmt::Display for Registration {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.key())?;
        match self {
            Self::DistanceField(Some(gate)) => write!(f, ":gate={}", gate.millimeters()),
            Self::Joint(range) if *range != Range::default() => write!(f, ":range={range}"),
            _ => Ok(()),
        }
    }
}

impl FromStr for Registration {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, rest) = text.split_once(':').map_or((text, None), |(key, rest)| (key, Some(rest)));
        let by = Self::iter().find(|by| by.key() == key).ok_or_else(|| {
            let keys: Vec<_> = Self::iter().map(Self::key).collect();
            format!("unknown registration {key:?}; choose from {}", keys.join(", "))
        })?;
        let Some(rest) = rest else { return Ok(by) };
        if let Some(range) = rest.strip_prefix("range=") {
            return by.with_range(range.parse()?);
        }
        let mm = rest.strip_prefix("gate=");
        let mm =
            mm.ok_or_else(|| format!("{text:?}: a registration is followed by nothing, :gate=MM or :range=DEG,MM"))?;
        let mm: f64 = mm.parse().map_err(|_| format!("{mm:?} is not a number"))?;
        by.with_gate(Gate::new(mm / 1e3)?)
    }
}

impl TryFrom<String> for Registration {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Registration> for String {
    fn from(registration: Registration) -> Self {
        registration.to_string()
    }
}

/// Contact points (grasp frame, meters), with the images of the membranes where they are known, to the tool's pose: what
/// every caller ends in. `record` keeps per-iteration states and per-point residuals.
///
/// # Errors
/// [`AlignError`] for too few points or none near the tool.
pub fn register<'a>(
    contacts: impl Into<Contacts<'a>>,
    tool: &ToolModel,
    engine: Registration,
    record: bool,
) -> Result<AlignReport, AlignError> {
    register_with(&*engine.method(), contacts, tool, Ask { record, ..Ask::default() })
}

/// Registers with a registration of any settings.
///
/// # Errors
/// As [`register`], and for settings that make no sense.
pub fn register_with<'a>(
    registration: &dyn Register,
    contacts: impl Into<Contacts<'a>>,
    tool: &ToolModel,
    ask: Ask<'_>,
) -> Result<AlignReport, AlignError> {
    let scene = Scene::new(contacts);
    let mut report = registration.run(&scene, tool, ask)?;
    if ask.evidence {
        Evidence::gather(&scene, tool, &mut report);
    }
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::testing::{cross, cross_contacts};
    use crate::frames::PlanarPose;

    #[test]
    fn what_is_written_is_read_and_what_cannot_be_done_is_refused() {
        let gated = Registration::DistanceField(Some(Gate::new(0.0003).unwrap()));
        let ranged = Registration::default().with_range("180,40".parse().unwrap()).unwrap();
        for by in Registration::iter().chain([gated, ranged]) {
            assert_eq!(by.to_string().parse(), Ok(by));
            let json = serde_json::to_string(&by).unwrap();
            assert_eq!(serde_json::from_str::<Registration>(&json).unwrap(), by);
        }
        assert_eq!(gated.to_string(), "distance_field:gate=0.3");
        for (text, word) in [
            ("nearest", "unknown registration"),
            ("distance_field:gate=0", "between 0.01 and 50 mm"),
            ("distance_field:gate=NaN", "between 0.01 and 50 mm"),
            ("distance_field:gate=", "not a number"),
            ("distance_field:keep=3", "followed by"),
            ("lab_icp:gate=1", "has no gate"),
            ("lab_icp:range=90,10", "has no range"),
            ("joint:range=200,10", "to 180 degrees"),
            ("joint:range=10,10", "22.5 to"),
        ] {
            let why = text.parse::<Registration>().unwrap_err();
            assert!(why.contains(word), "{text}: {why}");
        }
    }

    #[test]
    fn the_own_gate_changes_no_bit_and_another_one_the_answer() {
        let tool = ToolModel::new(cross()).unwrap();
        let pose = PlanarPose { theta_rad: 0.2, y_m: 0.002, z_m: -0.001 };
        let yz = cross_contacts(600, pose, 2e-3, 5);
        let points: Vec<_> =
            yz.iter().enumerate().map(|(i, p)| glam::DVec3::new((i % 7) as f64 * 1e-3, p.x, p.y)).collect();
        let by = Registration::DistanceField(None);
        let own = register(&points, &tool, by, false).unwrap();
        let with = |gate_m: f64| {
            let by = by.with_gate(Gate::new(gate_m).unwrap()).unwrap();
            register(&points, &tool, by, false).unwrap()
        };
        let gate_m = AlignConfig::default().final_kernel_m();
        assert_eq!(with(gate_m), own);
        assert_ne!(with(gate_m / 4.0).grasp_from_object, own.grasp_from_object);
    }
}
