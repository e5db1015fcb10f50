//! What the dial is asked for, and its last answer.

use std::sync::Arc;

use super::super::state::State;
use touch2touch_core::dataset::PairId;
use touch2touch_work::bundles::BundleKind;
use touch2touch_work::pairs;
use touch2touch_work::sweep::{Dial, InForce, Setting, Sweep, SweepSetup};

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
    /// What decides poses now besides models and pair.
    pub fn in_force(&self) -> InForce {
        InForce { mask: self.settings.mask.choice, registration: self.settings.pose_engine, shift: self.settings.shift }
    }

    /// The pairs that a dial turned now would go over.
    pub fn dial_pairs(&self) -> Vec<PairId> {
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
    pub fn sweep_setup(&self) -> Result<SweepSetup, String> {
        let DialState { dial, range: [first, last], count, predictions, .. } = self.dial;
        if self.library.open.is_none() {
            return Err("No data set is open".into());
        }
        let (values, in_force) = (dial.spread(first, last, count)?, self.in_force());
        for value in &values {
            value.put(in_force)?;
        }
        let pairs = self.dial_pairs();
        if pairs.is_empty() {
            return Err("There are no pairs to turn it over".into());
        }
        let mask_model = self.bundle(BundleKind::Mask).ok().cloned();
        if dial == Dial::Probability && mask_model.is_none() {
            return Err("There is no mask model".into());
        }
        let generator = self.bundle(BundleKind::Generator).ok().filter(|_| predictions);
        if dial == Dial::Shift && generator.is_none() {
            return Err("A shift is of predictions, and they are left out".into());
        }
        Ok(SweepSetup {
            values,
            pairs,
            in_force,
            mask_model,
            generator: generator.map(|bundle| (bundle.clone(), self.settings.generate.config(bundle))),
            hand: true,
            engine: self.settings.runtime,
        })
    }

    /// Whether a value of the last turn is what is in force now; `at`: whether it was when the dial was turned.
    pub fn is_dialed(&self, value: Setting, at: bool) -> bool {
        let now = self.in_force();
        let then = self.dial.result.as_ref().map(|result| result.in_force);
        value.put(now) == Ok(now) || (at && then == Some(now))
    }

    /// Whether something other than the dial was changed since it was turned.
    pub fn is_dial_outdated(&self) -> bool {
        let Some(result) = &self.dial.result else { return false };
        let value = result.series.first().and_then(|series| series.points.first()?.value);
        value.is_some_and(|value| value.put(self.in_force()) != value.put(result.in_force))
    }
}
