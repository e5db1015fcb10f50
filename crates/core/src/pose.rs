//! Contact points to the tool's pose by one of the registrations.

use serde::{Deserialize, Serialize};

use super::align::{AlignError, AlignReport, Ask, Contacts, Evidence, Register, Scene};

mod choice;

pub use super::tool::{ToolError, ToolModel};
pub use choice::{RegistrationChoice, Rejection};

/// Registration that answers.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    strum::EnumIter,
    strum::Display,
    strum::EnumString,
    strum::IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Registration {
    /// The membranes' images against the tent over the tool, and the mask.
    #[default]
    Joint,
    /// The membranes' images and the mask, with a proof by branch and bound.
    JointCertified,
    /// Robust registration on the distance field of the tool's silhouette.
    DistanceField,
    /// Robust registration on the distance field, with a proof by branch and bound.
    Certified,
    /// The lab's planar point-to-point loop.
    LabIcp,
    /// Point to point on the silhouette.
    PlanarPointToPoint,
    /// Point to plane on the silhouette.
    PlanarPointToPlane,
    /// Generalized-ICP in the plane.
    PlanarGicp,
    /// Point to point in space.
    PointToPoint,
    /// Point to plane in space.
    PointToPlane,
    /// Generalized-ICP in space.
    Gicp,
    /// The distance field in the plane, then against the triangles in space.
    Refined,
}

impl Registration {
    /// Name in settings, files and on the command line, such as `distance_field`.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::DistanceField => "ICP (distance field)",
            Self::Certified => "ICP (distance field), certified",
            Self::Joint => "Joint (membrane and mask)",
            Self::JointCertified => "Joint (membrane and mask), certified",
            Self::LabIcp => "ICP (paper)",
            Self::PlanarPointToPoint => "ICP point-point, planar",
            Self::PlanarPointToPlane => "ICP point-plane, planar",
            Self::PlanarGicp => "GICP, planar",
            Self::PointToPoint => "ICP point-point, 6 DoF",
            Self::PointToPlane => "ICP point-plane, 6 DoF",
            Self::Gicp => "GICP, 6 DoF",
            Self::Refined => "Refined, 6 DoF",
        }
    }

    /// Description of its method, in one line.
    pub fn description(self) -> &'static str {
        match self {
            Self::DistanceField => "The mask alone: robust least squares on the distance field of the silhouette",
            Self::Certified => {
                "That of the distance field with a proof: branch and bound, no pose of the prior is 2 % better"
            }
            Self::Joint => {
                "The default: the whole membrane against the sheet that the tool would lift, with the mask as a weaker term"
            }
            Self::JointCertified => {
                "That of membrane and mask with a proof: branch and bound, no pose of the prior is 2 % better"
            }
            Self::LabIcp => "The paper's loop: planar point to point, one start, up to 200 iterations, no rejection",
            Self::PlanarPointToPoint => {
                "Planar, nearest model points, far pairs left out, closed-form steps, ten starts"
            }
            Self::PlanarPointToPlane => "Planar, distance along the outline's normals, robust kernel, ten starts",
            Self::PlanarGicp => "Planar, surface to surface with both sides' normals, Huber's kernel, ten starts",
            Self::PointToPoint => "Six degrees of freedom, nearest model points, far pairs left out, ten starts",
            Self::PointToPlane => {
                "Six degrees of freedom, distance along the surface's normals, far pairs left out, ten starts"
            }
            Self::Gicp => {
                "Six degrees of freedom, surface to surface with both sides' normals, Huber's kernel, ten starts"
            }
            Self::Refined => {
                "The distance field, then robust point to plane against the triangles with six degrees of freedom"
            }
        }
    }

    /// The registration with the settings that the product uses.
    pub fn method(self) -> Box<dyn Register> {
        RegistrationChoice::from(self).method()
    }
}

/// Contact points (grasp frame, meters), with the images of the membranes where they are known, to the tool's pose: what
/// every caller ends in. `record` keeps per-iteration states, per-point residuals and the distances both ways.
///
/// # Errors
/// [`AlignError`] for too few points or none near the tool.
pub fn register<'a>(
    contacts: impl Into<Contacts<'a>>,
    tool: &ToolModel,
    engine: impl Into<RegistrationChoice>,
    record: bool,
) -> Result<AlignReport, AlignError> {
    register_with(&*engine.into().method(), contacts, tool, Ask { record, ..Ask::default() })
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
        report.evidence = Some(Evidence::about(&scene, tool, &report));
    }
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;
    use strum::IntoEnumIterator as _;

    #[test]
    fn keys_name_the_registrations() {
        for engine in Registration::iter() {
            assert_eq!(engine.key().parse(), Ok(engine));
            assert_eq!(serde_json::to_value(engine).unwrap(), engine.key());
        }
    }
}
