//! [`Config`]: how the generator is tuned. The defaults are the recipe that real sensors asked for.

use crate::augment::Augment;

/// Settings of the tuning of a generator.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Steps of the whole plan; the rates follow it.
    pub steps: usize,
    /// Pairs per step.
    pub batch: usize,
    /// Decides order, variations and noise.
    pub seed: u64,
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
            network_rate: 6e-4,
            line_rate: 6e-4,
            shift_rate: 0.02,
            field_rate: 2e-3,
            decay: 0.01,
            anchor: 10.0,
            second: 0.3,
            simulated: 0.125,
            augment: Augment::default(),
            threads: None,
        }
    }
}
