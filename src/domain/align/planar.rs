//! The default engine: three numbers, a distance field, a redescending kernel, Levenberg-Marquardt.
//!
//! Why redescending: masks contain blobs and halos that are not the tool. A squared cost follows them even when
//! started at the truth; the Geman-McClure kernel lets them go. Why graduated: a narrow kernel alone sees only what
//! is already close.

use glam::DVec2;

use super::{
    ANGLE_SCALE_M, AlignConfig, AlignError, AlignReport, DistanceField, Fate, MIN_POINTS, PointFit, Run, Rung, Stop,
    TraceStep, clean, observability,
};
use crate::domain::frames::PlanarPose;
use crate::domain::mesh::sampling::spread;

/// A step that moves no point by more than about this, metres, ends the search with the narrowest kernel.
const STEP_FINE_M: f64 = 5e-6;
/// The same for the wider kernels, whose end is only the next start.
const STEP_COARSE_M: f64 = 5e-5;
/// Damping at the start and at the end of patience, per unit of weight.
const DAMPING_START: f64 = 1e-3;
const DAMPING_MAX: f64 = 1e4;
/// Fewest points, as a share, that must lie within `REACH_M` of the silhouette at one start, and within the kernel
/// at the end: below, there is nothing to align.
const MIN_SHARE: f64 = 0.05;
/// What a start can be expected to bridge, metres: the prior's shift and the sweep of its angle.
const REACH_M: f64 = 0.012;

/// Finds the planar pose under which the points lie on the tool's silhouette.
///
/// Points are `(y, z)` in the grasp frame, metres; those that are not finite are dropped and counted. The result does
/// not depend on threads, clocks or earlier calls.
///
/// # Errors
/// [`AlignError`] for fewer than [`MIN_POINTS`] points, points in one spot, points away from the tool, or settings
/// that make no sense.
pub fn align(points_yz: &[DVec2], field: &DistanceField, config: &AlignConfig) -> Result<AlignReport, AlignError> {
    check(config)?;
    let cleaned = clean(points_yz, MIN_POINTS)?;
    let c = cleaned.centroid;
    let chosen: Vec<DVec2> =
        spread(cleaned.points.len(), config.points).into_iter().map(|i| cleaned.points[i] - c).collect();
    let scouts: Vec<DVec2> = spread(chosen.len(), config.scout_points).into_iter().map(|i| chosen[i]).collect();

    let mut search =
        Search { field, centroid: c, lookups: 0, trace: Vec::new(), record: config.record, max: config.max_iterations };
    let final_kernel = config.kernels_m[config.kernels_m.len() - 1];

    let states: Vec<State> = config.starts.iter().map(|s| State::from_pose(*s, c)).collect();
    let reach = states.iter().map(|s| search.share_within(&scouts, *s, REACH_M)).fold(0.0, f64::max);
    if reach < MIN_SHARE {
        return Err(AlignError::NoOverlap { share: reach });
    }

    // All starts go through the kernels side by side, so that runs that meet go on as one.
    let mut runs: Vec<Progress> = states.into_iter().map(Progress::new).collect();
    for kernel in &config.kernels_m {
        for (run, progress) in runs.iter_mut().enumerate().filter(|(_, p)| p.merged_into.is_none()) {
            search.descend(run, progress, &scouts, *kernel, STEP_COARSE_M);
        }
        merge_met(&mut runs);
    }
    // The few best are refined with all points.
    let mut order: Vec<usize> = (0..runs.len()).filter(|&r| runs[r].merged_into.is_none()).collect();
    order.sort_by(|&a, &b| runs[a].cost.total_cmp(&runs[b].cost));
    let (refined, rest) = order.split_at(config.keep.min(order.len()));
    for &run in refined {
        search.descend(run, &mut runs[run], &chosen, final_kernel, STEP_FINE_M);
    }
    // The others only get their cost, with the same points, so that all are comparable.
    for &run in rest {
        runs[run].cost = search.normal_equations(&chosen, runs[run].state, final_kernel).cost / chosen.len() as f64;
    }
    let cheapest =
        |candidates: &[usize]| candidates.iter().copied().min_by(|&a, &b| runs[a].cost.total_cmp(&runs[b].cost));
    let winner = cheapest(refined).unwrap_or(0);
    let best = &runs[winner];
    let inlier_share = best.inliers as f64 / chosen.len() as f64;
    if inlier_share < MIN_SHARE {
        return Err(AlignError::NoOverlap { share: inlier_share });
    }
    let pose = best.state.to_pose(c);
    let fits = if config.record { fits(points_yz, field, pose, final_kernel) } else { Vec::new() };
    let absolute: Vec<DVec2> = chosen.iter().map(|p| *p + c).collect();
    Ok(AlignReport {
        grasp_from_object: pose,
        grasp_from_object_6dof: None,
        converged: best.stop.converged(),
        stop: best.stop,
        start: config.starts[winner],
        runs: runs
            .iter()
            .zip(&config.starts)
            .map(|(run, start)| {
                let last = run.merged_into.map_or(run, |other| &runs[other]);
                Run {
                    requested: *start,
                    start: *start,
                    end: last.state.to_pose(c),
                    cost_m2: last.cost,
                    iterations: run.iterations,
                    stop: run.stop,
                }
            })
            .collect(),
        winner,
        rung: Rung::Fixed,
        ladder: Vec::new(),
        certificate: None,
        iterations: runs.iter().map(|r| r.iterations).sum(),
        lookups: search.lookups,
        offered: points_yz.len(),
        not_finite: cleaned.not_finite,
        used: chosen.len(),
        inlier_share,
        inlier_rms_m: (best.inlier_squares / (best.inliers as f64).max(1.0)).sqrt(),
        within_prior: config.prior.allows(pose),
        observability: Some(observability(&absolute, field, pose)),
        directions: None,
        trace: search.trace,
        fits,
    })
}

