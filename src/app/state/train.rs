//! What a training is asked for, and its last answer.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use super::State;
use super::tasks::TaskKind;
use touch2touch_work::bundles::{BundleInfo, BundleKind};
use touch2touch_work::job::Curve;
use touch2touch_work::train::{TrainChoice, TrainSetup, Trained};
use touch2touch_work::tuning::Tuning;

/// Minutes that can be asked for.
pub(crate) const MINUTES: RangeInclusive<u32> = 1..=600;
/// Steps that can be asked for.
pub(crate) const STEPS: RangeInclusive<u32> = 1..=100_000;
/// Most percent of the pairs that can be left out.
pub(crate) const MOST_HELD_OUT: u8 = 90;

/// What a person chose about the next training. Not kept between runs of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrainForm {
    /// The division into pairs to learn from and pairs that are left out.
    pub choice: TrainChoice,
    /// Whether the number of steps is given, not the time.
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

    /// How long it trains.
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
    /// What is asked for.
    pub form: TrainForm,
    /// The last training on the open data set.
    pub result: Option<Arc<Trained>>,
    /// Its bundle.
    pub bundle: Option<Arc<str>>,
}

impl State {
    /// What a training started now would do; `None` without data or a mask model. Where the new bundle lies is not the
    /// state's to say.
    pub(crate) fn train_setup(&self) -> Option<TrainSetup> {
        self.library.open.as_ref()?;
        let generators = self.library.bundles.iter().filter(|bundle| bundle.kind == BundleKind::Generator);
        Some(TrainSetup {
            start: self.bundle(BundleKind::Mask).ok()?.clone(),
            generators: generators.cloned().collect(),
            engine: self.settings.runtime,
            choice: self.train.form.choice,
            tuning: self.train.form.tuning(),
            unfinished: None,
            out: PathBuf::new(),
        })
    }

    /// How the training goes, or how the last one went.
    pub(crate) fn training_curves(&self) -> &[Curve] {
        match (self.running(TaskKind::Train), &self.train.result) {
            (Some((_, task)), _) => &task.progress.curves,
            (None, Some(result)) => &result.curves,
            (None, None) => &[],
        }
    }

    /// The bundle that was trained on the open data set.
    pub fn trained(&self) -> Option<&BundleInfo> {
        self.library.bundle(self.train.bundle.as_deref()?)
    }

    /// Whether that makes the automatic masks now.
    pub fn uses_trained(&self) -> bool {
        let now = self.bundle(BundleKind::Mask).ok().map(|bundle| &bundle.id);
        self.trained().is_some_and(|trained| Some(&trained.id) == now)
    }
}
