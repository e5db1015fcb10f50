//! The default engine: three numbers, a distance field, a redescending kernel, Levenberg-Marquardt, and a ladder of
//! searches so that a scene pays for what it needs.
//!
//! Why redescending: masks contain blobs and halos that are not the tool. A squared cost follows them even when
//! started at the truth; the Geman-McClure kernel lets them go. Why graduated: a narrow kernel alone sees only what
//! is already close.
//!
//! Why a ladder: one start in the middle of the prior finds the best pose of nearly every grasp. An answer that does
//! not look right is checked by five starts, then by a grid, then by branch and bound. A direction that the points leave open (a straight rod
//! slides) is no reason to climb when everything else fits: a search finds lower costs, and along the valley there is
//! none, so such an answer is taken and flagged.

use glam::DVec2;

use super::batch::{Cloud, State};
use super::certify::certify;
use super::observability::of_cloud;
use super::search::{Progress, Search};
use super::uncertainty::Uncertainty;
use super::{
    AlignConfig, AlignError, AlignReport, Certificate, DEGENERATE_BELOW, Fate, MIN_POINTS, MIN_SHARE, Observability,
    Outcome, PointFit, Prior, REACH_M, Run, Rung, RungAttempt, clean,
};
use crate::field::DistanceField;
use crate::frames::PlanarPose;
use crate::mesh::sampling::spread;
use crate::rig::CameraTolerance;

/// Points of the answer; more are thinned evenly.
const POINTS: usize = 2048;
/// Points of the descent before the last.
const MIDDLE_POINTS: usize = 512;
/// Points that rank the starts.
const SCOUT_POINTS: usize = 128;
/// Best starts that are refined with all points.
const KEEP: usize = 2;
/// Greatest cost per point, as a share of the squared kernel width, and smallest share of points within that width, for an
/// answer to be believed without further search: after one start, and where several starts or a grid agree on it (then it
/// is the mask that is bad, not the search). On spoilt masks, right answers cost 0.005 to 0.24 and keep 78 to 100 % of
/// their points; wrong minima cost at least 0.29 and keep at most 68 %.
const ACCEPT: [(f64, f64); 2] = [(0.2, 0.8), (0.26, 0.72)];

/// Finds the planar pose under which the points lie on the tool's silhouette.
///
/// Points are `(y, z)` in the grasp frame, meters; those that are not finite are dropped and counted. The result does
/// not depend on threads, clocks or earlier calls.
///
/// # Errors
/// [`AlignError`] for fewer than [`MIN_POINTS`] points, points in one spot, points away from the tool, or settings
/// that make no sense.
pub fn align(points_yz: &[DVec2], field: &DistanceField, config: &AlignConfig) -> Result<AlignReport, AlignError> {
    let finite = |s: &PlanarPose| s.is_finite();
    if !config.starts.iter().all(finite) {
        return Err(AlignError::Config { what: "starts" });
    }
    let problem = Problem::new(points_yz, field, config)?;
    if !config.starts.is_empty() {
        let starts = config.starts.clone();
        let answer = problem.descend(Rung::Fixed, starts, problem.search(), None, &config.kernels_m)?;
        return Ok(problem.report(points_yz, answer, Vec::new()));
    }
    let mut ladder = Vec::with_capacity(config.rungs.len());
    let mut lookups = 0;
    let mut rungs = config.rungs.iter().peekable();
    let mut earlier: Option<Earlier> = None;
    loop {
        let rung = *rungs.next().ok_or(AlignError::Config { what: "rungs" })?;
        let tried = problem.climb(rung, earlier.as_ref());
        let last = rungs.peek().is_none();
        let mut answer = match tried {
            Ok(answer) => answer,
            // Nothing near the middle of the prior; only a wider search can say whether there is something elsewhere.
            Err(AlignError::NoOverlap { .. }) if !last && rung < Rung::Grid => continue,
            Err(error) => return Err(error),
        };
        let mut outcome = answer.outcome(rung, config);
        let hopeless = outcome == Outcome::Observability;
        if outcome != Outcome::Accepted && (last || hopeless) {
            outcome = Outcome::Last;
        }
        ladder.push(RungAttempt {
            rung,
            cost_m2: answer.best().cost,
            points: problem.points.len(),
            inlier_share: answer.inlier_share,
            weakest: answer.seen.eigenvalues[0],
            lookups: answer.lookups,
            outcome,
        });
        lookups += answer.lookups;
        if matches!(outcome, Outcome::Accepted | Outcome::Last) {
            answer.lookups = lookups;
            return Ok(problem.report(points_yz, answer, ladder));
        }
        earlier = Some(Earlier { scouted: answer.scouted, refined: *answer.best() });
    }
}

