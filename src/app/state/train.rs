//! The form of a training, and its last answer.

use std::ops::RangeInclusive;
use std::sync::Arc;
use std::time::Duration;

use touch2touch_pipeline::learn::train::{TrainChoice, Trained};
use touch2touch_pipeline::learn::tuning::Tuning;

/// Minutes that can be asked for.
pub(crate) const MINUTES: RangeInclusive<u32> = 1..=600;
/// Steps that can be asked for.
pub(crate) const STEPS: RangeInclusive<u32> = 1..=100_000;
/// Most percent of the pairs that can be left out.
pub(crate) const MOST_HELD_OUT: u8 = 90;

/// The choices of a person about the next training. Not kept between runs of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrainForm {
    /// The division into pairs to learn from and pairs that are left out.
    pub choice: TrainChoice,
    /// True where the number of steps is given, not the time.
    pub by_steps: bool,
    /// For how long.
    pub minutes: u32,
    /// With how many steps.
    pub steps: u32,
}

impl Default for TrainForm {
    fn default() -> Self {
        Self { choice: TrainChoice::default(), by_steps: false, minutes: 10, steps: 300 }
    }
}

impl TrainForm {
    /// Numbers brought into range.
    #[must_use]
    pub fn validated(mut self) -> Self {
        self.choice.held_out_percent = self.choice.held_out_percent.min(MOST_HELD_OUT);
        self.minutes = self.minutes.clamp(*MINUTES.start(), *MINUTES.end());
        self.steps = self.steps.clamp(*STEPS.start(), *STEPS.end());
        self
    }

    /// The length of the training.
    pub fn tuning(&self) -> Tuning {
        match self.by_steps {
            true => Tuning::Steps(self.steps),
            false => Tuning::Within(Duration::from_secs(60 * u64::from(self.minutes))),
        }
    }
}

/// The training and how it is asked for.
#[derive(Clone, Debug, Default)]
pub struct TrainState {
    /// The choices.
    pub form: TrainForm,
    /// The last training on the open data set.
    pub result: Option<Arc<Trained>>,
    /// The bundle of the result.
    pub bundle: Option<Arc<str>>,
    /// Progress of a training that was told to stop: the same goes on from there.
    pub stopped: Option<String>,
}
