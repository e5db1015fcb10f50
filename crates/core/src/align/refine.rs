//! From the planar pose to all six degrees of freedom.

use serde::{Deserialize, Serialize};

use super::icp::{Dof, IcpConfig, Kernel, Rejector, Residual, Solver, Target};
use super::register::{Ask, Register, Scene};
use super::{AlignConfig, AlignError, AlignReport, TraceStep};
use crate::tool::ToolModel;

/// The default registration, then robust point to plane against the triangles with all six degrees of freedom.
///
/// The second part is held back to the planar pose: what the contacts do not tell (a rod along itself, a disc about
/// its axis) stays where the first part left it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RefineConfig {
    /// The first part.
    pub planar: AlignConfig,
    /// The second part; its starts are replaced by the planar pose.
    pub space: IcpConfig,
}

impl Default for RefineConfig {
    fn default() -> Self {
        Self {
            planar: AlignConfig::default(),
            space: IcpConfig {
                target: Target::Mesh,
                residual: Residual::PointToPlane,
                kernels: vec![Kernel::GemanMcClure { width_m: 1e-3 }],
                rejector: Rejector::MaxDistance { distance_m: 3e-3 },
                solver: Solver::LevenbergMarquardt,
                dof: Dof::Full,
                anchor: 0.02,
                points: 1024,
                max_iterations: 30,
                step_m: 5e-6,
                ..IcpConfig::default()
            },
        }
    }
}

impl Register for RefineConfig {
    fn run(&self, scene: &Scene<'_>, tool: &ToolModel, ask: Ask<'_>) -> Result<AlignReport, AlignError> {
        let planar = self.planar.run(scene, tool, ask)?;
        let starts = [planar.grasp_from_object];
        let mut report = self.space.run(scene, tool, Ask { starts: Some(&starts), ..ask })?;
        // One run from the first part's start to the second part's end. The other starts of the first part are left
        // out: their costs are not comparable with this one's.
        let first = planar.runs[planar.winner];
        let run = &mut report.runs[0];
        (run.requested, run.start) = (first.requested, first.start);
        run.iterations += first.iterations;
        report.start = first.start;
        report.iterations += planar.iterations;
        report.lookups += planar.lookups;
        (report.rung, report.ladder, report.certificate) = (planar.rung, planar.ladder, planar.certificate);
        let mut trace: Vec<TraceStep> = planar.trace.into_iter().filter(|s| s.run == planar.winner).collect();
        let so_far = trace.last().map_or(0, |s| s.iteration);
        trace.iter_mut().for_each(|s| s.run = 0);
        trace.extend(report.trace.into_iter().map(|s| TraceStep { iteration: s.iteration + so_far, ..s }));
        report.trace = trace;
        Ok(report)
    }
}