/// A question prepared for every rung.
struct Problem<'a> {
    field: &'a DistanceField,
    config: &'a AlignConfig,
    centroid: DVec2,
    not_finite: usize,
    /// All, or as many as asked for.
    points: Cloud,
    /// Enough of them to come near the answer and to tell how well it is determined.
    middle: Cloud,
    /// Few of them, to tell good starts from bad ones.
    scouts: Cloud,
}

/// The answer of the rung before.
struct Earlier {
    /// State where its scouts ended.
    scouted: State,
    refined: Progress,
}

/// Answer of a rung.
struct Answer {
    rung: Rung,
    /// `grasp_from_object` of every start.
    starts: Vec<PlanarPose>,
    runs: Vec<Progress>,
    winner: usize,
    /// State where the winner's scouts ended.
    scouted: State,
    pose: PlanarPose,
    inlier_share: f64,
    seen: Observability,
    lookups: usize,
    certificate: Option<Certificate>,
    trace: Vec<super::TraceStep>,
}

impl Answer {
    fn best(&self) -> &Progress {
        &self.runs[self.winner]
    }

    fn outcome(&self, rung: Rung, config: &AlignConfig) -> Outcome {
        let (cost, inliers) = ACCEPT[usize::from(rung > Rung::Single)];
        let kernel = config.final_kernel_m();
        if !self.best().stop.converged() {
            Outcome::NotConverged
        } else if !config.prior.allows(self.pose) {
            Outcome::OutsidePrior
        } else if self.best().cost > cost * kernel * kernel {
            Outcome::Cost
        } else if self.inlier_share < inliers {
            Outcome::Inliers
        } else if self.seen.eigenvalues[0] < DEGENERATE_BELOW {
            Outcome::Observability
        } else {
            Outcome::Accepted
        }
    }
}

impl<'a> Problem<'a> {
    fn new(points_yz: &[DVec2], field: &'a DistanceField, config: &'a AlignConfig) -> Result<Self, AlignError> {
        let cleaned = clean(points_yz, MIN_POINTS)?;
        let c = cleaned.centroid;
        let all: &[DVec2] = &cleaned.points;
        let thinned = |count: usize| {
            if all.len() <= count {
                Cloud::new(all.iter().map(|p| *p - c))
            } else {
                Cloud::new(spread(all.len(), count).into_iter().map(|i| all[i] - c))
            }
        };
        let [points, middle, scouts] = [POINTS, MIDDLE_POINTS, SCOUT_POINTS].map(thinned);
        Ok(Self { field, config, centroid: c, not_finite: cleaned.not_finite, points, middle, scouts })
    }

