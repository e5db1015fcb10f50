//! [`RegistrationChoice`]: a registration, and which contacts it leaves out where that was chosen.

use std::str::FromStr;

use serde::{Deserialize, Serialize};
use strum::IntoEnumIterator as _;

use super::Registration;
use crate::align::icp::Rejector;
use crate::align::{AlignConfig, IcpConfig, JointConfig, LabIcpConfig, RefineConfig, Register};

/// Gates that can be chosen, meters.
const GATE_M: std::ops::RangeInclusive<f64> = 1e-5..=0.05;
/// Shares of the contacts that can be trimmed.
const TRIM: std::ops::RangeInclusive<f64> = 0.0..=0.9;

/// Rejection: which contacts a registration leaves out. A whole number of nanometers or of millionths is the same
/// number in a key, in a text and in the arithmetic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rejection {
    /// As the registration does by itself.
    #[default]
    Own,
    /// Contacts farther than so many nanometers from the model. The registrations on the distance field let them go
    /// gradually: for them it is the width of the last kernel.
    Gate(u32),
    /// The farthest, so many of a million.
    Trim(u32),
}

impl Rejection {
    /// A gate in meters.
    ///
    /// # Errors
    /// If it is not a length that makes sense.
    pub fn gate(distance_m: f64) -> Result<Self, String> {
        if GATE_M.contains(&distance_m) {
            return Ok(Self::Gate((distance_m * 1e9).round() as u32));
        }
        Err(format!("a gate must be between {} and {} mm", GATE_M.start() * 1e3, GATE_M.end() * 1e3))
    }

    /// A share that is left out.
    ///
    /// # Errors
    /// If it is not a share, or would leave too little.
    pub fn trim(share: f64) -> Result<Self, String> {
        if TRIM.contains(&share) {
            return Ok(Self::Trim((share * 1e6).round() as u32));
        }
        Err(format!("the share that is trimmed must be between {} and {}", TRIM.start(), TRIM.end()))
    }

    /// The number: meters of a gate, the share of a trim.
    pub fn number(self) -> Option<f64> {
        match self {
            Self::Own => None,
            Self::Gate(nm) => Some(f64::from(nm) / 1e9),
            Self::Trim(millionths) => Some(f64::from(millionths) / 1e6),
        }
    }

    fn on_field(self, mut config: AlignConfig) -> AlignConfig {
        if let (Self::Gate(_), Some(width_m)) = (self, self.number()) {
            config.kernels_m.retain(|wider| *wider > width_m);
            config.kernels_m.push(width_m);
        }
        config
    }

    fn on_pairs(self, config: IcpConfig) -> IcpConfig {
        let rejector = match (self, self.number()) {
            (Self::Gate(_), Some(distance_m)) => Rejector::MaxDistance { distance_m },
            (Self::Trim(_), Some(share)) => Rejector::Trimmed { keep: 1.0 - share },
            _ => config.rejector,
        };
        IcpConfig { rejector, ..config }
    }
}

/// A registration, and which contacts it leaves out where that was chosen. As text its key, `:gate=MM` or `:trim=SHARE`:
/// `gicp`, `gicp:gate=1.5`, `point_to_point:trim=0.2`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct RegistrationChoice {
    /// The registration.
    pub by: Registration,
    /// Contacts that it leaves out.
    pub rejection: Rejection,
}

impl From<Registration> for RegistrationChoice {
    fn from(by: Registration) -> Self {
        Self { by, rejection: Rejection::Own }
    }
}

impl RegistrationChoice {
    /// A registration with a rejection that it can do.
    ///
    /// # Errors
    /// Why it cannot.
    pub fn new(by: Registration, rejection: Rejection) -> Result<Self, String> {
        let names = |can: fn(Registration) -> bool| {
            Registration::iter().filter(|r| can(*r)).map(Registration::key).collect::<Vec<_>>().join(", ")
        };
        match rejection {
            Rejection::Trim(_) if !by.can_trim() => {
                let why = format!("{} does not trim: it weighs all contacts", by.label());
                Err(format!("{why}; those that can are {}", names(Registration::can_trim)))
            }
            Rejection::Gate(_) if !by.has_gate() => {
                let why = format!("{} has no gate: it takes all contacts", by.label());
                Err(format!("{why}; those that can are {}", names(Registration::has_gate)))
            }
            rejection => Ok(Self { by, rejection }),
        }
    }

