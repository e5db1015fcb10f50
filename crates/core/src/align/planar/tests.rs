use std::sync::OnceLock;

use proptest::prelude::*;

use super::*;
use crate::align::testing::{cross, cross_contacts};
use crate::align::{Stop, TraceStep};
use crate::units::angle_error;

fn field() -> &'static DistanceField {
    static FIELD: OnceLock<DistanceField> = OnceLock::new();
    FIELD.get_or_init(|| DistanceField::from_mesh(&cross()).unwrap())
}

fn pose(degrees: f64, y_m: f64, z_m: f64) -> PlanarPose {
    PlanarPose { theta_rad: degrees.to_radians(), y_m, z_m }
}

fn errors(found: PlanarPose, truth: PlanarPose) -> (f64, f64) {
    let shift = (found.y_m - truth.y_m).hypot(found.z_m - truth.z_m);
    (angle_error(found.theta_rad, truth.theta_rad).to_degrees(), shift)
}

/// `outer` after `inner`.
fn compose(outer: PlanarPose, inner: PlanarPose) -> PlanarPose {
    let shift = outer.transform_yz(DVec2::new(inner.y_m, inner.z_m));
    PlanarPose { theta_rad: outer.theta_rad + inner.theta_rad, y_m: shift.x, z_m: shift.y }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn recovers_poses_of_the_prior(
        degrees in -22.5..22.5f64, y in -0.005..0.005f64, z in -0.005..0.005f64, seed in 0..1000u64,
    ) {
        let truth = pose(degrees, y, z);
        let report = align(&cross_contacts(1200, truth, 3e-4, seed), field(), &AlignConfig::default()).unwrap();
        let (angle, shift) = errors(report.grasp_from_object, truth);
        // 512 points with 0.3 mm noise, of which only those at the outline tell: several times the usual scatter.
        prop_assert!(angle < 1.3 && shift < 5e-4, "{angle} deg, {shift} m");
        prop_assert!(report.converged && report.within_prior && !report.is_degenerate());
        prop_assert!((report.lab_angle_rad() + report.grasp_from_object.theta_rad).abs() < 1e-12);
    }

    #[test]
    fn moving_the_hand_moves_the_answer_with_it(
        degrees in -180.0..180.0f64, y in -100.0..100.0f64, z in -1e5..1e5f64, seed in 0..1000u64,
    ) {
        let truth = pose(7.0, 0.002, -0.003);
        let points = cross_contacts(600, truth, 3e-4, seed);
        let starts = [-15.0, 0.0, 15.0].map(|d| pose(d, 0.0, 0.0)).to_vec();
        let still = align(&points, field(), &AlignConfig { starts, ..AlignConfig::default() }).unwrap();
        let motion = pose(degrees, y, z);
        let moved: Vec<DVec2> = points.iter().map(|p| motion.transform_yz(*p)).collect();
        let starts = [-15.0, 0.0, 15.0].map(|d| compose(motion, pose(d, 0.0, 0.0))).to_vec();
        let config = AlignConfig { starts, ..AlignConfig::default() };
        let report = align(&moved, field(), &config).unwrap();
        let (angle, _) = errors(report.grasp_from_object, compose(motion, still.grasp_from_object));
        // The look-ups are in f32: rounding may end a descent one step of some micrometers earlier.
        prop_assert!(angle < 0.02, "{angle} deg off after {motion:?}");
        // Where the tool's points end up, rather than the translation: that one is about a far origin.
        let corner = DVec2::new(0.01, 0.02);
        let expected = motion.transform_yz(still.grasp_from_object.transform_yz(corner));
        let distance = report.grasp_from_object.transform_yz(corner).distance(expected);
        prop_assert!(distance < 1e-5, "{distance} m off after {motion:?}");
    }
}

#[test]
fn a_blob_that_is_not_the_tool_is_let_go() {
    let truth = pose(12.0, -0.002, 0.003);
    let mut points = cross_contacts(900, truth, 3e-4, 3);
    // A quarter of the points in a disc beside the crossing.
    for i in 0..300 {
        let radius = 0.004 * (f64::from(i) / 300.0).sqrt();
        points.push(DVec2::new(0.001, 0.018) + DVec2::from_angle(f64::from(i) * 2.4) * radius);
    }
    let config = AlignConfig { record: true, ..AlignConfig::default() };
    let report = align(&points, field(), &config).unwrap();
    let (angle, shift) = errors(report.grasp_from_object, truth);
    // The blob still pulls a little; a squared cost would be off by several degrees.
    assert!(angle < 1.2 && shift < 8e-4, "{angle} deg, {shift} m");
    let gone = report.fits[900..].iter().filter(|f| f.fate == Fate::BeyondGate).count();
    assert!(gone > 150, "{gone} of the blob's 300 points are beyond the gate");
    assert!(report.fits[..900].iter().all(|f| f.fate != Fate::BeyondGate));
}

