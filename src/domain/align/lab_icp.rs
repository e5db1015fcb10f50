//! The lab's planar ICP, reproduced for comparison: point to point, every contact point to its nearest model point,
//! a closed-form rotation, a fixed number of iterations, one start at the identity, no rejection of outliers.
//!
//! Source: the lab's touch2touch repository, `evaluation/pose_estimators.py` lines 153-281, reimplemented from a
//! description. Two things differ without changing a result: the k-d tree stays with the model and the contacts are
//! moved instead, and the loop ends early once the correspondences repeat, because then every later iteration
//! repeats too. One thing differs on purpose: too few points are an error, not the previous sample's pose.

use glam::DVec2;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use serde::{Deserialize, Serialize};

use super::register::{Ask, Register, Scene};
use super::{AlignError, AlignReport, Fate, PointFit, Prior, Run, Rung, Stop, TraceStep, observability};
use crate::domain::frames::PlanarPose;
use crate::domain::tool::ToolModel;

/// Fewest contact points the lab's loop works with.
pub const LAB_MIN_POINTS: usize = 4;
/// Points the lab samples from the CAD model's surface.
pub const LAB_MODEL_POINTS: usize = 5000;
/// Distance below which a contact counts as an inlier in the report, metres; the loop itself does not use it.
const INLIER_M: f64 = 1e-3;

/// What [`lab_icp()`] may vary; the default is the lab's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabIcpConfig {
    /// Iterations; the lab always runs all 200.
    pub iterations: usize,
    /// Pose to start from, `grasp_from_object`; the lab uses the identity.
    pub start: PlanarPose,
    /// Keep per-iteration states and per-point residuals.
    pub record: bool,
}

impl Default for LabIcpConfig {
    fn default() -> Self {
        Self { iterations: 200, start: PlanarPose::default(), record: false }
    }
}

impl Register for LabIcpConfig {
    fn run(&self, scene: &Scene<'_>, tool: &ToolModel, ask: Ask<'_>) -> Result<AlignReport, AlignError> {
        let mut config = self.clone();
        config.record = ask.record;
        match ask.starts {
            Some([start]) => config.start = *start,
            Some(_) => return Err(AlignError::Config { what: "starts" }),
            None => {}
        }
        let mut report = lab_icp(scene.yz(), &tool.model_points, &config)?;
        report.observability = Some(observability(scene.yz(), &tool.field, report.grasp_from_object));
        Ok(report)
    }
}

/// Aligns model points (object frame) to contact points (grasp frame), both `(y, z)` in metres.
///
/// Points that are not finite are dropped and counted. The reported cost is the mean squared distance.
///
/// # Errors
/// [`AlignError`] for fewer than four contact or model points, coincident contacts, or a start that is not finite.
pub fn lab_icp(points_yz: &[DVec2], model_points: &[DVec2], config: &LabIcpConfig) -> Result<AlignReport, AlignError> {
    if !config.start.is_finite() {
        return Err(AlignError::Config { what: "start" });
    }
    if config.iterations == 0 {
        return Err(AlignError::Config { what: "iterations" });
    }
    let scene = super::clean(points_yz, LAB_MIN_POINTS)?;
    let model: Vec<[f64; 2]> = model_points.iter().filter(|p| p.is_finite()).map(|p| p.to_array()).collect();
    if model.len() < LAB_MIN_POINTS {
        return Err(AlignError::EmptyModel { got: model.len() });
    }
    let tree =
        ImmutableKdTree::<f64, 2>::new_from_slice(&model).map_err(|_| AlignError::EmptyModel { got: model.len() })?;
    let count = scene.points.len();
    let mut pose = config.start;
    let mut nearest = vec![u32::MAX; count];
    let mut trace = Vec::new();
    let mut lookups = 0;
    let mut iterations = 0;
    let mut stop = Stop::IterationLimit;
    while iterations < config.iterations {
        let matched = match_all(&tree, &scene.points, pose, &mut nearest);
        lookups += count;
        note(config, &mut trace, iterations, pose, &matched, count);
        if !matched.changed {
            stop = Stop::FixedPoint;
            break;
        }
        pose = closed_form(&scene.points, scene.centroid, &model, &nearest);
        iterations += 1;
    }
    let matched = match_all(&tree, &scene.points, pose, &mut nearest);
    lookups += count;
    if stop == Stop::IterationLimit {
        note(config, &mut trace, iterations, pose, &matched, count);
    }
    let fits = if config.record { fits(&tree, points_yz, pose) } else { Vec::new() };
    let run = Run {
        requested: config.start,
        start: config.start,
        end: pose,
        cost_m2: matched.squares / count as f64,
        iterations,
        stop,
    };
    Ok(AlignReport {
        grasp_from_object: pose,
        grasp_from_object_6dof: None,
        converged: stop.converged(),
        stop,
        start: config.start,
        runs: vec![run],
        winner: 0,
        rung: Rung::Fixed,
        ladder: Vec::new(),
        certificate: None,
        iterations,
        lookups,
        offered: points_yz.len(),
        not_finite: scene.not_finite,
        used: count,
        inlier_share: matched.inliers as f64 / count as f64,
        inlier_rms_m: (matched.inlier_squares / (matched.inliers as f64).max(1.0)).sqrt(),
        within_prior: Prior::default().allows(pose),
        observability: None,
        directions: None,
        trace,
        fits,
    })
}

