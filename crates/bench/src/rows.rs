//! A case ready to be registered, and a row of the table of registrations.

use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::figures::Summary;
use super::reliability::Reliability;
use touch2touch_bench::known::Stratum;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::PoseDifference;
use touch2touch_core::symmetry::Symmetry;

/// A case ready to be registered.
pub(super) struct Prepared {
    pub(super) name: String,
    pub(super) stratum: Stratum,
    pub(super) tool: usize,
    pub(super) straight: bool,
    pub(super) truth: PlanarPose,
    pub(super) symmetry: Arc<Symmetry>,
    /// Contact points, grasp frame, meters.
    pub(super) points: Vec<DVec3>,
}

impl Prepared {
    /// The true pose; of equal ones, by the tool's symmetry, the one nearest to another pose.
    pub(super) fn truth_near(&self, pose: PlanarPose) -> PlanarPose {
        self.symmetry.nearest(self.truth, pose)
    }
}

/// One row of the table.
#[derive(Debug, Serialize)]
pub(super) struct EngineRow {
    pub(super) name: String,
    pub(super) label: String,
    /// True where it is another project's library.
    pub(super) peer: bool,
    #[serde(flatten)]
    pub(super) summary: Summary,
    /// Mean processor time of a pose, milliseconds, where the system tells: what is left of the times when other
    /// programs are taken out.
    pub(super) cpu_mean_ms: Option<f64>,
    /// Errors in the standard deviations that the poses come with.
    pub(super) reliability: Option<Reliability>,
    /// One value per case in the order of `cases`, `null` where there is no pose or the case was not run.
    pub(super) error_deg: Vec<Option<f64>>,
    pub(super) ms: Vec<Option<f64>>,
    /// Estimated minus true place (y, z), millimeters, likewise.
    pub(super) offset_mm: Vec<Option<[f64; 2]>>,
}

/// From the true to the estimated place (y, z), millimeters.
pub(super) fn offset(estimated: PlanarPose, truth: PlanarPose) -> [f64; 2] {
    [(estimated.y_m - truth.y_m) * 1e3, (estimated.z_m - truth.z_m) * 1e3]
}

/// Distance between the two places, millimeters.
pub(super) fn position_error_mm(estimated: PlanarPose, truth: PlanarPose) -> f64 {
    PoseDifference::between(estimated, truth).position_m * 1e3
}
