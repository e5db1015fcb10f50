//! [`GeneratorChoice`]: what a command line or a call in Python says of a generator, and the part of a recipe that comes of it.

use std::path::PathBuf;

use super::Model;
use crate::error::TaskError;
use crate::io::statistics::ShiftStatistics;
use crate::steps::bundles::{BundleInfo, BundleKind, FoundBundles};
use touch2touch_core::diffusion::{GenerateConfig, Preset, Sampler, Spacing};
use touch2touch_core::postprocess::{CorrectionParts, ShiftMode};
use touch2touch_core::rig::Rig;

/// Name of the task in errors.
const WHAT: &str = "Look for a generator";

/// A generator with the numbers of a generation; what is not said is the preset's or the bundle's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GeneratorChoice {
    /// Folder of the bundle; else the first one found that fits the sensors.
    pub bundle: Option<PathBuf>,
    /// Quality, of which the following change single numbers.
    pub preset: Preset,
    /// Sampling steps.
    pub steps: Option<u32>,
    /// Seed of the noise.
    pub seed: Option<u64>,
    /// Share of fresh noise per step, 0 to 1.
    pub eta: Option<f64>,
    /// Way from noise to an image.
    pub sampler: Option<Sampler>,
    /// The training steps visited.
    pub spacing: Option<Spacing>,
    /// Mapping to meters.
    pub shift: ShiftChoice,
}

impl GeneratorChoice {
    /// The generator with its numbers, and the mapping to meters.
    ///
    /// # Errors
    /// If there is no such bundle, it does not fit the sensors, or a number is not for it.
    pub fn of(&self, found: &FoundBundles, rig: &Rig) -> Result<((Model, GenerateConfig), ShiftMode), TaskError> {
        let bundle = found.take(BundleKind::Generator, self.bundle.as_deref(), rig)?;
        bundle.ends(rig).transpose().map_err(|err| TaskError::from_error(WHAT, &err))?;
        let shift = self.shift.mode(Some((&bundle.name, &bundle.id)))?;
        let config = self.config(&bundle)?;
        Ok(((bundle.into(), config), shift))
    }

    /// The bundle's defaults with what is said instead.
    fn config(&self, bundle: &BundleInfo) -> Result<GenerateConfig, TaskError> {
        let no_generator = || TaskError::new(WHAT, format!("the bundle {} is not a generator", bundle.name));
        let info = bundle.generator.as_ref().ok_or_else(no_generator)?;
        let preset = self.preset.config(info.defaults, info.training_steps);
        Ok(GenerateConfig {
            steps: self.steps.unwrap_or(preset.steps),
            seed: self.seed.unwrap_or(preset.seed),
            eta: self.eta.unwrap_or(preset.eta),
            sampler: self.sampler.unwrap_or(preset.sampler),
            spacing: self.spacing.unwrap_or(preset.spacing),
        })
    }
}

/// A mapping of the decoder's output to meters, as it is asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum ShiftChoice {
    /// Depth as the lab's released script saves it: its range is mapped twice.
    Raw,
    /// The paper's mean-and-deviation shift of that.
    Paper,
    /// The doubled mapping undone exactly, with these parts of the bundle's fit to a rig.
    Exact(CorrectionParts),
    /// The paper's shift by statistics of a data set, which lie in this file.
    Refit(PathBuf),
}

impl Default for ShiftChoice {
    fn default() -> Self {
        Self::Exact(CorrectionParts::ALL)
    }
}

impl ShiftChoice {
    /// The mapping itself; `bundle` is the generator's name and identity, or `None` where there are several.
    ///
    /// # Errors
    /// If the statistics cannot be read, or are not of that generator.
    pub fn mode(&self, bundle: Option<(&str, &str)>) -> Result<ShiftMode, TaskError> {
        const WHAT: &str = "Read shift statistics";
        Ok(match self {
            Self::Raw => ShiftMode::Raw,
            Self::Paper => ShiftMode::PaperShift,
            Self::Exact(parts) if *parts == CorrectionParts::ALL => ShiftMode::ExactInverse,
            Self::Exact(parts) => ShiftMode::Parts(*parts),
            Self::Refit(file) => {
                let several = || TaskError::new(WHAT, "statistics are of one generator").with_hint("Name it.");
                let (name, id) = bundle.ok_or_else(several)?;
                let read = ShiftStatistics::read(file).and_then(|statistics| statistics.shift_for(name, id));
                ShiftMode::Refit(read.map_err(|err| TaskError::from_error(WHAT, &err))?)
            }
        })
    }
}
