//! Looking into a registration: the recorded run, and what the layers show of it.

use super::super::error::TaskError;
use super::super::results::{Clouds, LayerResult, PoseResult};
use crate::domain::align::PointFit;
use crate::domain::align::reason::{self, reasons};
use crate::domain::grid::Mask;
use crate::domain::rig::PerPad;

/// Bars of the histogram of residuals.
pub const BARS: usize = 40;
/// Range of the histogram and of the heat map in widths of the kernel: where the gate is, and a little beyond.
const RANGE_KERNELS: f64 = 4.0;
/// The same for an engine without a kernel, metres.
const RANGE_M: f64 = 4e-3;

/// What the layers show of a recorded registration of `clouds` with the masks they were made with.
///
/// # Errors
/// If the run did not record what became of the points, or they are not those of the clouds.
pub fn layers(clouds: &Clouds, masks: &PerPad<&Mask>, run: &PoseResult) -> Result<LayerResult, TaskError> {
    const WHAT: &str = "Layers";
    let mut rest = run.report.fits.as_slice();
    let mut grids = PerPad::default();
    let mut fits = PerPad::default();
    for (finger, cloud) in clouds.fingers.entries() {
        let contact = cloud.pixels.iter().zip(&cloud.contact).filter(|(_, contact)| **contact);
        let pixels: Vec<[u16; 2]> = contact.map(|(pixel, _)| *pixel).collect();
        let Some((part, others)) = rest.split_at_checked(pixels.len()) else {
            return Err(TaskError::new(WHAT, "the registration did not record what became of its points"));
        };
        rest = others;
        fits[finger] = Some(part.to_vec());
        grids[finger] = masks[finger].and_then(|mask| reasons(mask, &pixels, part));
    }
    if !rest.is_empty() {
        return Err(TaskError::new(WHAT, "the registration was of other points than those shown"));
    }
    let kernel_m = run.report.trace.iter().map(|step| step.kernel_m).filter(|k| k.is_finite()).reduce(f64::min);
    let range_m = kernel_m.map_or(RANGE_M, |k| k * RANGE_KERNELS);
    let (histogram, above) = histogram(fits.iter().flatten().flatten(), range_m);
    Ok(LayerResult {
        grasp_from_object: run.grasp_from_object,
        counts: grids.as_ref().map(|grid| grid.map(|grid| reason::counts([grid]))),
        reasons: grids,
        fits,
        histogram,
        above,
        range_m,
        kernel_m,
        directions: run.report.directions,
    })
}

/// Residuals by size in [`BARS`] equal steps up to `range_m`, and how many are larger. What is not finite is left out.
fn histogram<'a>(fits: impl Iterator<Item = &'a PointFit>, range_m: f64) -> (Vec<u32>, u32) {
    let mut bars = vec![0; BARS];
    let mut above = 0;
    for residual in fits.map(|fit| f64::from(fit.residual_m)).filter(|r| r.is_finite()) {
        match bars.get_mut((residual / range_m * BARS as f64) as usize) {
            Some(bar) => *bar += 1,
            None => above += 1,
        }
    }
    (bars, above)
}
