//! Latent diffusion without a model: schedules, seeded noise, and the DDIM sampler.
//!
//! A model is anything that implements [`Denoiser`]; the graphs of a bundle do (module `infer::generator`), and so do
//! the closed-form denoisers of the tests. [`sample`] runs the loop; it owns no thread and can be cancelled between
//! two steps through its progress closure.
//!
//! Sources: Song et al., "Denoising Diffusion Implicit Models" (2021), equations 12 and 16; the schedule and the
//! spacing of the public latent-diffusion release.

mod ddim;
mod denoiser;
mod noise;
mod preset;
mod schedule;
mod tensor;
mod watch;

pub use ddim::{DiffusionError, GenerateConfig, Sampler, sample};
pub use denoiser::{Denoiser, ModelError, Prediction};
pub use noise::GaussianNoise;
pub use preset::Preset;
pub use schedule::{Schedule, ScheduleError, Spacing, Step};
pub use tensor::Tensor;
pub use watch::{Progress, Watch};
