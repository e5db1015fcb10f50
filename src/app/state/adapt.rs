//! The form of the fit, and its last answer.

use std::ops::RangeInclusive;
use std::sync::Arc;

use touch2touch_pipeline::learn::adapt::Adapted;

/// Parts in which pairs are left out in turn.
pub(in crate::app) const FOLDS: usize = 3;

/// Steps of tuning that can be asked for.
pub(crate) const TUNING_STEPS: RangeInclusive<u32> = 30..=5000;

/// The pairs that are fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumIter)]
pub enum AdaptPairs {
    /// All of the data set.
    #[default]
    All,
    /// The pairs marked done.
    Done,
    /// The pairs in the list as it is filtered.
    Listed,
}

impl AdaptPairs {
    /// The name on screen.
    pub fn label(self) -> &'static str {
        match self {
            Self::All => "all pairs",
            Self::Done => "pairs marked done",
            Self::Listed => "pairs in the list",
        }
    }
}

/// The fit and how it is asked for.
#[derive(Clone, Debug)]
pub struct AdaptState {
    /// The pairs.
    pub pairs: AdaptPairs,
    /// True where the networks themselves are tuned after the closed form.
    pub tune: bool,
    /// With how many steps: 50 take about a minute on two free cores, for each part and for all.
    pub steps: u32,
    /// The last fit to the open data set.
    pub result: Option<Arc<Adapted>>,
    /// The bundle of the result.
    pub bundle: Option<Arc<str>>,
    /// Progress of a fit that was told to stop: the same goes on from there.
    pub stopped: Option<String>,
}

impl Default for AdaptState {
    fn default() -> Self {
        Self { pairs: AdaptPairs::default(), tune: false, steps: 50, result: None, bundle: None, stopped: None }
    }
}

impl AdaptState {
    /// The last fit, where it was not written because of what speaks against it.
    pub(crate) fn refused(&self) -> Option<&Arc<Adapted>> {
        self.result.as_ref().filter(|adapted| adapted.unwritten.is_some())
    }
}
