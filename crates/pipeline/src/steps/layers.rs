//! Looking into a registration: the recorded run, and what the layers show of it.

use crate::error::TaskError;
use crate::steps::cloud::FingerCloud;
use crate::steps::estimate::Estimate;
use crate::steps::pose::PoseResult;
use touch2touch_core::align::PointFit;
use touch2touch_core::align::reason::{self, Reason, ReasonCounts, reasons};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::Grid;
use touch2touch_core::rig::{PadId, PerPad};

/// Layers of one registration.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerResult {
    /// The registered pose that they are of, `grasp_from_object`.
    pub grasp_from_object: PlanarPose,
    /// The reason of every pixel.
    pub reasons: PerPad<Grid<Reason>>,
    /// Residual (meters) and weight of every contact point, in the order of the cloud.
    pub fits: PerPad<Vec<PointFit>>,
    /// Pixels per reason.
    pub counts: PerPad<ReasonCounts>,
    /// Largest residual of the heat map, meters.
    pub range_m: f64,
    /// Width of the narrowest kernel, meters; `None` for an engine without one.
    pub kernel_m: Option<f64>,
}

impl LayerResult {
    /// Residual, weight and reason at a raw bubble pixel; the fit only where the pixel is a contact point.
    pub fn at(&self, finger: PadId, cloud: &FingerCloud, pixel: [u16; 2]) -> Option<(Reason, Option<PointFit>)> {
        let (x, y) = (usize::from(pixel[0]), usize::from(pixel[1]));
        let reason = *self.reasons[finger].as_ref()?.get(x, y)?;
        let fit = cloud.at_pixel(x, y).filter(|at| cloud.contact.get(*at) == Some(&true)).and_then(|at| {
            let before = cloud.contact[..at].iter().filter(|c| **c).count();
            self.fits[finger].as_ref()?.get(before).copied()
        });
        Some((reason, fit))
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let pixels: usize = self.reasons.iter().flatten().map(Grid::len).sum();
        pixels + self.fits.iter().flatten().map(|f| f.len() * size_of::<PointFit>()).sum::<usize>() + size_of::<Self>()
    }
}

/// Range of the heat map in widths of the kernel: where the gate is, and a little beyond.
const RANGE_KERNELS: f64 = 4.0;
/// Range of the heat map for an engine without a kernel, meters.
const RANGE_M: f64 = 4e-3;

/// Layers of a recorded registration of an estimate with its surface.
///
/// # Errors
/// If the run did not record what became of the points, or they are not those of the estimate.
pub fn layers(estimate: &Estimate, run: &PoseResult) -> Result<LayerResult, TaskError> {
    const WHAT: &str = "Layers";
    let (clouds, masks) = (estimate.surface(), &estimate.contact().masks);
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
        grids[finger] = masks[finger].as_ref().and_then(|found| reasons(&found.mask, &pixels, part));
    }
    if !rest.is_empty() {
        return Err(TaskError::new(WHAT, "the registration was of other points than those shown"));
    }
    let kernel_m = run.report.trace.iter().map(|step| step.kernel_m).filter(|k| k.is_finite()).reduce(f64::min);
    let range_m = kernel_m.map_or(RANGE_M, |k| k * RANGE_KERNELS);
    Ok(LayerResult {
        grasp_from_object: run.grasp_from_object,
        counts: grids.as_ref().map(|grid| grid.map(|grid| reason::counts([grid]))),
        reasons: grids,
        fits,
        range_m,
        kernel_m,
    })
}