    fn search(&self) -> Search<'a> {
        Search::new(self.field, self.centroid, self.config.max_iterations, self.config.record)
    }

    /// The answer of a rung; `earlier` is where the one before ended.
    fn climb(&self, rung: Rung, earlier: Option<&Earlier>) -> Result<Answer, AlignError> {
        let AlignConfig { prior, kernels_m, .. } = self.config;
        match rung {
            Rung::Fixed | Rung::Around => Err(AlignError::Config { what: "rungs" }),
            Rung::Single => self.descend(rung, vec![PlanarPose::default()], self.search(), None, kernels_m),
            Rung::Certified => self.certified(earlier),
            Rung::Several => self.descend(rung, several(prior), self.search(), earlier, kernels_m),
            Rung::Grid => {
                let mut search = self.search();
                let starts = self.knots(&mut search, earlier);
                self.descend(rung, starts, search, earlier, self.narrow())
            }
        }
    }

    /// Several starts, and then a proof that nothing in the prior is better, or what is.
    fn certified(&self, earlier: Option<&Earlier>) -> Result<Answer, AlignError> {
        let config = self.config;
        let kernel = config.final_kernel_m();
        let starts = several(&config.prior);
        let mut answer = self.descend(Rung::Certified, starts, self.search(), None, &config.kernels_m)?;
        let mut search = self.search();
        // The proof begins with the best that is known, of the prior if anything there is: it is about the prior.
        let known = earlier.map(|e| e.refined).filter(|e| self.is_better(e, answer.best()));
        let mut best = Progress::new(known.unwrap_or(*answer.best()).state);
        search.descend_quietly(&mut best, &self.middle, kernel);
        let (certificate, best) = certify(&mut search, &self.middle, config, kernel, best);
        answer.lookups += search.lookups + certificate.lookups;
        // What the proof came upon is refined like any other start; it only counts if it is cheaper on all points.
        let state = State::from_pose(answer.pose, self.centroid);
        if !best.state.is_near(&state) {
            let start = best.state.to_pose(self.centroid);
            let better = self.descend(Rung::Certified, vec![start], self.search(), None, self.narrow())?;
            if self.is_better(better.best(), answer.best()) {
                answer = Answer { lookups: answer.lookups + better.lookups, ..better };
            }
        }
        answer.certificate = Some(certificate);
        Ok(answer)
    }

    /// The best few knots of a grid of 2.5 degrees and 1 mm over the prior, `grasp_from_object`, and where the rung
    /// before ended.
    fn knots(&self, search: &mut Search<'_>, earlier: Option<&Earlier>) -> Vec<PlanarPose> {
        const ANGLE_RAD: f64 = 2.5 * std::f64::consts::PI / 180.0;
        const SHIFT_M: f64 = 1e-3;
        /// Wide enough that the knot beside a valley still sees it.
        const KERNEL_M: f64 = 2e-3;
        const STARTS: usize = 16;
        /// Knots closer than this to a better one would end where that one does.
        const APART: (f64, f64) = (2.2 * ANGLE_RAD, 2.2 * SHIFT_M);
        let steps = |half: f64, step: f64| {
            let n = (half / step).ceil().min(40.0) as i32;
            (-n..=n).map(move |i| f64::from(i) * half / f64::from(n.max(1)))
        };
        let prior = &self.config.prior;
        let mut knots: Vec<(f64, PlanarPose)> = Vec::new();
        for theta_rad in steps(prior.theta_rad, ANGLE_RAD) {
            for y_m in steps(prior.shift_m, SHIFT_M) {
                for z_m in steps(prior.shift_m, SHIFT_M) {
                    let pose = PlanarPose { theta_rad, y_m, z_m };
                    let sums = search.sums(&self.scouts, State::from_pose(pose, self.centroid), KERNEL_M);
                    knots.push((sums.cost, pose));
                }
            }
        }
        knots.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut starts: Vec<PlanarPose> = Vec::with_capacity(STARTS + 1);
        for (_, knot) in knots {
            let apart = |s: &PlanarPose| {
                (s.theta_rad - knot.theta_rad).abs() > APART.0 || (s.y_m - knot.y_m).hypot(s.z_m - knot.z_m) > APART.1
            };
            if starts.iter().all(apart) {
                starts.push(knot);
                if starts.len() == STARTS {
                    break;
                }
            }
        }
        starts.extend(earlier.map(|e| e.refined.state.to_pose(self.centroid)));
        starts
    }

    /// The kernels without the widest. A knot of a grid already lies beside its valley, and the widest kernel would
    /// follow a large foreign body out of it.
    fn narrow(&self) -> &'a [f64] {
        let kernels = &self.config.kernels_m;
        &kernels[usize::from(kernels.len() > 1)..]
    }

    /// True where `a` is to be preferred to `b`: within the prior before outside, then the cheaper one.
    fn is_better(&self, a: &Progress, b: &Progress) -> bool {
        let allowed = |run: &Progress| self.config.prior.allows(run.state.to_pose(self.centroid));
        match (allowed(a), allowed(b)) {
            (true, false) => true,
            (false, true) => false,
            _ => a.cost < b.cost,
        }
    }

    /// Scouts from all starts, refines the best few, takes the cheapest: one within the prior if there is one, because
    /// a symmetric tool fits as well after a turn that no gripper makes.
    ///
    /// A run whose scouts end exactly where those of `earlier` did is not refined again.
    fn descend(
        &self,
        rung: Rung,
        starts: Vec<PlanarPose>,
        mut search: Search<'a>,
        earlier: Option<&Earlier>,
        kernels_m: &[f64],
    ) -> Result<Answer, AlignError> {
        /// A run is worth refining if its scouts cost at most this many times what the best ones do.
        const WORTH: f64 = 1.5;
        let config = self.config;
        let c = self.centroid;
        let states: Vec<State> = starts.iter().map(|s| State::from_pose(*s, c)).collect();
        let near = |s: &State| self.field.sums(&self.scouts, *s, REACH_M).inliers as f64 / self.scouts.len() as f64;
        let mut reach = 0f64;
        for state in &states {
            search.lookups += self.scouts.asked();
            reach = reach.max(near(state));
            if reach >= MIN_SHARE {
                break;
            }
        }
        if reach < MIN_SHARE {
            return Err(AlignError::NoOverlap { share: reach });
        }
        let kernel = config.final_kernel_m();
        let mut runs = search.scout(&states, &self.scouts, kernels_m);
        let allowed = |run: &Progress| config.prior.allows(run.state.to_pose(c));
        let mut order: Vec<usize> = (0..runs.len()).filter(|&r| runs[r].merged_into.is_none()).collect();
        let better = |a: &Progress, b: &Progress| allowed(b).cmp(&allowed(a)).then_with(|| a.cost.total_cmp(&b.cost));
        order.sort_by(|&a, &b| better(&runs[a], &runs[b]));
        let limit = runs[order[0]].cost * WORTH;
        let worth = order.iter().take(KEEP).take_while(|&&r| runs[r].cost <= limit).count();
        let (refined, rest) = order.split_at(worth.max(1));
        let scouted: Vec<State> = runs.iter().map(|r| r.state).collect();
        for &run in refined {
            if let Some(known) = earlier.filter(|e| e.scouted == runs[run].state) {
                if config.record {
                    let lookups = search.lookups;
                    search.refine(run, &mut runs[run], &self.middle, &self.points, kernel);
                    search.lookups = lookups;
                }
                runs[run] = Progress { merged_into: None, ..known.refined };
                continue;
            }
            search.refine(run, &mut runs[run], &self.middle, &self.points, kernel);
        }
        // The others only get their cost, with the same points, so that all are comparable.
        for &run in rest {
            runs[run].cost = search.sums(&self.points, runs[run].state, kernel).cost / self.points.len() as f64;
        }
        let winner = refined.iter().copied().min_by(|&a, &b| better(&runs[a], &runs[b])).unwrap_or(0);
        let best = &runs[winner];
        let inlier_share = best.inliers as f64 / self.points.len() as f64;
        if inlier_share < MIN_SHARE {
            return Err(AlignError::NoOverlap { share: inlier_share });
        }
        search.lookups += self.middle.asked();
        Ok(Answer {
            rung,
            pose: best.state.to_pose(c),
            inlier_share,
            seen: of_cloud(&self.middle, c, self.field, best.state),
            winner,
            scouted: scouted[winner],
            lookups: search.lookups,
            certificate: None,
            trace: search.trace,
            starts,
            runs,
        })
    }

    fn report(&self, points_yz: &[DVec2], answer: Answer, ladder: Vec<RungAttempt>) -> AlignReport {
        let (config, c) = (self.config, self.centroid);
        let best = *answer.best();
        let runs = &answer.runs;
        let told = || Uncertainty::of_mask(points_yz, self.field, answer.pose, CameraTolerance::default());
        let pose = config.prior.slid_in(answer.pose, told);
        let run = |(run, start): (&Progress, &PlanarPose)| {
            let last = run.merged_into.map_or(run, |other| &runs[other]);
            let end = last.state.to_pose(c);
            let (iterations, stop) = (run.iterations, run.stop);
            Run { requested: *start, start: *start, end, cost_m2: last.cost, iterations, stop }
        };
        let ended = runs.iter().zip(&answer.starts).map(run).collect();
        let inliers = (best.inliers, best.inlier_squares);
        AlignReport {
            grasp_from_object: pose,
            ladder,
            certificate: answer.certificate,
            lookups: answer.lookups,
            offered: points_yz.len(),
            not_finite: self.not_finite,
            within_prior: config.prior.allows(pose),
            observability: Some(answer.seen),
            trace: answer.trace,
            fits: if config.record { fits(points_yz, self.field, pose, config.final_kernel_m()) } else { Vec::new() },
            ..AlignReport::of(ended, answer.winner, answer.rung, self.points.len(), inliers)
        }
    }
}

/// Five angles over the prior, the middle among them.
fn several(prior: &Prior) -> Vec<PlanarPose> {
    [0.0, -0.45, 0.45, -0.9, 0.9]
        .map(|share| PlanarPose { theta_rad: share * prior.theta_rad, ..PlanarPose::default() })
        .to_vec()
}

/// Every offered point at the final pose.
pub(super) fn fits(points: &[DVec2], field: &DistanceField, pose: PlanarPose, kernel: f64) -> Vec<PointFit> {
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
