//! The form of the dial, and its last answer.

use std::sync::Arc;

use touch2touch_work::sweep::{Dial, Sweep};

/// Over which pairs a dial is turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DialPairs {
    /// So many, spread evenly over the data set.
    Spread(usize),
    /// All of it.
    All,
    /// The pairs in the list as it is filtered.
    Listed,
}

impl DialPairs {
    /// The choices that are offered.
    pub const OFFERED: [Self; 5] = [Self::Spread(12), Self::Spread(24), Self::Spread(60), Self::All, Self::Listed];

    /// The name on screen.
    pub fn label(self) -> String {
        match self {
            Self::Spread(count) => format!("{count} pairs"),
            Self::All => "all pairs".into(),
            Self::Listed => "pairs in the list".into(),
        }
    }
}

/// The dial and how it is turned.
#[derive(Clone, Debug)]
pub struct DialState {
    /// The dial.
    pub dial: Dial,
    /// From where to where, in its unit.
    pub range: [f64; 2],
    /// In how many values.
    pub count: usize,
    /// Over which pairs.
    pub pairs: DialPairs,
    /// True where predictions are posed as well.
    pub predictions: bool,
    /// The result of the last turn over the open data set.
    pub result: Option<Arc<Sweep>>,
}

impl Default for DialState {
    fn default() -> Self {
        let dial = Dial::default();
        let (first, last, count) = dial.usual();
        Self { dial, range: [first, last], count, pairs: DialPairs::Spread(24), predictions: true, result: None }
    }
}
