//! Names of what is open and looked at, and the words that recipes are made of. The recipes themselves stand with their
//! results in [`super::results`].

pub use touch2touch_core::bits::Bits;
pub use touch2touch_core::diffusion::{Preset, Sampler, Spacing};
pub use touch2touch_core::postprocess::ShiftMode;
pub use touch2touch_work::labels::{ImprintSource, Revision};
pub use touch2touch_work::mask::MaskRecipe;

pub use super::results::Request;
pub(crate) use super::results::cloud::CloudKey;
pub(crate) use super::results::ensemble::EnsembleKey;
pub use super::results::imprint::ImprintKey;
pub(crate) use super::results::imprint::MetersKey;
pub(crate) use super::results::mask::MaskKey;
pub use super::results::mask::MaskVersion;
pub use super::results::pose::PoseKey;
pub use super::results::prediction::PredictionKey;
pub(crate) use super::results::run::RunKey;
pub(crate) use super::results::versus::{CloudDifferenceKey, VersusKey};
pub use touch2touch_core::pose::{Registration, RegistrationChoice};

use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::rig::PadId;

/// Counts the data sets opened since the start: results of an earlier one never reach a later one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DatasetSeq(pub u32);

/// A pair of one opening of a data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PairKey {
    /// The opening.
    pub dataset: DatasetSeq,
    /// The pair in its index.
    pub pair: PairId,
}

impl PairKey {
    /// One finger of this pair.
    pub fn finger(self, finger: PadId) -> TouchKey {
        TouchKey { pair: self, finger }
    }
}

/// One finger of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TouchKey {
    /// The pair.
    pub pair: PairKey,
    /// The finger.
    pub finger: PadId,
}

/// What a range mapping does, for its tooltip.
pub(crate) fn shift_tooltip(mode: ShiftMode) -> &'static str {
    match mode {
        ShiftMode::Raw => {
            "The prediction as the released script saves it: its range is mapped twice, so depths come out as \
             (depth + max) / 2, far too deep"
        }
        ShiftMode::PaperShift => {
            "The raw values with mean and deviation matched to the training statistics, as in the paper"
        }
        ShiftMode::ExactInverse => {
            "The raw values with the doubled mapping undone: 2 * value - max, the depth itself; of a fitted \
             model, with its fit"
        }
        ShiftMode::Parts(_) => "The exact inverse with only some parts of the model's fit to a rig",
        ShiftMode::Refit(_) => {
            "The raw values with mean and deviation matched to this data set's own predictions and measurements"
        }
    }
}

/// A pose (`grasp_from_object`) that compares and hashes by its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PoseBits([u64; 3]);

impl From<PlanarPose> for PoseBits {
    fn from(pose: PlanarPose) -> Self {
        Self([pose.theta_rad, pose.y_m, pose.z_m].map(f64::to_bits))
    }
}

impl PoseBits {
    /// The pose.
    pub fn get(self) -> PlanarPose {
        let [theta_rad, y_m, z_m] = self.0.map(f64::from_bits);
        PlanarPose { theta_rad, y_m, z_m }
    }
}