    /// The name for people, with what is left out.
    pub fn label(self) -> String {
        let name = self.by.label();
        match (self.rejection, self.rejection.number()) {
            (Rejection::Gate(_), Some(m)) => format!("{name}, gate {} mm", m * 1e3),
            (Rejection::Trim(_), Some(share)) => format!("{name}, {} % trimmed", share * 100.0),
            _ => name.to_owned(),
        }
    }

    /// The registration with the settings that the product uses, apart from what is left out.
    pub fn method(self) -> Box<dyn Register> {
        let rejection = self.rejection;
        match self.by {
            Registration::DistanceField => Box::new(rejection.on_field(AlignConfig::default())),
            Registration::Certified => Box::new(rejection.on_field(AlignConfig::certified())),
            Registration::Joint => Box::new(JointConfig::default()),
            Registration::JointCertified => Box::new(JointConfig::certified()),
            Registration::LabIcp => Box::new(LabIcpConfig::default()),
            Registration::Refined => {
                let RefineConfig { planar, space } = RefineConfig::default();
                Box::new(RefineConfig { planar, space: rejection.on_pairs(space) })
            }
            by => Box::new(rejection.on_pairs(by.icp().unwrap_or_default())),
        }
    }
}

impl Registration {
    /// Settings of a registration that is put together as an ICP; `None` for the others.
    fn icp(self) -> Option<IcpConfig> {
        match self {
            Self::DistanceField
            | Self::Certified
            | Self::Joint
            | Self::JointCertified
            | Self::LabIcp
            | Self::Refined => None,
            Self::PlanarPointToPoint => Some(IcpConfig::planar_point_to_point()),
            Self::PlanarPointToPlane => Some(IcpConfig::planar_point_to_plane()),
            Self::PlanarGicp => Some(IcpConfig::planar_gicp()),
            Self::PointToPoint => Some(IcpConfig::point_to_point()),
            Self::PointToPlane => Some(IcpConfig::point_to_plane()),
            Self::Gicp => Some(IcpConfig::gicp()),
        }
    }

    /// True where it compares with the silhouette's field rather than with model points.
    pub fn uses_field(self) -> bool {
        matches!(self, Self::DistanceField | Self::Certified | Self::Joint | Self::JointCertified)
    }

    /// True where it can be given a gate.
    pub(crate) fn has_gate(self) -> bool {
        !matches!(self, Self::LabIcp | Self::Joint | Self::JointCertified)
    }

    /// True where it asks for a proof where nothing else settles the pose, so that it has a provisional answer before.
    pub fn may_prove(self) -> bool {
        matches!(self, Self::DistanceField | Self::Refined)
    }

    /// True where it can leave out a share of the contacts.
    pub(crate) fn can_trim(self) -> bool {
        self == Self::Refined || self.icp().is_some()
    }
}

impl std::fmt::Display for RegistrationChoice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.by.key())?;
        match self.rejection {
            Rejection::Own => Ok(()),
            Rejection::Gate(nm) => write!(f, ":gate={}", f64::from(nm) / 1e6),
            Rejection::Trim(_) => write!(f, ":trim={}", self.rejection.number().unwrap_or_default()),
        }
    }
}

impl FromStr for RegistrationChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, rest) = text.split_once(':').map_or((text, None), |(key, rest)| (key, Some(rest)));
        let by = key.parse().map_err(|_| {
            let keys: Vec<_> = Registration::iter().map(Registration::key).collect();
            format!("{key:?} is no registration; there are {}", keys.join(", "))
        })?;
        let number = |text: &str| text.parse::<f64>().map_err(|_| format!("{text:?} is not a number"));
        let rejection = match rest.map(|rest| rest.split_once('=').unwrap_or((rest, ""))) {
            None => Rejection::Own,
            Some(("gate", mm)) => Rejection::gate(number(mm)? / 1e3)?,
            Some(("trim", share)) => Rejection::trim(number(share)?)?,
            Some(_) => return Err(format!("{text:?}: a registration is followed by nothing, :gate=MM or :trim=SHARE")),
        };
        Self::new(by, rejection)
    }
}

