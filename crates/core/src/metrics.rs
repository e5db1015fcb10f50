//! Metrics of predictions, masks and poses. Every range is explicit, and every special case has a name.
//!
//! Sums run in f64. Pixels that are not finite in either image are left out of the error metrics.

mod angle;
mod color;
mod frechet;
mod image;
mod ssim;
mod unstretched;

pub use angle::AngleSummary;
pub use color::{LEVELS, color, planes};
pub use frechet::frechet_distance;
pub use image::{MetricError, mse, psnr, unit_range};
pub use ssim::{SsimRange, ssim};
pub use unstretched::{Unstretched, unstretched};
