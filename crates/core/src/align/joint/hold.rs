//! [`Hold`]: how firmly membranes hold a pose against the mask.

use glam::DVec2;
use nalgebra::Matrix3;

use super::JointConfig;
use super::problem::Problem;
use crate::align::{ANGLE_SCALE_M, AlignReport, Scene};
use crate::tool::ToolModel;

/// Curvature of the membranes' part of the joint cost at its answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// About (angle times [`ANGLE_SCALE_M`], y, z) of the tool turned about `center`, in the unit of the mask's mean squared
    /// distance, so that it adds to the mean curvature of the mask's points.
    curvature: Matrix3<f64>,
    /// `(y, z)`, meters, grasp frame.
    center: DVec2,
    /// Width of the mask's kernel beside it, meters.
    pub kernel_m: f64,
}

impl Hold {
    /// The hold of a report's answer; `None` where membrane and mask did not both have a say.
    pub fn of(scene: &Scene<'_>, tool: &ToolModel, report: &AlignReport) -> Option<Self> {
        let fit = report.joint.filter(|fit| fit.basis.has_membrane() && fit.mask_weight > 0.0)?;
        let config = JointConfig::default();
        let problem = Problem::new(scene, tool, &config).ok()??;
        let kernel_m = config.mask_kernels_m[1];
        let curvature = problem.answer_curvature(report.grasp_from_object) * (kernel_m * kernel_m / fit.mask_weight);
        Some(Self { curvature, center: problem.centroid(), kernel_m })
    }

    /// The curvature about motions in which the tool turns about another point.
    pub(crate) fn about(&self, center: DVec2) -> Matrix3<f64> {
        let arm = (self.center - center).perp() / ANGLE_SCALE_M;
        let to_own = Matrix3::new(1.0, 0.0, 0.0, arm.x, 1.0, 0.0, arm.y, 0.0, 1.0);
        to_own.transpose() * self.curvature * to_own
    }
}