fn check(config: &AlignConfig) -> Result<(), AlignError> {
    let bad = |what| Err(AlignError::Config { what });
    if config.starts.is_empty() || config.starts.iter().any(|s| !s.is_finite()) {
        return bad("starts");
    }
    if config.kernels_m.is_empty() || config.kernels_m.iter().any(|k| !(k.is_finite() && *k > 1e-6)) {
        return bad("kernels_m");
    }
    if config.points < MIN_POINTS {
        return bad("points");
    }
    if config.scout_points < MIN_POINTS {
        return bad("scout_points");
    }
    if config.keep == 0 {
        return bad("keep");
    }
    if config.max_iterations == 0 {
        return bad("max_iterations");
    }
    Ok(())
}

/// `object_from_grasp` about the points' centroid: `q = R(phi) (p - centroid) + place`.
#[derive(Clone, Copy, Debug)]
struct State {
    phi: f64,
    place: DVec2,
}

impl State {
    fn from_pose(grasp_from_object: PlanarPose, centroid: DVec2) -> Self {
        let inverse = grasp_from_object.inverse();
        Self { phi: inverse.theta_rad, place: inverse.transform_yz(centroid) }
    }

    fn to_pose(self, centroid: DVec2) -> PlanarPose {
        let shift = self.place - DVec2::from_angle(self.phi).rotate(centroid);
        PlanarPose { theta_rad: self.phi, y_m: shift.x, z_m: shift.y }.inverse()
    }

    /// The state after a step of (angle times [`ANGLE_SCALE_M`], y, z).
    fn moved(self, step: [f64; 3]) -> Self {
        Self { phi: self.phi + step[0] / ANGLE_SCALE_M, place: self.place + DVec2::new(step[1], step[2]) }
    }

    /// Whether both will end in the same place.
    fn is_near(&self, other: &Self) -> bool {
        (self.phi - other.phi).abs() * ANGLE_SCALE_M < 3e-4 && self.place.distance(other.place) < 3e-4
    }
}

