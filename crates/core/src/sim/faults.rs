//! Touches with one known fault each, to learn from: what a wrong model, a foreign body or a dead finger looks like.

use glam::{DVec2, DVec3};

use super::{Grasp, SimConfig, simulate};
use crate::catalog::{Bar, ToolSpec, tools};
use crate::mesh::TriMesh;
use crate::rig::lab;
use crate::sample::Sample;

/// Fault of a touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumIter, strum::Display)]
#[strum(serialize_all = "snake_case")]
pub enum Fault {
    /// The CAD model is that of another tool.
    WrongCad,
    /// A foreign body beside the tool presses into both bubbles: the contact mask gets a blob.
    BlobInMask,
    /// The left bubble felt nothing.
    BlankFinger,
    /// Nothing is broken, but a straight rod cannot tell where along itself it is held.
    StraightRod,
    /// The CAD model is in millimeters.
    // Pairs are named after their fault, and labels after their pair: the name stays.
    #[strum(serialize = "stl_in_millimetres")]
    StlInMillimeters,
}

/// Seed of the noise; the faults differ by what is wrong, not by luck.
const SEED: u64 = 0x00fa_0170;

impl Fault {
    /// The fault in a sentence, for the list of what was written.
    pub fn what(self) -> &'static str {
        match self {
            Self::WrongCad => "the CAD model is another tool's",
            Self::BlobInMask => "a foreign body beside the tool is in contact too",
            Self::BlankFinger => "the left bubble measured no contact",
            Self::StraightRod => "a straight rod: its position along its axis cannot be measured",
            Self::StlInMillimeters => "the CAD model is in millimeters",
        }
    }

    /// The tool in the hand, without what is wrong.
    fn tool(self) -> ToolSpec {
        let number = match self {
            Self::WrongCad => 1,
            Self::BlobInMask => 7,
            Self::BlankFinger => 4,
            Self::StraightRod => 5,
            Self::StlInMillimeters => 0,
        };
        let mut tool = tools()[number].clone();
        if self == Self::StraightRod {
            // So long that neither end is felt.
            tool.points_mut().for_each(|end| *end *= 2.5);
        }
        tool
    }

    /// Grasp in which it is held.
    fn grasp(self) -> Grasp {
        Grasp { theta_rad: 11f64.to_radians(), x_m: 0.002, y_m: -0.001_5 }
    }

    /// The touch.
    pub fn sample(self) -> Sample {
        let mut felt = self.tool();
        if self == Self::BlobInMask {
            // As thick as the tool, beside it.
            felt.bars.push(Bar::straight(DVec2::new(-0.016, 0.002), DVec2::new(-0.022, 0.006), 0.004));
        }
        let mut sample = simulate(&felt, self.grasp(), SEED, &SimConfig::default());
        if self == Self::BlankFinger {
            let bubble = sample.pads.get_mut(lab::LEFT).and_then(|touch| touch.depth_mut());
            if let Some(bubble) = bubble {
                bubble.imprint.as_mut_slice().fill(0.0);
                if let Some(truth) = &mut bubble.truth {
                    truth.imprint.as_mut_slice().fill(0.0);
                    truth.contact.as_mut_slice().fill(false);
                }
            }
        }
        sample
    }

    /// The CAD model as a careless person supplies it: meters, object frame, unless that is what is wrong.
    pub fn mesh(self) -> TriMesh {
        let mut mesh = match self {
            Self::WrongCad => tools()[0].mesh(),
            _ => self.tool().mesh(),
        };
        if self == Self::StlInMillimeters {
            mesh.vertices.iter_mut().for_each(|v: &mut DVec3| *v *= 1e3);
        }
        mesh
    }
}
