//! The ICP family, one loop put together from small values: what the contacts are compared with, how a pair's
//! distance counts, what outliers cost, which pairs are left out, how a step is found, and which motions are open.
//!
//! These are the peers of the default registration, and the step to all six degrees of freedom.
//!
//! Source: Besl and McKay, A method for registration of 3-D shapes, 1992; Chen and Medioni, Object modeling by
//! registration of multiple range images, 1992.

mod policy;
mod prepared;
mod problem;
mod samples;
mod tree;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::register::{Ask, CleanScene, Register, Scene, check_overlap, clean_scene};
use super::{
    AlignError, AlignReport, Fate, MIN_POINTS, MIN_SHARE, PointFit, Prior, Run, Rung, Stop, TraceStep, observability,
};
use crate::frames::PlanarPose;
use crate::mesh::sampling::spread;
use crate::tool::ToolModel;

pub(crate) use policy::{Dof, Rejector, Solver};
pub use policy::{Kernel, Residual, Target};
pub use prepared::{in_space, silhouette};
use problem::{Problem, State, Sums};
pub(super) use samples::Matcher;
pub use samples::Samples;

/// A step that moves no point by more than about this, meters, ends the search with a wide kernel.
const STEP_COARSE_M: f64 = 5e-5;
/// Damping at the start and at the end of patience, per unit of weight.
const DAMPING_START: f64 = 1e-3;
const DAMPING_MAX: f64 = 1e4;

/// An ICP. Lengths in meters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct IcpConfig {
    /// Model that the contacts are compared with.
    pub target: Target,
    /// Measure of the distance of a pair.
    pub residual: Residual,
    /// Kernels that make costs of residuals, one after the other; the last one decides. Not empty.
    pub kernels: Vec<Kernel>,
    /// Rule by which pairs are left out.
    pub rejector: Rejector,
    /// Method that finds a step.
    pub solver: Solver,
    /// Motions that are open.
    pub dof: Dof,
    /// Pull back to the start, as a share of the contacts' own pull: what the contacts do not tell stays put.
    pub anchor: f64,
    /// Poses to start from, `grasp_from_object`. Not empty.
    pub starts: Vec<PlanarPose>,
    /// Contacts used; more are thinned evenly.
    pub points: usize,
    /// Most steps per start and kernel.
    pub max_iterations: usize,
    /// A step that moves no point by more than about this ends the search.
    pub step_m: f64,
}

impl Default for IcpConfig {
    /// Planar point to point on the silhouette, without robustness.
    fn default() -> Self {
        Self {
            target: Target::Silhouette,
            residual: Residual::PointToPoint,
            kernels: vec![Kernel::None],
            rejector: Rejector::None,
            solver: Solver::ClosedForm,
            dof: Dof::Planar,
            anchor: 0.0,
            starts: ten_starts(),
            points: 1024,
            max_iterations: 100,
            step_m: 1e-6,
        }
    }
}

/// Wide to narrow, as for the default registration.
fn robust() -> Vec<Kernel> {
    [4e-3, 2e-3, 1e-3].map(|width_m| Kernel::GemanMcClure { width_m }).to_vec()
}

/// The angles from -22.5 to 22.5 degrees, 5 apart, at the middle of the gripper.
pub(crate) fn ten_starts() -> Vec<PlanarPose> {
    (0..10)
        .map(|i| PlanarPose { theta_rad: (f64::from(i) * 5.0 - 22.5).to_radians(), ..PlanarPose::default() })
        .collect()
}

impl IcpConfig {
    /// Point to point on the silhouette; pairs more than 3 mm apart are left out.
    pub(crate) fn planar_point_to_point() -> Self {
        Self { rejector: Rejector::MaxDistance { distance_m: 3e-3 }, ..Self::default() }
    }

    /// Point to plane on the silhouette with a redescending kernel.
    pub(crate) fn planar_point_to_plane() -> Self {
        Self {
            residual: Residual::PointToPlane,
            kernels: robust(),
            solver: Solver::LevenbergMarquardt,
            ..Self::default()
        }
    }

    /// Generalized-ICP, moved in the plane only.
    pub(crate) fn planar_gicp() -> Self {
        Self { dof: Dof::Planar, ..Self::gicp() }
    }

    /// Point to point in space; pairs more than 3 mm apart are left out.
    pub(crate) fn point_to_point() -> Self {
        Self { target: Target::Surface, dof: Dof::Full, ..Self::planar_point_to_point() }
    }

