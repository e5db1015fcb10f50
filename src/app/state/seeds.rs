//! Several seeds of one touch: which, what is there of them, and what is missing.

use super::super::keys::PredictionKey;

pub use touch2touch_work::subject::SEEDS as COUNT;

/// The choices of a person about seeds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// The number.
    pub count: usize,
    /// True where they are made for every pair that is shown with their pane.
    pub every: bool,
    /// The key of the first of them when they were asked for. Another pair or another setting asks anew.
    pub asked: Option<PredictionKey>,
}

impl Default for Seeds {
    fn default() -> Self {
        Self { count: 8, every: false, asked: None }
    }
}