/// Where the run from one start stands.
#[derive(Clone, Copy, Debug)]
struct Progress {
    state: State,
    /// Per point, square metres; of the kernel and the points that were used last.
    cost: f64,
    inliers: usize,
    inlier_squares: f64,
    iterations: usize,
    stop: Stop,
    /// The run that goes on for this one; itself not merged.
    merged_into: Option<usize>,
}

impl Progress {
    fn new(state: State) -> Self {
        Self {
            state,
            cost: f64::INFINITY,
            inliers: 0,
            inlier_squares: 0.0,
            iterations: 0,
            stop: Stop::IterationLimit,
            merged_into: None,
        }
    }
}

/// Lets only the cheapest of runs that stand in the same place go on.
fn merge_met(runs: &mut [Progress]) {
    let mut order: Vec<usize> = (0..runs.len()).filter(|&r| runs[r].merged_into.is_none()).collect();
    order.sort_by(|&a, &b| runs[a].cost.total_cmp(&runs[b].cost));
    let mut alive: Vec<usize> = Vec::with_capacity(order.len());
    for run in order {
        if let Some(&other) = alive.iter().find(|&&a| runs[a].state.is_near(&runs[run].state)) {
            runs[run].stop = Stop::Merged;
            runs[run].merged_into = Some(other);
            for earlier in runs.iter_mut().filter(|r| r.merged_into == Some(run)) {
                earlier.merged_into = Some(other);
            }
        } else {
            alive.push(run);
        }
    }
}

/// Sums over the points at one state.
#[derive(Default)]
struct Normal {
    /// Upper triangle of the weighted Gauss-Newton matrix: 00 01 02 11 12 22.
    h: [f64; 6],
    g: [f64; 3],
    cost: f64,
    weight: f64,
    inliers: usize,
    inlier_squares: f64,
}

struct Search<'a> {
    field: &'a DistanceField,
    centroid: DVec2,
    lookups: usize,
    trace: Vec<TraceStep>,
    record: bool,
    max: usize,
}

impl Search<'_> {
    fn share_within(&mut self, points: &[DVec2], state: State, reach_m: f64) -> f64 {
        self.lookups += points.len();
        let turn = DVec2::from_angle(state.phi);
        let near = points.iter().filter(|p| self.field.sample(turn.rotate(**p) + state.place).distance <= reach_m);
        near.count() as f64 / points.len() as f64
    }

    /// Cost, slope and curvature in one pass.
    fn normal_equations(&mut self, points: &[DVec2], state: State, kernel: f64) -> Normal {
        self.lookups += points.len();
        let turn = DVec2::from_angle(state.phi);
        let square = kernel * kernel;
        let mut n = Normal::default();
        for p in points {
            let arm = turn.rotate(*p);
            let sample = self.field.sample(arm + state.place);
            let r = sample.distance;
            if r <= 0.0 {
                // On the silhouette: no cost, no pull, but it fits.
                n.weight += 1.0;
                n.inliers += 1;
                continue;
            }
            let r2 = r * r;
            let ratio = square / (square + r2);
            let w = ratio * ratio;
            n.cost += r2 * ratio;
            n.weight += w;
            if r <= kernel {
                n.inliers += 1;
                n.inlier_squares += r2;
            }
            let j0 = sample.gradient.dot(arm.perp()) * (1.0 / ANGLE_SCALE_M);
            let (j1, j2) = (sample.gradient.x, sample.gradient.y);
            let (w0, w1, w2) = (w * j0, w * j1, w * j2);
            n.h[0] += w0 * j0;
            n.h[1] += w0 * j1;
            n.h[2] += w0 * j2;
            n.h[3] += w1 * j1;
            n.h[4] += w1 * j2;
            n.h[5] += w2 * j2;
            n.g[0] += w0 * r;
            n.g[1] += w1 * r;
            n.g[2] += w2 * r;
        }
        n
    }

    /// Levenberg-Marquardt with one kernel width.
    ///
    /// The damping is the same in all directions, so that a direction without slope (a rod along itself) gets no
    /// step at all instead of an arbitrary one.
    fn descend(&mut self, run: usize, at: &mut Progress, points: &[DVec2], kernel: f64, small: f64) {
        let mut here = self.normal_equations(points, at.state, kernel);
        self.note(run, at, &here, kernel, points.len());
        let mut damping = DAMPING_START;
        at.stop = Stop::IterationLimit;
        for _ in 0..self.max {
            let Some(step) = solve(&here, damping * here.weight.max(1e-12)) else {
                damping *= 10.0;
                continue;
            };
            if step[0].abs().max(step[1].hypot(step[2])) < small {
                at.stop = Stop::SmallStep;
                break;
            }
            let state = at.state.moved(step);
            let there = self.normal_equations(points, state, kernel);
            if there.cost < here.cost {
                at.state = state;
                at.iterations += 1;
                here = there;
                damping = (damping * 0.1).max(1e-6);
                self.note(run, at, &here, kernel, points.len());
            } else {
                damping *= 10.0;
                if damping > DAMPING_MAX {
                    at.stop = Stop::NoDescent;
                    break;
                }
            }
        }
        at.cost = here.cost / points.len() as f64;
        at.inliers = here.inliers;
        at.inlier_squares = here.inlier_squares;
    }

    fn note(&mut self, run: usize, at: &Progress, n: &Normal, kernel_m: f64, points: usize) {
        if self.record {
            self.trace.push(TraceStep {
                run,
                iteration: at.iterations,
                grasp_from_object: at.state.to_pose(self.centroid),
                grasp_from_object_6dof: None,
                cost_m2: n.cost / points as f64,
                inlier_share: n.inliers as f64 / points as f64,
                kernel_m,
                points,
            });
        }
    }
}

