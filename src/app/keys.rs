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
use touch2touch_core::postprocess::CorrectionParts;
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

/// The name on screen of a way from the decoder's numbers to depth; files and verbs keep their keys.
pub(crate) fn shift_name(mode: ShiftMode) -> &'static str {
    match mode {
        ShiftMode::Raw => "Uncorrected (raw)",
        ShiftMode::PaperShift => "As in the paper (paper shift)",
        ShiftMode::ExactInverse => "Calibrated (exact inverse)",
        ShiftMode::Parts(CorrectionParts::NONE) => "Calibrated, without the fit",
        ShiftMode::Parts(_) => "Calibrated, parts of the fit",
        ShiftMode::Refit(_) => "Matched to this data set (refit)",
    }
}

/// The tooltip of a depth scale.
pub(crate) fn shift_tooltip(mode: ShiftMode) -> &'static str {
    match mode {
        ShiftMode::Raw => {
            "As the released script saves it. Its range is mapped twice, so depths come out far too deep: (depth + max) / 2"
        }
        ShiftMode::PaperShift => "Mean and deviation matched to those of the training data, as in the paper",
        ShiftMode::ExactInverse => {
            "True depth: the doubled mapping is undone (2 * value - max), and a fitted model's fit is applied"
        }
        ShiftMode::Parts(_) => "True depth, with only some parts of the model's fit to your sensors",
        ShiftMode::Refit(_) => "Mean and deviation matched to the measurements of this data set",
    }
}