    /// Point to plane in space; pairs more than 3 mm apart are left out. A redescending kernel would let go of the
    /// few contacts beside the tool, which alone tell the angle.
    pub(crate) fn point_to_plane() -> Self {
        Self { residual: Residual::PointToPlane, solver: Solver::LevenbergMarquardt, ..Self::point_to_point() }
    }

    /// Generalized-ICP in space with Huber's kernel; pairs more than 2 mm apart are left out.
    pub(crate) fn gicp() -> Self {
        Self {
            residual: Residual::Generalized,
            kernels: vec![Kernel::Huber { width_m: 5e-4 }],
            rejector: Rejector::MaxDistance { distance_m: 2e-3 },
            ..Self::point_to_plane()
        }
    }

    fn check(&self) -> Result<(), AlignError> {
        let bad = |what| Err(AlignError::Config { what });
        let length = |l: f64| l.is_finite() && l > 0.0;
        if self.kernels.is_empty() || self.kernels.iter().any(|k| k.width_m().is_nan() || k.width_m() <= 1e-6) {
            return bad("kernels");
        }
        match self.rejector {
            Rejector::MaxDistance { distance_m } if !length(distance_m) => return bad("rejector"),
            Rejector::Trimmed { keep } if !(keep > 0.0 && keep <= 1.0) => return bad("rejector"),
            _ => {}
        }
        if self.solver == Solver::ClosedForm && (self.residual != Residual::PointToPoint || self.anchor != 0.0) {
            return bad("solver");
        }
        if self.target == Target::Silhouette && self.dof == Dof::Full {
            return bad("dof");
        }
        // Seen along the closing axis the contacts fill an area: they have no surface, and so no normals.
        if self.target == Target::Silhouette && self.residual == Residual::Generalized {
            return bad("residual");
        }
        if !(self.anchor.is_finite() && self.anchor >= 0.0) {
            return bad("anchor");
        }
        if self.points < MIN_POINTS {
            return bad("points");
        }
        if self.max_iterations == 0 {
            return bad("max_iterations");
        }
        if !length(self.step_m) { bad("step_m") } else { Ok(()) }
    }
}

impl Register for IcpConfig {
    fn run(&self, scene: &Scene<'_>, tool: &ToolModel, ask: Ask<'_>) -> Result<AlignReport, AlignError> {
        self.check()?;
        let starts = ask.starts.unwrap_or(&self.starts);
        if starts.is_empty() || starts.iter().any(|s| !s.is_finite()) {
            return Err(AlignError::Config { what: "starts" });
        }
        let mut clean = clean_scene(scene, MIN_POINTS)?;
        if self.target == Target::Silhouette {
            // Seen along the closing axis there is no distance along it.
            clean.centroid.x = 0.0;
            clean.points.iter_mut().for_each(|p| p.x = 0.0);
        }
        let chosen: Vec<DVec3> = spread(clean.points.len(), self.points).into_iter().map(|i| clean.points[i]).collect();
        let chosen_yz: Vec<DVec2> = chosen.iter().map(|p| DVec2::new(p.y, p.z)).collect();
        check_overlap(chosen_yz.iter().copied(), &tool.field, starts)?;
        let mut problem = Problem::new(self, tool, &chosen, &clean.points, clean.centroid);
        if problem.model_points() < MIN_POINTS {
            return Err(AlignError::EmptyModel { got: problem.model_points() });
        }
        let mut trace =
            Trace { steps: Vec::new(), record: ask.record, full: self.dof == Dof::Full, run: 0, points: problem.len() };
        let ends: Vec<End> = starts
            .iter()
            .enumerate()
            .map(|(run, start)| {
                trace.run = run;
                self.descend(&mut problem, State::from_pose(*start, clean.centroid), clean.centroid, &mut trace)
            })
            .collect();
        // In the order of the starts where equal.
        let winner = (0..ends.len()).min_by(|&a, &b| ends[a].sums.cost.total_cmp(&ends[b].sums.cost)).unwrap_or(0);
        let best = &ends[winner];
        let inlier_share = best.sums.inliers as f64 / problem.len() as f64;
        if inlier_share < MIN_SHARE {
            return Err(AlignError::NoOverlap { share: inlier_share });
        }
        let pose = best.state.to_planar(clean.centroid);
        Ok(AlignReport {
            grasp_from_object: pose,
            grasp_from_object_6dof: (self.dof == Dof::Full).then(|| best.state.to_affine(clean.centroid)),
            converged: best.stop.converged(),
            stop: best.stop,
            start: starts[winner],
            runs: ends
                .iter()
                .zip(starts)
                .map(|(end, start)| Run {
                    requested: *start,
                    start: *start,
                    end: end.state.to_planar(clean.centroid),
                    cost_m2: end.sums.cost,
                    iterations: end.iterations,
                    stop: end.stop,
                })
                .collect(),
            winner,
            rung: Rung::Fixed,
            ladder: Vec::new(),
            certificate: None,
            iterations: ends.iter().map(|e| e.iterations).sum(),
            lookups: problem.lookups,
            offered: scene.points().len(),
            not_finite: clean.not_finite,
            used: problem.len(),
            inlier_share,
            inlier_rms_m: (best.sums.inlier_squares / (best.sums.inliers as f64).max(1.0)).sqrt(),
            within_prior: Prior::default().allows(pose),
            observability: Some(observability(&chosen_yz, &tool.field, pose)),
            joint: None,
            evidence: None,
            fits: if ask.record { self.fits(tool, &clean, best.state) } else { Vec::new() },
            trace: trace.steps,
        })
    }
}

