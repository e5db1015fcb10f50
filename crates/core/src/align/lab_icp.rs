//! The lab's planar ICP, reproduced for comparison: point to point, every contact point to its nearest model point,
//! a closed-form rotation, a fixed number of iterations, one start at the identity, no rejection of outliers.
//!
//! The lab's multi-start variant has three traps; each can be switched on to see what it does to a pose.
//!
//! Source: the lab's touch2touch repository, `evaluation/pose_estimators.py` lines 153-281 and
//! `ICP_dataset_cal.py` lines 127-153, reimplemented from a description. Two things differ without changing a result:
//! the k-d tree stays with the model and the contacts are moved instead, and the loop ends early once the
//! correspondences repeat, because then every later iteration repeats too. One thing differs on purpose: too few
//! points are an error, not the previous sample's pose.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::register::{Ask, Register, Scene, check_overlap, clean_scene};
use super::samples::{Matcher, Samples};
use super::{AlignError, AlignReport, Fate, PointFit, Prior, Range, Run, Rung, Stop, TraceStep, observability};
use crate::frames::PlanarPose;
use crate::tool::ToolModel;

/// Fewest contact points the lab's loop works with.
pub(crate) const LAB_MIN_POINTS: usize = 4;
/// Starts of the lab's multi-start variant.
pub(crate) const LAB_STARTS: usize = 10;
/// Distance below which a contact counts as an inlier in the report, meters; the loop itself does not use it.
const INLIER_M: f64 = 1e-3;
/// Beyond this, meters, the lab's choice among starts does not look.
const GATE_M: f64 = 0.015;

/// A property of the lab's multi-start variant that spoils poses without a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[derive(Serialize, Deserialize, strum::EnumIter, strum::EnumString, strum::IntoStaticStr, strum::Display)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum PaperTrap {
    /// The start is a turn about the closing axis, but is applied in the plane of the loop, whose normal that axis
    /// is not: asking for 22.5 degrees turns the model by about one, and a shift along z goes out of the plane. So
    /// all starts are nearly the same one. What was applied is the start of the report's run; what was asked for
    /// stands beside it.
    WrongFrame,
    /// Among several starts the one with the least distance from model to contacts wins, over the model points that
    /// have a contact within 15 mm. A pose with few such points is rewarded, one without any wins with zero.
    RmseChoice,
    /// All iterations are run, converged or not, so nothing tells a pose that came to rest from one that still
    /// moves.
    FixedIterations,
}

impl PaperTrap {
    /// Effect of the trap, in one line.
    pub fn description(self) -> &'static str {
        match self {
            Self::WrongFrame => "Starts are applied in the wrong frame: 22.5° asked for turns the model by about 1°",
            Self::RmseChoice => {
                "The start with the least model-to-contact distance within 15 mm wins: little overlap pays"
            }
            Self::FixedIterations => "All 200 iterations are run and none tells whether the pose came to rest",
        }
    }
}

/// Settings of [`lab_icp()`]; the default is what the lab evaluates with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabIcpConfig {
    /// Iterations; the lab always runs all 200.
    pub iterations: usize,
    /// Poses to start from, `grasp_from_object`; the lab uses the identity. Not empty.
    pub starts: Vec<PlanarPose>,
    /// The lab's traps; none by default.
    pub traps: Vec<PaperTrap>,
    /// Keep per-iteration states and per-point residuals.
    pub record: bool,
}

impl Default for LabIcpConfig {
    fn default() -> Self {
        Self { iterations: 200, starts: vec![PlanarPose::default()], traps: Vec::new(), record: false }
    }
}

impl LabIcpConfig {
    fn has(&self, trap: PaperTrap) -> bool {
        self.traps.contains(&trap)
    }
}

/// The starts of the lab's multi-start variant: ten draws *with replacement* from ten angles within 22.5 degrees and
/// ten shifts within 10 mm along each axis, so that on average only six to seven of the angles occur.
pub fn lab_starts(seed: u64) -> Vec<PlanarPose> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |limit: f64| limit * (f64::from(rng.random_range(0..10u32)) / 4.5 - 1.0);
    (0..LAB_STARTS)
        .map(|_| PlanarPose { theta_rad: draw(22.5f64.to_radians()), y_m: draw(0.01), z_m: draw(0.01) })
        .collect()
}

