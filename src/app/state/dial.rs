//! What the dial is asked for, and its last answer.

use std::sync::Arc;

use super::State;
use touch2touch_core::dataset::PairId;
use touch2touch_work::labels::ImprintSource;
use touch2touch_work::pairs;
use touch2touch_work::recipe::Recipe;
use touch2touch_work::sweep::{Dial, Setting, Sweep, SweepSetup};

/// Over which pairs a dial is turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DialPairs {
    /// So many, spread evenly over the data set.
    Spread(usize),
    /// All of it.
    All,
    /// Those in the list as it is filtered.
    Listed,
}

impl DialPairs {
    /// What is offered.
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
    /// Which one.
    pub dial: Dial,
    /// From where to where, in its unit.
    pub range: [f64; 2],
    /// In how many values.
    pub count: usize,
    /// Over which pairs.
    pub pairs: DialPairs,
    /// Whether predictions are posed as well.
    pub predictions: bool,
    /// What the last turn over the open data set did.
    pub result: Option<Arc<Sweep>>,
}

impl Default for DialState {
    fn default() -> Self {
        let dial = Dial::default();
        let (first, last, count) = dial.usual();
        Self { dial, range: [first, last], count, pairs: DialPairs::Spread(24), predictions: true, result: None }
    }
}

impl State {
    /// The recipe that the dial changes; without a generator where the predictions are left out.
    pub(crate) fn dial_recipe(&self) -> Recipe {
        let recipe = self.in_force(ImprintSource::Measured);
        Recipe { generator: recipe.generator.filter(|_| self.dial.predictions), ..recipe }
    }

    /// The pairs that a dial turned now would go over.
    pub(crate) fn dial_pairs(&self) -> Vec<PairId> {
        let len = self.library.open.as_ref().map_or(0, |open| open.source.index().pairs.len());
        match self.dial.pairs {
            DialPairs::Spread(count) => pairs::spread(len, Some(count)).map(|at| PairId(at as u32)).collect(),
            DialPairs::All => (0..len as u32).map(PairId).collect(),
            DialPairs::Listed => self.library.order.clone(),
        }
    }

    /// What a dial turned now would do.
    ///
    /// # Errors
    /// Why it cannot be turned, in words.
    pub(crate) fn sweep_setup(&self) -> Result<SweepSetup, String> {
        let DialState { dial, range: [first, last], count, .. } = self.dial;
        if self.library.open.is_none() {
            return Err("No data set is open".into());
        }
        let (values, recipe) = (dial.spread(first, last, count)?, self.dial_recipe());
        for value in &values {
            value.put(&recipe)?;
        }
        let pairs = self.dial_pairs();
        if pairs.is_empty() {
            return Err("There are no pairs to turn it over".into());
        }
        if dial == Dial::Probability && recipe.mask_model.is_none() {
            return Err("There is no mask model".into());
        }
        if dial == Dial::Shift && recipe.generator.is_none() {
            return Err("A shift is of predictions, and they are left out".into());
        }
        Ok(SweepSetup { values, pairs, recipe })
    }

    /// Whether a value of the last turn is what is in force now; `at`: whether it was when the dial was turned.
    pub(crate) fn is_dialed(&self, value: Setting, at: bool) -> bool {
        let now = self.dial_recipe();
        let then = self.dial.result.as_ref().map(|result| &result.in_force);
        value.put(&now).as_ref() == Ok(&now) || (at && then == Some(&now))
    }

    /// Whether something other than the dial was changed since it was turned.
    pub(crate) fn is_dial_outdated(&self) -> bool {
        let Some(result) = &self.dial.result else { return false };
        let value = result.series.first().and_then(|series| series.points.first()?.value);
        value.is_some_and(|value| value.put(&self.dial_recipe()) != value.put(&result.in_force))
    }
}
