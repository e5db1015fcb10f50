//! The form of what is fitted or trained, and the last answers.

use std::ops::RangeInclusive;
use std::sync::Arc;
use std::time::Duration;

use touch2touch_pipeline::learn::adapt::Adapted;
use touch2touch_pipeline::learn::train::{TrainChoice, Trained};
use touch2touch_pipeline::learn::tuning::Tuning;
use touch2touch_pipeline::steps::bundles::BundleKind;

/// Parts in which pairs are left out in turn.
pub(in crate::app) const FOLDS: usize = 3;
/// Steps of tuning a generator that can be asked for.
pub(crate) const TUNING_STEPS: RangeInclusive<u32> = 30..=5000;
/// Minutes of a training that can be asked for.
pub(crate) const MINUTES: RangeInclusive<u32> = 1..=600;
/// Steps of a training that can be asked for.
pub(crate) const STEPS: RangeInclusive<u32> = 1..=100_000;
/// Most percent of the pairs that can be left out.
pub(crate) const MOST_HELD_OUT: u8 = 90;

with_texts! {
    /// Network that learns from the open pairs.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumIter)]
    pub enum Network(name, what) {
        /// The generator, fitted to pairs.
        #[default]
        Generator = "Generator", "Fit the model";
        /// The mask model, trained on masks.
        Masks = "Mask model", "Train the mask model";
    }
}

impl Network {
    /// The kind of its bundles.
    pub(crate) fn kind(self) -> BundleKind {
        match self {
            Self::Generator => BundleKind::Generator,
            Self::Masks => BundleKind::Mask,
        }
    }
}

with_texts! {
    /// The pairs that a generator is fitted to.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumIter)]
    pub enum AdaptPairs(label) {
        /// All of the data set.
        #[default]
        All = "all pairs",
        /// The pairs marked done.
        Done = "pairs marked done",
        /// The pairs in the list as it is filtered.
        Listed = "pairs in the list",
    }
}

with_defaults! {
    /// The choices of a person about the next fit and the next training. Not kept between runs of the program.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct LearnForm {
        /// The pairs that the generator is fitted to.
        pub pairs: AdaptPairs = AdaptPairs::default(),
        /// True where its networks are tuned after the closed form.
        pub tune: bool = false,
        /// With how many steps: 50 take about a minute on two free cores, for each part and for all.
        pub tuning_steps: u32 = 50,
        /// The division into pairs that the mask model learns from and pairs that are left out.
        pub choice: TrainChoice = TrainChoice::default(),
        /// True where the number of its steps is given, not the time.
        pub by_steps: bool = false,
        /// For how long it is trained.
        pub minutes: u32 = 10,
        /// With how many steps.
        pub steps: u32 = 300,
    }
}

impl LearnForm {
    /// Numbers brought into range.
    #[must_use]
    pub fn validated(mut self) -> Self {
        let within = |value: u32, range: RangeInclusive<u32>| value.clamp(*range.start(), *range.end());
        self.tuning_steps = within(self.tuning_steps, TUNING_STEPS);
        self.choice.held_out_percent = self.choice.held_out_percent.min(MOST_HELD_OUT);
        self.minutes = within(self.minutes, MINUTES);
        self.steps = within(self.steps, STEPS);
        self
    }

    /// The length of a training of the mask model.
    pub(in crate::app) fn tuning(&self) -> Tuning {
        match self.by_steps {
            true => Tuning::Steps(self.steps),
            false => Tuning::Within(Duration::from_secs(60 * u64::from(self.minutes))),
        }
    }
}

/// Networks that are fitted and trained, with the form that asks for it.
#[derive(Clone, Debug, Default)]
pub struct LearnState {
    /// The choices.
    pub form: LearnForm,
    /// The network whose tab is shown.
    pub shown: Network,
    /// The network that was started last.
    pub started: Network,
    /// The last fit to the open data set.
    pub adapted: Option<Arc<Adapted>>,
    /// The last training on the open data set.
    pub trained: Option<Arc<Trained>>,
    /// The bundle of the last result, by network.
    pub bundles: [Option<Arc<str>>; 2],
    /// Progress of what was told to stop, by network: the same goes on from there.
    pub stopped: [Option<String>; 2],
}

impl LearnState {
    /// The choices alone, for another data set.
    pub(in crate::app) fn emptied(&self) -> Self {
        Self { form: self.form, shown: self.shown, ..Self::default() }
    }

    /// The last fit, where it was not written because of what speaks against it.
    pub(crate) fn refused(&self) -> Option<&Arc<Adapted>> {
        self.adapted.as_ref().filter(|adapted| adapted.unwritten.is_some())
    }
}
