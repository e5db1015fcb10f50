//! Names of what is open and looked at, and the keys of results: plain values that say what a result is of and how it is
//! made.
//!
//! A key is a [`touch2touch_pipeline::steps::recipe::Recipe`] as far as it decides the result, with the touch. [`super::results`] says
//! how each result is computed.

pub mod dataset;
pub mod estimate;
pub mod inspection;
pub mod prediction;
pub mod proposal;

pub use touch2touch_core::bits::Bits;
pub use touch2touch_core::diffusion::{Preset, Sampler, Spacing};
pub use touch2touch_core::pose::Registration;
pub use touch2touch_core::postprocess::ShiftMode;
pub use touch2touch_pipeline::labels::{ImprintSource, Revision};
pub use touch2touch_pipeline::steps::mask::MaskRecipe;

pub use dataset::{AboutKey, ImportForm, ImportPlanKey, MaskPlanKey, ToolKey, TrainPlanKey};
pub use estimate::{ComparisonKey, EstimateKey, ImprintKey, MaskVersion, MeanKey, PoseBits, RunKey};
pub use inspection::Inspection;
pub(crate) use prediction::Keyed;
pub use prediction::{PredictionKey, Preview};
pub use proposal::{CadPlace, Distances, DistancesKey, ProposalInputs, ProposalKey};

use touch2touch_core::dataset::PairId;
use touch2touch_core::postprocess::CorrectionParts;
use touch2touch_core::rig::PadId;

/// Keys that are others under a name of their own.
macro_rules! named {
    ($( #[doc = $doc:literal] $name:ident($($of:ty),+); )*) => { $(
        #[doc = $doc]
        #[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name($(pub $of),+);
    )* };
}

named! {
    /// The small picture of a pair.
    ThumbnailKey(PairKey);
    /// The labels stored for a pair.
    LabelsKey(PairKey);
    /// The predictions of a touch that lie on the disk from before.
    StoredKey(TouchKey);
    /// The picture beside a touch.
    PictureKey(TouchKey);
    /// A prediction of a color sensor, as a picture.
    ColorKey(PredictionKey);
    /// Implausible things about the way of a prediction to meters.
    FlagsKey(PredictionKey, ShiftMode);
    /// The layers of a recorded registration from the registration's own starts.
    LayersKey(EstimateKey);
    /// The distances of the contact points from the model at a registered pose.
    DeviationKey(EstimateKey);
    /// The tools of the data set, ranked for the touch that a pose is of.
    RankingKey(EstimateKey);
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