#[test]
fn recording_changes_nothing_and_tells_the_whole_way() {
    let points = cross_contacts(900, pose(15.0, 0.003, -0.001), 3e-4, 9);
    let starts = [-15.0, 0.0, 15.0].map(|d| pose(d, 0.0, 0.0)).to_vec();
    let config = AlignConfig { starts, ..AlignConfig::default() };
    let plain = align(&points, field(), &config).unwrap();
    assert_eq!((plain.trace.capacity(), plain.fits.capacity(), plain.ladder.len()), (0, 0, 0));
    let config = AlignConfig { record: true, ..config };
    let recorded = align(&points, field(), &config).unwrap();
    assert_eq!(plain, AlignReport { trace: Vec::new(), fits: Vec::new(), ..recorded.clone() });
    assert_eq!(recorded.fits.len(), points.len());
    for (run, start) in config.starts.iter().enumerate() {
        let steps: Vec<&TraceStep> = recorded.trace.iter().filter(|t| t.run == run).collect();
        let (angle, shift) = errors(steps[0].grasp_from_object, *start);
        assert!(steps[0].iteration == 0 && angle < 1e-9 && shift < 1e-12, "state 0 is the start as applied");
        let run = &recorded.runs[run];
        assert!(run.stop == Stop::Merged || steps.last().unwrap().grasp_from_object == run.end);
        for pair in steps.windows(2) {
            let same = pair[0].kernel_m == pair[1].kernel_m && pair[0].points == pair[1].points;
            assert!(!same || pair[1].cost_m2 < pair[0].cost_m2, "every accepted step lowers the cost");
        }
    }
    assert_eq!(recorded.start, config.starts[recorded.winner]);
    let winner = &recorded.runs[recorded.winner];
    assert!(recorded.runs.iter().all(|r| r.cost_m2 >= winner.cost_m2));
}

/// A cross with a share of the points in a blob beside it, which no pose explains.
fn with_blob(share: f64) -> Vec<DVec2> {
    let blob = (1200.0 * share) as usize;
    let mut points = cross_contacts(1200 - blob, pose(8.0, 0.001, -0.002), 3e-4, 7);
    points.extend((0..blob).map(|i| {
        let radius = 0.004 * (i as f64 / blob as f64).sqrt();
        DVec2::new(0.021, 0.022) + DVec2::from_angle(i as f64 * 2.4) * radius
    }));
    points
}

#[test]
fn every_rung_is_reached_by_the_scene_that_needs_it() {
    use Rung::{Certified, Grid, Several, Single};
    let climb = |points: &[DVec2], config: &AlignConfig| {
        let report = align(points, field(), config).unwrap();
        assert_eq!(report.ladder.last().unwrap().rung, report.rung);
        assert_eq!(report.lookups, report.ladder.iter().map(|a| a.lookups).sum::<usize>());
        assert_eq!(report.certificate.is_some(), report.rung == Certified);
        let (angle, _) = errors(report.grasp_from_object, pose(8.0, 0.001, -0.002));
        assert!(angle < 1.5, "{angle} deg on the rung {}", report.rung);
        report.ladder.iter().map(|a| (a.rung, a.outcome)).collect::<Vec<_>>()
    };
    let config = AlignConfig::default();
    assert_eq!(climb(&with_blob(0.0), &config), [(Single, Outcome::Accepted)]);
    // A fifth is a bad mask: five starts agree, and the answer is believed.
    assert_eq!(climb(&with_blob(0.225), &config), [(Single, Outcome::Cost), (Several, Outcome::Accepted)]);
    // A third is too much for every test: all is searched, and the answer carries its proof.
    let refused = climb(&with_blob(0.33), &config);
    assert_eq!(refused.iter().map(|a| a.0).collect::<Vec<_>>(), [Single, Several, Grid, Certified]);
    assert!(refused[..3].iter().all(|a| matches!(a.1, Outcome::Cost | Outcome::OutsidePrior)), "{refused:?}");
    assert_eq!(refused[3].1, Outcome::Last);
}

#[test]
fn a_far_pose_is_found_by_more_starts() {
    // A gripper that may hold the tool anywhere within 20 mm: one start slides off along a bar.
    let truth = pose(8.0, -0.015, -0.016);
    let points = cross_contacts(1200, truth, 3e-4, 7);
    let prior = Prior { theta_rad: 0.2, shift_m: 0.02 };
    for second in [Rung::Several, Rung::Grid] {
        let config = AlignConfig { rungs: vec![Rung::Single, second], prior, ..AlignConfig::default() };
        let report = align(&points, field(), &config).unwrap();
        let climbed: Vec<_> = report.ladder.iter().map(|a| (a.rung, a.outcome)).collect();
        assert_eq!(climbed, [(Rung::Single, Outcome::OutsidePrior), (second, Outcome::Accepted)]);
        let (angle, shift) = errors(report.grasp_from_object, truth);
        assert!(angle < 0.5 && shift < 3e-4, "{angle} deg, {shift} m");
    }
}