/// Model that the lab's loop compares with.
#[derive(Clone, Debug)]
pub struct LabModel {
    /// Meters, object frame.
    points: Arc<[DVec3]>,
    /// Points along the closing axis (x = 0), in the same order.
    flat: Samples,
}

impl LabModel {
    /// The tool's, made at the first request and kept with it.
    pub fn of(tool: &ToolModel) -> Arc<Self> {
        tool.derived(|tool| Self::new(&tool.surface().iter().map(|(p, _)| *p).collect::<Vec<_>>()))
    }

    /// From points of the surface, meters, object frame. Those that are not finite are left out.
    pub fn new(points: &[DVec3]) -> Self {
        let points: Arc<[DVec3]> = points.iter().copied().filter(|p| p.is_finite()).collect();
        let flat: Vec<DVec3> = points.iter().map(|p| p.with_x(0.0)).collect();
        Self { flat: Samples::in_plane(&flat), points }
    }

    fn yz(&self, item: u32) -> DVec2 {
        let p = self.points[item as usize];
        DVec2::new(p.y, p.z)
    }
}

impl Register for LabIcpConfig {
    fn run(&self, scene: &Scene<'_>, tool: &ToolModel, ask: Ask<'_>) -> Result<AlignReport, AlignError> {
        let mut config = self.clone();
        config.record = ask.record;
        if let Some(starts) = ask.starts {
            config.starts = starts.to_vec();
        }
        let finite = scene.yz().iter().copied().filter(|p| p.is_finite());
        // The loop pulls the model to whatever there is, so that its end no longer shows that there was nothing.
        if finite.clone().count() >= LAB_MIN_POINTS {
            check_overlap(finite, &tool.field, &config.starts)?;
        }
        let mut report = lab_icp(scene.points(), &LabModel::of(tool), &config)?;
        report.observability = Some(observability(scene.yz(), &tool.field, report.grasp_from_object));
        Ok(report)
    }
}

/// Aligns model points (object frame) to contact points (grasp frame), meters.
///
/// Points that are not finite are dropped and counted. The reported cost is the mean squared distance in the plane.
///
/// # Errors
/// [`AlignError`] for fewer than four contact or model points, coincident contacts, or a start that is not finite.
pub fn lab_icp(points: &[DVec3], model: &LabModel, config: &LabIcpConfig) -> Result<AlignReport, AlignError> {
    if config.starts.is_empty() || config.starts.iter().any(|s| !s.is_finite()) {
        return Err(AlignError::Config { what: "starts" });
    }
    if config.iterations == 0 {
        return Err(AlignError::Config { what: "iterations" });
    }
    let clean = clean_scene(&Scene::new(points), LAB_MIN_POINTS)?;
    if model.points.len() < LAB_MIN_POINTS {
        return Err(AlignError::EmptyModel { got: model.points.len() });
    }
    let scene: Vec<DVec2> = clean.points.iter().map(|p| DVec2::new(p.y, p.z)).collect();
    let centroid = DVec2::new(clean.centroid.y, clean.centroid.z);
    let count = scene.len();
    let mut paper = Loop { config, model, scene, centroid, nearest: vec![0; count], lookups: 0, trace: Vec::new() };
    let ends: Vec<End> = (0..config.starts.len()).map(|run| paper.run(run)).collect();
    let chooser: Vec<f64> = if config.has(PaperTrap::RmseChoice) {
        let contacts = Samples::in_space(&clean.points);
        ends.iter().map(|end| gated_rmse(model, &contacts, end.run.end)).collect()
    } else {
        ends.iter().map(|end| end.run.cost_m2).collect()
    };
    let winner = (0..ends.len()).min_by(|&a, &b| chooser[a].total_cmp(&chooser[b])).unwrap_or(0);
    let End { run, matched } = ends[winner];
    let fits = if config.record { fits(&model.flat, points, run.end) } else { Vec::new() };
    Ok(AlignReport {
        grasp_from_object: run.end,
        converged: run.stop.converged(),
        stop: run.stop,
        start: run.start,
        runs: ends.iter().map(|e| e.run).collect(),
        winner,
        rung: Rung::Fixed,
        ladder: Vec::new(),
        certificate: None,
        iterations: ends.iter().map(|e| e.run.iterations).sum(),
        lookups: paper.lookups,
        offered: points.len(),
        not_finite: clean.not_finite,
        used: count,
        inlier_share: matched.inliers as f64 / count as f64,
        inlier_rms_m: (matched.inlier_squares / (matched.inliers as f64).max(1.0)).sqrt(),
        within_prior: Prior::default().allows(run.end),
        observability: None,
        joint: None,
        evidence: None,
        answers: Vec::new(),
        ends: Vec::new(),
        range: Range::default(),
        trace: paper.trace,
        fits,
    })
}