/// Solves `(H + damping) step = -g` by Cholesky; `None` if that is not positive definite.
fn solve(n: &Normal, damping: f64) -> Option<[f64; 3]> {
    let [h00, h01, h02, h11, h12, h22] = n.h;
    let l00 = positive_root(h00 + damping)?;
    let (l10, l20) = (h01 / l00, h02 / l00);
    let l11 = positive_root(h11 + damping - l10 * l10)?;
    let l21 = (h12 - l20 * l10) / l11;
    let l22 = positive_root(h22 + damping - l20 * l20 - l21 * l21)?;
    let y0 = -n.g[0] / l00;
    let y1 = (-n.g[1] - l10 * y0) / l11;
    let y2 = (-n.g[2] - l20 * y0 - l21 * y1) / l22;
    let x2 = y2 / l22;
    let x1 = (y1 - l21 * x2) / l11;
    let x0 = (y0 - l10 * x1 - l20 * x2) / l00;
    Some([x0, x1, x2])
}

fn positive_root(x: f64) -> Option<f64> {
    (x > 0.0 && x.is_finite()).then(|| x.sqrt())
}

/// Every offered point at the final pose.
fn fits(points: &[DVec2], field: &DistanceField, pose: PlanarPose, kernel: f64) -> Vec<PointFit> {
    /// Kernel widths at which the weight has fallen to one hundredth.
    const GATE: f64 = 3.0;
    let object_from_grasp = pose.inverse();
    points
        .iter()
        .map(|p| {
            if !p.is_finite() {
                return PointFit { residual_m: f32::NAN, weight: 0.0, fate: Fate::NotFinite };
            }
            let sample = field.sample(object_from_grasp.transform_yz(*p));
            let r = sample.distance.max(0.0);
            let ratio = 1.0 / (1.0 + (r / kernel).powi(2));
            let fate = if !sample.on_grid {
                Fate::OutOfField
            } else if r <= 0.0 {
                Fate::Inside
            } else if r > GATE * kernel {
                Fate::BeyondGate
            } else {
                Fate::Inlier
            };
            PointFit { residual_m: r as f32, weight: (ratio * ratio) as f32, fate }
        })
        .collect()
}

#[cfg(test)]
mod tests;
