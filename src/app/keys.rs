//! Names of what is open and looked at, and the keys of results: plain values that say what a result is of and how it is
//! made.
//!
//! A key is a [`touch2touch_pipeline::steps::recipe::Recipe`] as far as it decides the result, with the touch. [`super::results`] says
//! how each result is computed.

pub mod dataset;
pub mod imprint;
pub mod inspection;
pub mod mask;
pub mod pose;
pub mod prediction;
pub mod proposal;
pub mod versus;

pub use touch2touch_core::bits::Bits;
pub use touch2touch_core::diffusion::{Preset, Sampler, Spacing};
pub use touch2touch_core::pose::Registration;
pub use touch2touch_core::postprocess::ShiftMode;
pub use touch2touch_pipeline::labels::{ImprintSource, Revision};
pub use touch2touch_pipeline::steps::mask::MaskRecipe;

pub use dataset::{AboutKey, ImportForm, ImportPlanKey, LabelsKey, MaskPlanKey, ThumbnailKey, ToolKey, TrainPlanKey};
pub use imprint::{AmbiguityKey, ColorKey, FlagsKey, ImprintKey, MeanKey, MetersKey, PictureKey};
pub use inspection::{Inspection, InspectionKey};
pub use mask::{MaskKey, MaskVersion};
pub use pose::{CloudKey, DeviationKey, LayersKey, PoseBits, PoseKey, ProvisionalPoseKey, RankingKey, RunKey};
pub(crate) use prediction::Keyed;
pub use prediction::{ComparedKey, PredictionKey, PrefetchKey, Preview, StoredKey};
pub use proposal::{CadPlace, Distances, DistancesKey, ProposalInputs, ProposalKey};
pub use versus::{CloudDifferenceKey, VersusKey};

use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::PadId;

/// The key of a result. Equal keys have equal results.
pub trait Key: Clone + Ord + Send + 'static {
    /// The result.
    type Value: Send + Sync + 'static;

    /// Bytes that a result holds.
    fn bytes(_value: &Self::Value) -> usize {
        0
    }
}

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

/// The tooltip of a range mapping.
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
