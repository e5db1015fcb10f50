//! Levenberg-Marquardt descents from several starts side by side.

use glam::DVec2;

use super::batch::{Cloud, State};
use super::lanes::Sums;
use super::{Stop, TraceStep};
use crate::field::DistanceField;

/// A step that moves no point by more than about this, meters, ends the search with the narrowest kernel.
const STEP_FINE_M: f64 = 5e-6;
/// Step that ends the search with the wider kernels, meters: their end is only the next start.
const STEP_COARSE_M: f64 = 5e-5;
/// Step that ends the search with the middle cloud, meters: its end is the start of the last descent.
const STEP_MIDDLE_M: f64 = 2e-5;
/// Damping at the start and at the end of patience, per unit of weight.
const DAMPING_START: f64 = 1e-3;
const DAMPING_MAX: f64 = 1e4;

/// Progress of the run from one start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Progress {
    pub(super) state: State,
    /// Per point, square meters; of the kernel and the points that were used last.
    pub(super) cost: f64,
    pub(super) inliers: usize,
    pub(super) inlier_squares: f64,
    pub(super) iterations: usize,
    pub(super) stop: Stop,
    /// The run that goes on for this one; itself not merged.
    pub(super) merged_into: Option<usize>,
}

impl Progress {
    pub(super) fn new(state: State) -> Self {
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

/// Counts and records the descents of one rung.
pub(super) struct Search<'a> {
    pub(super) field: &'a DistanceField,
    pub(super) centroid: DVec2,
    /// Most steps per kernel width and start.
    pub(super) max: usize,
    pub(super) record: bool,
    /// Nearest-surface questions asked.
    pub(super) lookups: usize,
    pub(super) trace: Vec<TraceStep>,
}

impl<'a> Search<'a> {
    pub(super) fn new(field: &'a DistanceField, centroid: DVec2, max: usize, record: bool) -> Self {
        Self { field, centroid, max, record, lookups: 0, trace: Vec::new() }
    }

    /// Cost, slope and curvature at a state.
    pub(super) fn sums(&mut self, points: &Cloud, state: State, kernel: f64) -> Sums {
        self.lookups += points.asked();
        self.field.sums(points, state, kernel)
    }

    /// All starts go through the kernels side by side on few points, so that runs that meet go on as one.
    pub(super) fn scout(&mut self, starts: &[State], scouts: &Cloud, kernels: &[f64]) -> Vec<Progress> {
        let mut runs: Vec<Progress> = starts.iter().copied().map(Progress::new).collect();
        for kernel in kernels {
            for (run, progress) in runs.iter_mut().enumerate().filter(|(_, p)| p.merged_into.is_none()) {
                self.descend(run, progress, scouts, *kernel, STEP_COARSE_M);
            }
            if runs.len() > 1 {
                merge_met(&mut runs);
            }
        }
        runs
    }

    /// The last descents: on the middle cloud, then on all points. Of those, the ones deep inside the silhouette cost
    /// nothing and change nothing, so only the others are looked up, as long as no point moves as far as that.
    pub(super) fn refine(&mut self, run: usize, at: &mut Progress, middle: &Cloud, points: &Cloud, kernel: f64) {
        /// Depth, meters, below which a point rests: several times what the last descent moves.
        const DEEP_M: f64 = 5e-4;
        /// The stored depth may be too great by this much, meters.
        const DEPTH_ERROR_M: f64 = 1.5e-4;
        if middle.len() < points.len() {
            self.descend(run, at, middle, kernel, STEP_MIDDLE_M);
        }
        let radius = points.radius();
        for _ in 0..3 {
            let from = at.state;
            self.lookups += points.asked();
            let restless = self.field.restless(points, from, DEEP_M);
            self.descend(run, at, &restless, kernel, STEP_FINE_M);
            let turned = 2.0 * ((at.state.phi - from.phi) * 0.5).sin().abs();
            if turned * radius + at.state.place.distance(from.place) < DEEP_M - DEPTH_ERROR_M {
                return;
            }
        }
        self.descend(run, at, points, kernel, STEP_FINE_M);
    }

    /// A descent that leaves no trace.
    pub(super) fn descend_quietly(&mut self, at: &mut Progress, points: &Cloud, kernel: f64) {
        let record = std::mem::replace(&mut self.record, false);
        self.descend(0, at, points, kernel, STEP_FINE_M);
        self.record = record;
    }

    fn descend(&mut self, run: usize, at: &mut Progress, points: &Cloud, kernel: f64, small: f64) {
        let max = self.max;
        let here = minimize(&mut OnField { search: self, run, points, kernel }, at, max, small);
        at.cost = here.cost / points.len() as f64;
        at.inliers = here.inliers;
        at.inlier_squares = here.inlier_squares;
    }

    fn note(&mut self, run: usize, at: &Progress, n: &Sums, kernel_m: f64, points: usize) {
        if self.record {
            self.trace.push(TraceStep {
                run,
                iteration: at.iterations,
                grasp_from_object: at.state.to_pose(self.centroid),
                cost_m2: n.cost / points as f64,
                mask_cost_m2: None,
                inlier_share: n.inliers as f64 / points as f64,
                kernel_m,
                points,
            });
        }
    }
}

/// One kernel width on one cloud.
struct OnField<'s, 'a> {
    search: &'s mut Search<'a>,
    run: usize,
    points: &'s Cloud,
    kernel: f64,
}

impl Cost for OnField<'_, '_> {
    fn sums(&mut self, state: State) -> Sums {
        self.search.sums(self.points, state, self.kernel)
    }

    fn note(&mut self, at: &Progress, sums: &Sums) {
        self.search.note(self.run, at, sums, self.kernel, self.points.len());
    }
}

/// Function that a descent minimizes.
pub(super) trait Cost {
    /// Cost, slope and curvature at a state.
    fn sums(&mut self, state: State) -> Sums;

    /// Told of the start and of every step.
    fn note(&mut self, _at: &Progress, _sums: &Sums) {}
}

/// Levenberg-Marquardt; the sums at the end.
///
/// The damping is the same in all directions, so that a direction without slope (a rod along itself) gets no
/// step at all instead of an arbitrary one.
pub(super) fn minimize(cost: &mut impl Cost, at: &mut Progress, max: usize, small: f64) -> Sums {
    let mut here = cost.sums(at.state);
    cost.note(at, &here);
    let mut damping = DAMPING_START;
    at.stop = Stop::IterationLimit;
    for _ in 0..max {
        let Some(step) = solve(&here, damping * here.weight.max(1e-12)) else {
            damping *= 10.0;
            continue;
        };
        if step[0].abs().max(step[1].hypot(step[2])) < small {
            at.stop = Stop::SmallStep;
            break;
        }
        let state = at.state.moved(step);
        let there = cost.sums(state);
        if there.cost < here.cost {
            at.state = state;
            at.iterations += 1;
            here = there;
            damping = (damping * 0.1).max(1e-6);
            cost.note(at, &here);
        } else {
            damping *= 10.0;
            if damping > DAMPING_MAX {
                at.stop = Stop::NoDescent;
                break;
            }
        }
    }
    here
}

/// Solves `(H + damping) step = -g` by Cholesky; `None` if that is not positive definite.
fn solve(n: &Sums, damping: f64) -> Option<[f64; 3]> {
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