#[derive(Clone, Copy)]
struct End {
    run: Run,
    matched: Matched,
}

#[derive(Clone, Copy, Default)]
struct Matched {
    changed: bool,
    squares: f64,
    inliers: usize,
    inlier_squares: f64,
}

impl Matched {
    fn add(&mut self, squared: f64) {
        self.squares += squared;
        if squared <= INLIER_M * INLIER_M {
            self.inliers += 1;
            self.inlier_squares += squared;
        }
    }
}

struct Loop<'a> {
    config: &'a LabIcpConfig,
    model: &'a LabModel,
    scene: Vec<DVec2>,
    centroid: DVec2,
    nearest: Vec<u32>,
    lookups: usize,
    trace: Vec<TraceStep>,
}

impl Loop<'_> {
    /// The iterations from one of the starts.
    fn run(&mut self, run: usize) -> End {
        let requested = self.config.starts[run];
        let limit = self.config.iterations;
        let never_stop = self.config.has(PaperTrap::FixedIterations);
        let mut matcher = Matcher::new(self.scene.len());
        let mut stop = Stop::IterationLimit;
        let mut iterations = 0;
        let mut pose = requested;
        let mut start = requested;
        if self.config.has(PaperTrap::WrongFrame) {
            let (applied, matched) = self.first_in_the_wrong_frame(requested);
            start = applied;
            self.note(run, 0, applied, &matched);
            pose = self.closed_form();
            iterations = 1;
        }
        while iterations < limit {
            let matched = self.match_all(&mut matcher, pose);
            self.note(run, iterations, pose, &matched);
            if !matched.changed && !never_stop {
                stop = Stop::FixedPoint;
                break;
            }
            pose = self.closed_form();
            iterations += 1;
        }
        let matched = self.match_all(&mut matcher, pose);
        if stop == Stop::IterationLimit {
            self.note(run, iterations, pose, &matched);
        }
        self.lookups += matcher.lookups;
        let cost_m2 = matched.squares / self.scene.len() as f64;
        End { run: Run { requested, start, end: pose, cost_m2, iterations, stop }, matched }
    }

    /// The nearest model point of every contact under `pose`.
    fn match_all(&mut self, matcher: &mut Matcher, pose: PlanarPose) -> Matched {
        let object_from_grasp = pose.inverse();
        let mut matched = Matched::default();
        for (i, p) in self.scene.iter().enumerate() {
            let q = object_from_grasp.transform_yz(*p);
            let (item, changed) = matcher.find(&self.model.flat, i, DVec3::new(0.0, q.x, q.y));
            self.nearest[i] = item;
            matched.changed |= changed;
            matched.add(self.model.yz(item).distance_squared(q));
        }
        matched
    }

    /// The first pairing of [`PaperTrap::WrongFrame`]. The loop works in the plane of (z, y) with -x as the third
    /// coordinate; the start, a turn about its *first* axis and a shift along the second and third, is applied to
    /// those. That squeezes y instead of turning the plane. The planar pose nearest to this is what was applied.
    fn first_in_the_wrong_frame(&mut self, requested: PlanarPose) -> (PlanarPose, Matched) {
        let (sin, cos) = requested.theta_rad.sin_cos();
        let moved: Vec<DVec2> =
            self.model.points.iter().map(|p| DVec2::new(p.y * cos + p.x * sin + requested.y_m, p.z)).collect();
        let tree = Samples::in_plane(&moved.iter().map(|p| DVec3::new(0.0, p.x, p.y)).collect::<Vec<_>>());
        let mut matched = Matched { changed: true, ..Matched::default() };
        for (p, slot) in self.scene.iter().zip(&mut self.nearest) {
            let (item, _) = tree.nearest(DVec3::new(0.0, p.x, p.y));
            *slot = item;
            matched.add(moved[item as usize].distance_squared(*p));
        }
        self.lookups += self.scene.len();
        let whole: Vec<DVec2> = self.model.points.iter().map(|p| DVec2::new(p.y, p.z)).collect();
        let mean = moved.iter().sum::<DVec2>() / moved.len() as f64;
        (rigid(&moved, mean, |i| whole[i]), matched)
    }

    /// The pose that brings the pairs closest.
    fn closed_form(&self) -> PlanarPose {
        rigid(&self.scene, self.centroid, |i| self.model.yz(self.nearest[i]))
    }

    fn note(&mut self, run: usize, iteration: usize, grasp_from_object: PlanarPose, matched: &Matched) {
        if self.config.record {
            let points = self.scene.len();
            self.trace.push(TraceStep {
                run,
                iteration,
                grasp_from_object,
                cost_m2: matched.squares / points as f64,
                mask_cost_m2: None,
                inlier_share: matched.inliers as f64 / points as f64,
                kernel_m: f64::INFINITY,
                points,
            });
        }
    }
}