#[derive(Default)]
struct Matched {
    changed: bool,
    squares: f64,
    inliers: usize,
    inlier_squares: f64,
}

/// The nearest model point of every contact under `pose`.
fn match_all(tree: &ImmutableKdTree<f64, 2>, scene: &[DVec2], pose: PlanarPose, nearest: &mut [u32]) -> Matched {
    let object_from_grasp = pose.inverse();
    let mut matched = Matched::default();
    for (p, slot) in scene.iter().zip(nearest) {
        let (item, squared) = nearest_model_point(tree, object_from_grasp.transform_yz(*p));
        matched.changed |= *slot != item;
        *slot = item;
        matched.squares += squared;
        if squared <= INLIER_M * INLIER_M {
            matched.inliers += 1;
            matched.inlier_squares += squared;
        }
    }
    matched
}

fn nearest_model_point(tree: &ImmutableKdTree<f64, 2>, in_object: DVec2) -> (u32, f64) {
    let found = tree.query(&in_object.to_array()).nearest_one::<SquaredEuclidean<f64>>().execute();
    (found.item, found.distance)
}

/// The rigid motion of the model that brings the pairs closest: `grasp_from_object`.
///
/// The rotation is read from the 2 x 2 correlation directly, which unlike an SVD cannot return a reflection.
fn closed_form(scene: &[DVec2], scene_centroid: DVec2, model: &[[f64; 2]], nearest: &[u32]) -> PlanarPose {
    let model_point = |item: u32| DVec2::from_array(model[item as usize]);
    let model_centroid = nearest.iter().map(|&i| model_point(i)).sum::<DVec2>() / nearest.len() as f64;
    let (mut dot, mut cross) = (0.0, 0.0);
    for (p, item) in scene.iter().zip(nearest) {
        let (s, m) = (*p - scene_centroid, model_point(*item) - model_centroid);
        dot += m.dot(s);
        cross += m.perp_dot(s);
    }
    let theta_rad = cross.atan2(dot);
    let shift = scene_centroid - DVec2::from_angle(theta_rad).rotate(model_centroid);
    PlanarPose { theta_rad, y_m: shift.x, z_m: shift.y }
}

fn note(
    config: &LabIcpConfig,
    trace: &mut Vec<TraceStep>,
    iteration: usize,
    grasp_from_object: PlanarPose,
    matched: &Matched,
    points: usize,
) {
    if config.record {
        trace.push(TraceStep {
            run: 0,
            iteration,
            grasp_from_object,
            grasp_from_object_6dof: None,
            cost_m2: matched.squares / points as f64,
            inlier_share: matched.inliers as f64 / points as f64,
            kernel_m: f64::INFINITY,
            points,
        });
    }
}

