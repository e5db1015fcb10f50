//! Several seeds of one touch: which, what is there of them, and what is missing.

use super::super::keys::PredictionKey;

pub use touch2touch_work::subject::SEEDS as COUNT;

/// What a person chose about seeds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// How many.
    pub count: usize,
    /// Whether they are made for every pair that is shown with their pane.
    pub every: bool,
    /// What they were asked for: the recipe of the first of them. Another pair or another setting asks anew.
    pub asked: Option<PredictionKey>,
}

impl Default for Seeds {
    fn default() -> Self {
        Self { count: 8, every: false, asked: None }
    }
}
