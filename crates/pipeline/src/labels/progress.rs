//! Progress of the labeling of a data set: its pairs by tool and review state.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::labels::Review;
use touch2touch_core::dataset::PairEntry;

/// Number of pairs in each review state.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts(BTreeMap<&'static str, usize>);

impl Counts {
    /// Pairs in a state.
    pub fn of(&self, review: Review) -> usize {
        self.0.get(review.stored()).copied().unwrap_or(0)
    }

    /// Pairs in all.
    pub fn total(&self) -> usize {
        self.0.values().sum()
    }

    fn add(&mut self, review: Review) {
        *self.0.entry(review.stored()).or_default() += 1;
    }
}

/// Progress of the pairs of one tool.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ToolProgress {
    /// The tool; `None` for pairs without one.
    pub tool: Option<String>,
    /// Number of its pairs in each review state.
    pub pairs: Counts,
}

/// Progress of the labeling.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Pairs of each tool by review state, by the tools' names.
    pub tools: Vec<ToolProgress>,
    /// All pairs by review state.
    pub all: Counts,
}

impl Progress {
    /// Of the review states of the pairs of a data set.
    pub fn of(pairs: &[PairEntry], reviews: &BTreeMap<String, Review>) -> Self {
        let mut all = Counts::default();
        let mut tools: BTreeMap<Option<&String>, Counts> = BTreeMap::new();
        for entry in pairs {
            let review = reviews.get(&entry.name).copied().unwrap_or_default();
            tools.entry(entry.tool.as_ref()).or_default().add(review);
            all.add(review);
        }
        let tool = |(tool, pairs): (Option<&String>, Counts)| ToolProgress { tool: tool.cloned(), pairs };
        Self { tools: tools.into_iter().map(tool).collect(), all }
    }
}