/// The rigid motion of the model that brings the pairs closest: `grasp_from_object`.
///
/// The rotation is read from the 2 x 2 correlation directly, which unlike an SVD cannot return a reflection.
fn rigid(scene: &[DVec2], scene_mean: DVec2, model: impl Fn(usize) -> DVec2) -> PlanarPose {
    let model_mean = (0..scene.len()).map(&model).sum::<DVec2>() / scene.len() as f64;
    let (mut dot, mut cross) = (0.0, 0.0);
    for (i, p) in scene.iter().enumerate() {
        let (s, m) = (*p - scene_mean, model(i) - model_mean);
        dot += m.dot(s);
        cross += m.perp_dot(s);
    }
    let theta_rad = cross.atan2(dot);
    let shift = scene_mean - DVec2::from_angle(theta_rad).rotate(model_mean);
    PlanarPose { theta_rad, y_m: shift.x, z_m: shift.y }
}

/// The number of [`PaperTrap::RmseChoice`]: over the model points with a contact within the gate, in space, meters.
/// Zero if there is none, as in the lab's tool for it.
fn gated_rmse(model: &LabModel, contacts: &Samples, pose: PlanarPose) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for p in model.points.iter() {
        let yz = pose.transform_yz(DVec2::new(p.y, p.z));
        let q = DVec3::new(p.x, yz.x, yz.y);
        let (item, _) = contacts.nearest(q);
        let squared = contacts.point(item).distance_squared(q);
        if squared <= GATE_M * GATE_M {
            sum += squared;
            count += 1;
        }
    }
    if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
}

fn fits(flat: &Samples, points: &[DVec3], pose: PlanarPose) -> Vec<PointFit> {
    let object_from_grasp = pose.inverse();
    points
        .iter()
        .map(|p| {
            if !p.is_finite() {
                return PointFit { residual_m: f32::NAN, weight: 0.0, fate: Fate::NotFinite };
            }
            let q = object_from_grasp.transform_yz(DVec2::new(p.y, p.z));
            let q = DVec3::new(0.0, q.x, q.y);
            let (item, _) = flat.nearest(q);
            PointFit { residual_m: flat.point(item).distance(q) as f32, weight: 1.0, fate: Fate::Inlier }
        })
        .collect()
}

#[cfg(test)]
mod tests;
