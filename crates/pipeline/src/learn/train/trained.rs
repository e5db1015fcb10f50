//! Answer of a training: scores on what was left out, and the new bundle.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use crate::error::Remark;
use crate::export::LeftOut;
use crate::job::Curve;
use crate::labels::ImprintSource;
use crate::learn::mask_worth::MaskWorth;
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::PadId;

/// Fit of a mask model's masks to those that people drew.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MaskScore {
    /// Pixels in both over pixels in either.
    pub iou: f64,
    /// Twice the pixels in both over the pixels of each together.
    pub dice: f64,
}

impl MaskScore {
    /// The mean of several; `None` of none.
    pub fn mean(all: impl Iterator<Item = Self>) -> Option<Self> {
        let (mut sum, mut count) = (Self::default(), 0.0);
        for one in all {
            (sum.iou, sum.dice, count) = (sum.iou + one.iou, sum.dice + one.dice, count + 1.0);
        }
        (count > 0.0).then(|| Self { iou: sum.iou / count, dice: sum.dice / count })
    }
}

/// A mask that was not trained on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldOut {
    /// The pair.
    #[serde(skip)]
    pub id: PairId,
    /// Name of the pair.
    pub pair: String,
    /// The tool, where known.
    pub tool: Option<String>,
    /// The pad.
    #[serde(skip)]
    pub pad: PadId,
    /// Name of the pad.
    pub finger: String,
    /// Source of the imprint that was masked.
    pub imprint: ImprintSource,
    /// The model as it was.
    pub before: MaskScore,
    /// The trained model.
    pub after: MaskScore,
}

/// A training with what it is worth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trained {
    /// The mask model that it began from.
    pub from: String,
    /// Masks that were learned from, by tool.
    pub tools: BTreeMap<String, usize>,
    /// All of them.
    pub masks: usize,
    /// Pairs that they are of.
    pub pairs: usize,
    /// Who drew them.
    pub persons: Vec<String>,
    /// Pairs that took no part.
    pub left_out: BTreeMap<LeftOut, usize>,
    /// Pairs and masks that could not be used.
    pub unusable: Vec<Remark>,
    /// The model as it was, on masks of pairs that were not trained on; `None` without any.
    pub before: Option<MaskScore>,
    /// The trained model on the same.
    pub after: Option<MaskScore>,
    /// The model before and after by the poses of grasps that were left out, where tool and true pose are known.
    pub poses: Option<[MaskWorth; 2]>,
    /// These masks, the worst (after) first.
    pub held_out: Vec<HeldOut>,
    /// Steps.
    pub steps: u32,
    /// The loss, and the Dice on some of the masks that were left out.
    pub curves: Vec<Curve>,
    /// Time of everything, seconds.
    pub seconds: f64,
    /// The most memory that the program had so far, MiB, where the system tells.
    pub peak_mib: Option<u64>,
    /// Warnings, in words.
    pub warnings: Vec<String>,
    /// The new bundle's name.
    pub name: String,
    /// Folder of the new bundle.
    pub bundle: PathBuf,
}

impl Trained {
    /// True where it is worse than before on what was left out.
    pub fn is_worse(&self) -> bool {
        matches!((self.before, self.after), (Some(before), Some(after)) if after.dice < before.dice)
    }
}
