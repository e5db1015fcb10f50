//! The index of a data set: names only, no images.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Position of a pair in its [`Index`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PairId(pub u32);

/// The part of the lab's data a pair belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// `train/…/<tool folder>/data_N.pt`.
    Train,
    /// `test/train_only`: grasps of the training set, used for shift statistics.
    TrainOnly,
    /// `test/test_only`: unseen grasps and unseen tools.
    Test,
    /// A source without splits.
    None,
}

/// One grasp felt by both sensors.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PairEntry {
    /// Unique and stable within the data set, e.g. `pattern_31_rod/data_0`; masks and results are stored under it.
    pub name: String,
    /// The tool's name without prefixes; `None` where the source has no tools.
    pub tool: Option<String>,
    /// The part of the data.
    pub split: Split,
    /// The last integer in the file name: the lab's order.
    pub number: u64,
}

/// All pairs in natural order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Index {
    /// [`PairId`] is the position here.
    pub pairs: Vec<PairEntry>,
}

impl Index {
    /// The entry of `id`, if it is one of this index.
    pub fn get(&self, id: PairId) -> Option<&PairEntry> {
        self.pairs.get(id.0 as usize)
    }

    /// The tools, sorted, each once.
    pub fn tools(&self) -> Vec<String> {
        let mut tools: Vec<String> = self.pairs.iter().filter_map(|p| p.tool.clone()).collect();
        tools.sort();
        tools.dedup();
        tools
    }
}

/// Something wrong with a data set that did not keep the rest from opening.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// The file or folder.
    pub file: PathBuf,
    /// Fault of the file, in words.
    pub what: String,
    /// Remedy, in words.
    pub hint: String,
}
