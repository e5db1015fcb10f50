//! Fine-tuning on a CPU, inside the program: the shipped generator learns a sensor from a few measured pairs.
//!
//! [`Tuner`] is the whole of it for the generator: it takes a bundle's three graphs ([`Start`]) and [`Pair`]s, makes one step at a time,
//! and gives the graphs back with other weights in them, together with what lies behind the decoder ([`Placement`]).
//!
//! [`MaskTuner`] does the same for the mask network, from imprints with [`MaskTouch`]es that people corrected. Both are a
//! [`Descent`].
//!
//! Below them, nothing knows of either network: [`trainer::Trainer`] descends any [`trainer::Objective`] over named weights
//! ([`params::Params`]) that [`onnx::Onnx`] reads and writes; [`tape`] differentiates, [`ops`] and [`optim`] do the
//! arithmetic, [`state`] keeps a run across a stop. A further network is one more file in [`nets`] and an objective of its own.
//!
//! Results are the same to the last bit from run to run and whatever the number of threads; kinds of processors differ
//! in the last digits.

mod augment;
mod config;
mod error;
mod image;
mod masks;
pub mod nets;
pub mod onnx;
pub mod ops;
pub mod optim;
mod pair;
pub mod params;
pub mod random;
mod recipe;
pub mod state;
pub mod tape;
pub mod trainer;
mod tuner;

pub use augment::Augment;
pub use config::Config;
pub use error::{Error, Result};
pub use masks::{Cast, MaskConfig, MaskStart, MaskTouch, MaskTuner, Sensors};
pub use pair::Pair;
pub use trainer::Descent;
pub use tuner::{NoiseSchedule, Placement, Query, Sampler, Start, Tuned, Tuner};

#[cfg(test)]
mod fixture;
