//! [`Preset`]: three ways to generate, for people who do not want to choose a sampler.

use serde::{Deserialize, Serialize};

use super::{GenerateConfig, Sampler, Spacing};

/// Fast, as the bundle recommends, or as sharp as more steps make it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[derive(Serialize, Deserialize, strum::EnumIter, strum::EnumString, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Preset {
    /// One step: for looking through a data set, and for a robot that waits. It draws about the mean of all plausible
    /// imprints, so seeds hardly differ.
    Fast,
    /// The steps that the bundle recommends.
    #[default]
    Default,
    /// As many steps as still change anything: the sharpest picture. Whether it is also the one with the smallest
    /// error depends on the bundle: `touch2touch-bench generator` tells.
    Sharp,
}

impl Preset {
    /// Name in settings, files and on the command line.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The choices of one generation, with the bundle's `defaults` for what the preset leaves open. Never more steps
    /// than the bundle's `training_steps`.
    ///
    /// Few steps start at the noisiest training step ([`Spacing::Trailing`]): the first step then takes pure noise for
    /// what it is, which the lab's spacing does not.
    #[must_use]
    pub fn config(self, defaults: GenerateConfig, training_steps: usize) -> GenerateConfig {
        let limit = u32::try_from(training_steps).unwrap_or(u32::MAX);
        let with = |steps: u32, sampler| GenerateConfig {
            steps: steps.min(limit),
            sampler,
            eta: 0.0,
            spacing: Spacing::Trailing,
            ..defaults
        };
        match self {
            Self::Fast => with(1, Sampler::Ddim),
            Self::Default => defaults,
            Self::Sharp => with(50, Sampler::Ddim),
        }
    }
}
