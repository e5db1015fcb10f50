//! Keys of proposals.

use super::super::keys::{Bits, EstimateKey, ImprintKey, MaskRecipe, Revision};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::Grid;
use touch2touch_core::label::CadPose;

/// The place where the CAD model lies.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CadPlace {
    /// At the true pose.
    Truth,
    /// At a registered one.
    Registered(Box<EstimateKey>),
    /// The place where a hand holds it: the bits of its numbers.
    Hand([u64; 3]),
}

impl CadPlace {
    /// The place where a hand holds it.
    pub(crate) fn hand(pose: PlanarPose) -> Self {
        Self::Hand([pose.theta_rad, pose.y_m, pose.z_m].map(f64::to_bits))
    }
}

/// The distances of an imprint's points from the CAD model.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DistancesKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// The place where the model lies.
    pub at: CadPlace,
}

/// The distances, and where the model was.
#[derive(Clone, Debug)]
pub struct Distances {
    /// Meters, negative inside; see [`touch2touch_pipeline::masks::propose::cad_distances`].
    pub grid: Grid<f64>,
    /// The pose of the model.
    pub at: CadPose,
}

/// The inputs of a proposal.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ProposalInputs {
    /// An automatic mask.
    Automatic(MaskRecipe),
    /// The pixels within a distance of the CAD model.
    Cad(CadPlace, Bits),
    /// The strokes, by the revision of the mask.
    Grow(Revision),
}

/// A proposal for one imprint.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ProposalKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// The inputs.
    pub of: ProposalInputs,
}