impl TryFrom<String> for RegistrationChoice {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<RegistrationChoice> for String {
    fn from(choice: RegistrationChoice) -> Self {
        choice.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::Ask;
    use crate::align::testing::{cross, cross_contacts};
    use crate::frames::PlanarPose;
    use crate::pose::{ToolModel, register, register_with};

    #[test]
    fn what_is_written_is_read_and_what_cannot_be_done_is_refused() {
        for by in Registration::iter() {
            let rejections = [Rejection::Own, Rejection::gate(0.0003).unwrap(), Rejection::trim(0.15).unwrap()];
            for choice in rejections.into_iter().filter_map(|r| RegistrationChoice::new(by, r).ok()) {
                assert_eq!(choice.to_string().parse(), Ok(choice));
                let json = serde_json::to_string(&choice).unwrap();
                assert_eq!(serde_json::from_str::<RegistrationChoice>(&json).unwrap(), choice);
            }
            assert_eq!(by.key().parse(), Ok(RegistrationChoice::from(by)), "as earlier versions wrote it");
        }
        for (text, word) in [
            ("nearest", "is no registration"),
            ("gicp:gate=0", "between 0.01 and 50 mm"),
            ("gicp:gate=NaN", "between 0.01 and 50 mm"),
            ("gicp:trim=1", "between 0 and 0.9"),
            ("gicp:trim=-0.1", "between 0 and 0.9"),
            ("gicp:trim", "not a number"),
            ("gicp:keep=3", "followed by"),
            ("distance_field:trim=0.1", "does not trim"),
            ("lab_icp:gate=1", "has no gate"),
        ] {
            let why = text.parse::<RegistrationChoice>().unwrap_err();
            assert!(why.contains(word), "{text}: {why}");
        }
    }

    /// The gate of a registration by itself, meters.
    fn own_gate_m(by: Registration) -> Option<f64> {
        let of_pairs = |config: IcpConfig| match config.rejector {
            Rejector::MaxDistance { distance_m } => Some(distance_m),
            Rejector::None | Rejector::Trimmed { .. } => None,
        };
        match by {
            Registration::DistanceField | Registration::Certified => Some(AlignConfig::default().final_kernel_m()),
            Registration::Refined => of_pairs(RefineConfig::default().space),
            by => by.icp().and_then(of_pairs),
        }
    }

    #[test]
    fn the_own_gate_changes_no_bit_and_another_one_the_answer() {
        let tool = ToolModel::new(cross()).unwrap();
        let pose = PlanarPose { theta_rad: 0.2, y_m: 0.002, z_m: -0.001 };
        let yz = cross_contacts(600, pose, 2e-3, 5);
        let points: Vec<_> =
            yz.iter().enumerate().map(|(i, p)| glam::DVec3::new((i % 7) as f64 * 1e-3, p.x, p.y)).collect();
        let (mut gates, mut trims) = (0, 0);
        for by in Registration::iter() {
            let own = register(&points, &tool, by, false).unwrap();
            let with = |rejection| {
                let choice = RegistrationChoice::new(by, rejection).ok()?;
                Some(register_with(&*choice.method(), &points, &tool, Ask::default()).unwrap())
            };
            if let Some(gate_m) = own_gate_m(by) {
                assert_eq!(with(Rejection::gate(gate_m).unwrap()).unwrap(), own, "{by:?}");
                let narrow = with(Rejection::gate(gate_m / 4.0).unwrap()).unwrap();
                assert_ne!(narrow.grasp_from_object, own.grasp_from_object, "{by:?}");
                gates += 1;
            }
            if let (Some(all), Some(few)) = (with(Rejection::trim(0.0).unwrap()), with(Rejection::trim(0.4).unwrap())) {
                assert_ne!(all.grasp_from_object, few.grasp_from_object, "{by:?}");
                trims += 1;
            }
        }
        assert_eq!((gates, trims), (8, 7));
    }
}