/// End of the run from one start.
struct End {
    state: State,
    sums: Sums,
    iterations: usize,
    stop: Stop,
}

struct Trace {
    steps: Vec<TraceStep>,
    record: bool,
    full: bool,
    run: usize,
    points: usize,
}

impl Trace {
    fn note(&mut self, iteration: usize, state: State, centroid: DVec3, sums: &Sums, kernel: Kernel) {
        if self.record {
            self.steps.push(TraceStep {
                run: self.run,
                iteration,
                grasp_from_object: state.to_planar(centroid),
                grasp_from_object_6dof: self.full.then(|| state.to_affine(centroid)),
                cost_m2: sums.cost,
                mask_cost_m2: None,
                inlier_share: sums.inliers as f64 / self.points as f64,
                kernel_m: kernel.width_m(),
                points: self.points,
            });
        }
    }
}

impl IcpConfig {
    /// The one loop: pair, weigh, step, until nothing moves.
    fn descend(&self, problem: &mut Problem<'_>, start: State, centroid: DVec3, trace: &mut Trace) -> End {
        let mut end = End { state: start, sums: Sums::default(), iterations: 0, stop: Stop::IterationLimit };
        // Repeated pairs repeat the step only if nothing but the pairs decides it.
        let fixed = self.solver == Solver::ClosedForm && self.rejector == Rejector::None;
        for (stage, &kernel) in self.kernels.iter().enumerate() {
            let last = stage + 1 == self.kernels.len();
            let small = if last { self.step_m } else { self.step_m.max(STEP_COARSE_M) };
            let fixed = fixed && kernel == Kernel::None;
            let mut damping = DAMPING_START;
            end.stop = Stop::IterationLimit;
            end.sums = problem.look(end.state, kernel, start);
            trace.note(end.iterations, end.state, centroid, &end.sums, kernel);
            for _ in 0..self.max_iterations {
                let Some((state, moved)) = problem.step(end.state, damping, start) else {
                    damping *= 10.0;
                    if damping > DAMPING_MAX || self.solver == Solver::ClosedForm {
                        end.stop = Stop::NoDescent;
                        break;
                    }
                    continue;
                };
                if moved < small {
                    end.stop = Stop::SmallStep;
                    break;
                }
                let sums = problem.look(state, kernel, start);
                if self.solver == Solver::ClosedForm || sums.cost < end.sums.cost {
                    (end.state, end.sums) = (state, sums);
                    end.iterations += 1;
                    damping = (damping * 0.1).max(1e-6);
                    trace.note(end.iterations, state, centroid, &sums, kernel);
                    if fixed && !sums.changed {
                        end.stop = Stop::FixedPoint;
                        break;
                    }
                } else {
                    damping *= 10.0;
                    if damping > DAMPING_MAX {
                        end.stop = Stop::NoDescent;
                        break;
                    }
                    // The pairs of the refused state are no base for the next step.
                    problem.look(end.state, kernel, start);
                }
            }
        }
        end
    }

    /// Every offered point at the final state.
    fn fits(&self, tool: &ToolModel, clean: &CleanScene, state: State) -> Vec<PointFit> {
        let kernel = self.kernels[self.kernels.len() - 1];
        let mut problem = Problem::new(self, tool, &clean.points, &clean.points, clean.centroid);
        problem.look(state, kernel, state);
        let mut outcome = problem.outcome(kernel);
        clean
            .kept
            .iter()
            .map(|kept| match if *kept { outcome.next() } else { None } {
                Some((residual, weight, fate)) => PointFit { residual_m: residual as f32, weight: weight as f32, fate },
                None => PointFit { residual_m: f32::NAN, weight: 0.0, fate: Fate::NotFinite },
            })
            .collect()
    }
}

#[cfg(test)]
mod tests;
