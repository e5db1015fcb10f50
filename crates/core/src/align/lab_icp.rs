//! The lab's planar ICP, reproduced for comparison: point to point, every contact point to its nearest model point,
//! a closed-form rotation, a fixed number of iterations, one start at the identity, no rejection of outliers.
//!
//! Source: the lab's touch2touch repository, `evaluation/pose_estimators.py` lines 153-281 and
//! `ICP_dataset_cal.py` lines 127-153, reimplemented from a description. Two things differ without changing a result:
//! the k-d tree stays with the model and the contacts are moved instead, and the loop ends early once the
//! correspondences repeat, because then every later iteration repeats too. One thing differs on purpose: too few
//! points are an error, not the previous sample's pose.

use glam::{DVec2, DVec3};

use super::register::{Ask, Register, Scene, check_overlap};
pub use super::samples::LabModel;
use super::samples::Matcher;
use super::{AlignError, AlignReport, Fate, PointFit, Prior, Run, Rung, Stop, TraceStep, clean, observability};
use crate::frames::PlanarPose;
use crate::tool::ToolModel;

/// Fewest contact points the lab's loop works with.
pub(crate) const LAB_MIN_POINTS: usize = 4;
/// Iterations that the lab runs.
const ITERATIONS: usize = 200;
/// Distance below which a contact counts as an inlier in the report, meters; the loop itself does not use it.
const INLIER_M: f64 = 1e-3;

/// [`lab_icp()`] as a registration. It starts at the identity, as the lab does, where no other start is asked for.
#[derive(Clone, Copy, Debug)]
pub struct LabIcp;

impl Register for LabIcp {
    fn run(&self, scene: &Scene<'_>, tool: &ToolModel, ask: Ask<'_>) -> Result<AlignReport, AlignError> {
        let identity = [PlanarPose::default()];
        let starts = ask.starts.unwrap_or(&identity);
        let finite = scene.yz().iter().copied().filter(|p| p.is_finite());
        // The loop pulls the model to whatever there is, so that its end no longer shows that there was nothing.
        if finite.clone().count() >= LAB_MIN_POINTS {
            check_overlap(finite, &tool.field, starts)?;
        }
        let mut report = lab_icp(scene.points(), &LabModel::of(tool), starts, ask.record)?;
        report.observability = Some(observability(scene.yz(), &tool.field, report.grasp_from_object));
        Ok(report)
    }
}

/// Aligns model points (object frame) to contact points (grasp frame), meters.
///
/// `starts` are poses to start from, `grasp_from_object`, at least one; the end with the least cost wins. `record` keeps
/// per-iteration states and per-point residuals. Points that are not finite are dropped and counted. The reported cost is
/// the mean squared distance in the plane.
///
/// # Errors
/// [`AlignError`] for fewer than four contact or model points, coincident contacts, or a start that is not finite.
pub fn lab_icp(
    points: &[DVec3],
    model: &LabModel,
    starts: &[PlanarPose],
    record: bool,
) -> Result<AlignReport, AlignError> {
    if starts.is_empty() || starts.iter().any(|s| !s.is_finite()) {
        return Err(AlignError::Config { what: "starts" });
    }
    let scene = Scene::new(points);
    let clean = clean(scene.yz(), LAB_MIN_POINTS)?;
    if model.len() < LAB_MIN_POINTS {
        return Err(AlignError::EmptyModel { got: model.len() });
    }
    let (count, centroid) = (clean.points.len(), clean.centroid);
    let scene = &*clean.points;
    let mut paper = Loop { record, model, scene, centroid, nearest: vec![0; count], lookups: 0, trace: Vec::new() };
    let ends: Vec<End> = starts.iter().enumerate().map(|(run, start)| paper.run(run, *start)).collect();
    let cost = |&end: &usize| ends[end].run.cost_m2;
    let winner = (0..ends.len()).min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(0);
    let End { run, matched } = ends[winner];
    let runs = ends.iter().map(|e| e.run).collect();
    let inliers = (matched.inliers, matched.inlier_squares);
    Ok(AlignReport {
        lookups: paper.lookups,
        offered: points.len(),
        not_finite: clean.not_finite,
        within_prior: Prior::default().allows(run.end),
        trace: paper.trace,
        fits: if record { fits(model, points, run.end) } else { Vec::new() },
        ..AlignReport::of(runs, winner, Rung::Fixed, count, inliers)
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
    record: bool,
    model: &'a LabModel,
    scene: &'a [DVec2],
    centroid: DVec2,
    nearest: Vec<u32>,
    lookups: usize,
    trace: Vec<TraceStep>,
}

impl Loop<'_> {
    /// The iterations from one of the starts.
    fn run(&mut self, run: usize, start: PlanarPose) -> End {
        let mut matcher = Matcher::new(self.scene.len());
        let mut stop = Stop::IterationLimit;
        let mut iterations = 0;
        let mut pose = start;
        while iterations < ITERATIONS {
            let matched = self.match_all(&mut matcher, pose);
            self.note(run, iterations, pose, &matched);
            if !matched.changed {
                stop = Stop::FixedPoint;
                break;
            }
            pose = rigid(self.scene, self.centroid, |i| self.model.point(self.nearest[i]));
            iterations += 1;
        }
        let matched = self.match_all(&mut matcher, pose);
        if stop == Stop::IterationLimit {
            self.note(run, iterations, pose, &matched);
        }
        self.lookups += matcher.lookups;
        let cost_m2 = matched.squares / self.scene.len() as f64;
        End { run: Run { requested: start, start, end: pose, cost_m2, iterations, stop }, matched }
    }

    /// The nearest model point of every contact under `pose`.
    fn match_all(&mut self, matcher: &mut Matcher, pose: PlanarPose) -> Matched {
        let object_from_grasp = pose.inverse();
        let mut matched = Matched::default();
        for (i, p) in self.scene.iter().enumerate() {
            let q = object_from_grasp.transform_yz(*p);
            let (item, changed) = matcher.find(self.model, i, q);
            self.nearest[i] = item;
            matched.changed |= changed;
            matched.add(self.model.point(item).distance_squared(q));
        }
        matched
    }

    fn note(&mut self, run: usize, iteration: usize, grasp_from_object: PlanarPose, matched: &Matched) {
        if self.record {
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

fn fits(model: &LabModel, points: &[DVec3], pose: PlanarPose) -> Vec<PointFit> {
    let object_from_grasp = pose.inverse();
    points
        .iter()
        .map(|p| {
            if !p.is_finite() {
                return PointFit { residual_m: f32::NAN, weight: 0.0, fate: Fate::NotFinite };
            }
            let q = object_from_grasp.transform_yz(DVec2::new(p.y, p.z));
            let (item, _) = model.nearest(q);
            PointFit { residual_m: model.point(item).distance(q) as f32, weight: 1.0, fate: Fate::Inlier }
        })
        .collect()
}

#[cfg(test)]
mod tests;