fn fits(tree: &ImmutableKdTree<f64, 2>, points: &[DVec2], pose: PlanarPose) -> Vec<PointFit> {
    let object_from_grasp = pose.inverse();
    points
        .iter()
        .map(|p| {
            if p.is_finite() {
                let (_, squared) = nearest_model_point(tree, object_from_grasp.transform_yz(*p));
                PointFit { residual_m: squared.sqrt() as f32, weight: 1.0, fate: Fate::Inlier }
            } else {
                PointFit { residual_m: f32::NAN, weight: 0.0, fate: Fate::NotFinite }
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::align::testing::{cross, cross_contacts};

    /// The loop as written in the source's words: the model is moved, every nearest point is searched in full, all
    /// iterations are run.
    fn literal(scene: &[DVec2], model: &[DVec2], iterations: usize) -> PlanarPose {
        let mut pose = PlanarPose::default();
        let mean = |v: &[DVec2]| v.iter().sum::<DVec2>() / v.len() as f64;
        for _ in 0..iterations {
            let moved: Vec<DVec2> = model.iter().map(|m| pose.transform_yz(*m)).collect();
            let paired: Vec<DVec2> = scene
                .iter()
                .map(|s| {
                    let near = |i: &usize, j: &usize| {
                        moved[*i].distance_squared(*s).total_cmp(&moved[*j].distance_squared(*s))
                    };
                    model[(0..model.len()).min_by(near).unwrap()]
                })
                .collect();
            let (mu_s, mu_m) = (mean(scene), mean(&paired));
            let mut w = [[0.0; 2]; 2];
            for (s, m) in scene.iter().zip(&paired) {
                // The lab's plane is (z, y), so its rotation has the other sign.
                let (s, m) = ([s.y - mu_s.y, s.x - mu_s.x], [m.y - mu_m.y, m.x - mu_m.x]);
                for i in 0..2 {
                    for j in 0..2 {
                        w[i][j] += s[i] * m[j];
                    }
                }
            }
            let phi = (w[1][0] - w[0][1]).atan2(w[0][0] + w[1][1]);
            let t = mu_s - DVec2::from_angle(-phi).rotate(mu_m);
            pose = PlanarPose { theta_rad: -phi, y_m: t.x, z_m: t.y };
        }
        pose
    }

    fn model(count: usize) -> Vec<DVec2> {
        cross().sample_surface(count, 1).iter().map(|p| DVec2::new(p.y, p.z)).collect()
    }

    #[test]
    fn equals_the_literal_loop_in_every_iteration() {
        let truth = PlanarPose { theta_rad: 0.15, y_m: 0.002, z_m: -0.003 };
        let scene = cross_contacts(300, truth, 2e-4, 5);
        let model = model(400);
        for iterations in [1, 2, 7, 60] {
            let config = LabIcpConfig { iterations, ..LabIcpConfig::default() };
            let ours = lab_icp(&scene, &model, &config).unwrap().grasp_from_object;
            let theirs = literal(&scene, &model, iterations);
            assert!((ours.theta_rad - theirs.theta_rad).abs().to_degrees() < 1e-6, "{ours:?} {theirs:?}");
            assert!((ours.y_m - theirs.y_m).hypot(ours.z_m - theirs.z_m) < 1e-12);
        }
    }

    #[test]
    fn stops_early_at_a_fixed_point_and_reports_it() {
        let truth = PlanarPose { theta_rad: -0.05, y_m: 0.001, z_m: 0.001 };
        let scene = cross_contacts(600, truth, 1e-4, 2);
        let config = LabIcpConfig { record: true, ..LabIcpConfig::default() };
        let report = lab_icp(&scene, &model(2000), &config).unwrap();
        assert_eq!(report.stop, Stop::FixedPoint);
        assert!(report.converged && report.iterations < 200);
        assert_eq!(report.trace.len(), report.iterations + 1);
        assert_eq!(report.trace[0].grasp_from_object, PlanarPose::default());
        assert_eq!(report.trace.last().unwrap().grasp_from_object, report.grasp_from_object);
        assert!((report.lab_angle_rad() - 0.05).abs() < 0.02, "the lab's sign");
        assert_eq!(report.fits.len(), 600);
    }

    #[test]
    fn too_few_and_degenerate_inputs_are_errors() {
        let config = LabIcpConfig::default();
        let model = model(100);
        let few = cross_contacts(3, PlanarPose::default(), 0.0, 1);
        assert_eq!(lab_icp(&few, &model, &config), Err(AlignError::TooFewPoints { got: 3, needed: 4 }));
        let same = vec![DVec2::new(0.01, 0.02); 50];
        assert!(matches!(lab_icp(&same, &model, &config), Err(AlignError::Coincident { .. })));
        let scene = cross_contacts(50, PlanarPose::default(), 0.0, 1);
        assert_eq!(lab_icp(&scene, &[DVec2::NAN; 9], &config), Err(AlignError::EmptyModel { got: 0 }));
        let same_model = vec![DVec2::new(0.001, 0.002); 5000];
        assert!(lab_icp(&scene, &same_model, &config).unwrap().grasp_from_object.is_finite());
    }
}
