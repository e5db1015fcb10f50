//! [`Config`]: how the generator is tuned. The defaults are the recipe that real sensors asked for.

use crate::augment::Augment;
use crate::error::{Error, Result};

/// Networks that learn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trained {
    /// Encoder, denoiser and decoder.
    #[default]
    All,
    /// The condition encoder alone.
    Encoder,
}

/// Settings of the tuning of a generator.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Steps of the whole plan; the rates follow it.
    pub steps: usize,
    /// Pairs per step.
    pub batch: usize,
    /// Decides order, variations and noise.
    pub seed: u64,
    /// Networks that learn. Line, shift and field always do.
    pub trained: Trained,
    /// Rate of the networks.
    pub network_rate: f32,
    /// Rate of the line.
    pub line_rate: f32,
    /// Rate of the shifts, pixels.
    pub shift_rate: f32,
    /// Rate of the fields.
    pub field_rate: f32,
    /// Pull of the networks' weights toward zero.
    pub decay: f32,
    /// Pull of the networks' weights toward where they began: what was learned in simulation is forgotten less. Up to 30 it
    /// costs the sensor nothing that was measurable, 100 a little, for twice the effect.
    pub anchor: f32,
    /// Steps of rising rates.
    pub warm_up: usize,
    /// Share of the rates that is left at the end.
    pub rest: f32,
    /// Longest gradient.
    pub clip: f32,
    /// Share of the steps with a second denoising step.
    pub second: f64,
    /// Share of simulated pairs in a batch, where there are pairs of both kinds. An eighth keeps what the bundle knows of
    /// simulated touches but for 0.2 dB, and costs the sensor as little; a quarter keeps all of it for another 0.2 dB.
    pub simulated: f64,
    /// Ranges in which pairs are varied.
    pub augment: Augment,
    /// Threads; `None` for as many as there are cores, four at most. The result does not depend on it.
    pub threads: Option<usize>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            steps: 50,
            batch: 12,
            seed: 42,
            trained: Trained::All,
            network_rate: 6e-4,
            line_rate: 6e-4,
            shift_rate: 0.02,
            field_rate: 2e-3,
            decay: 0.01,
            anchor: 10.0,
            warm_up: 10,
            rest: 0.02,
            clip: 1.0,
            second: 0.3,
            simulated: 0.125,
            augment: Augment::default(),
            threads: None,
        }
    }
}

impl Config {
    /// Refuses settings out of range.
    pub(crate) fn check(&self) -> Result<()> {
        let a = &self.augment;
        let at_least_0 = [
            ("network_rate", f64::from(self.network_rate)),
            ("line_rate", f64::from(self.line_rate)),
            ("shift_rate", f64::from(self.shift_rate)),
            ("field_rate", f64::from(self.field_rate)),
            ("decay", f64::from(self.decay)),
            ("anchor", f64::from(self.anchor)),
            ("rest", f64::from(self.rest)),
            ("augment.shift", a.shift),
            ("augment.colors", a.colors),
            ("augment.gain", a.gain),
            ("augment.blur", a.blur),
            ("augment.noise", a.noise),
        ];
        let shares = [("second", self.second), ("simulated", self.simulated), ("augment.clipped", a.clipped)];
        let refuse = |setting, found: String, must| Err(Error::Config { setting, found, must });
        for (setting, value) in at_least_0 {
            if !(value.is_finite() && value >= 0.0) {
                return refuse(setting, value.to_string(), "a number of at least 0");
            }
        }
        for (setting, value) in shares {
            if !(0.0..=1.0).contains(&value) {
                return refuse(setting, value.to_string(), "between 0 and 1");
            }
        }
        if !(self.clip.is_finite() && self.clip > 0.0) {
            return refuse("clip", self.clip.to_string(), "a number above 0");
        }
        if a.imprint_per_picture.iter().any(|v| !v.is_finite()) {
            return refuse("augment.imprint_per_picture", format!("{:?}", a.imprint_per_picture), "two numbers");
        }
        match (self.batch, self.steps) {
            (1..=1024, 1..=1_000_000) => Ok(()),
            (1..=1024, steps) => refuse("steps", steps.to_string(), "between 1 and 1,000,000"),
            (batch, _) => refuse("batch", batch.to_string(), "between 1 and 1024"),
        }
    }
}
