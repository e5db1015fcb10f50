use glam::{DVec2, DVec3};

use super::*;
use crate::align::testing::{cross, cross_contacts};

fn in_space(yz: Vec<DVec2>) -> Vec<DVec3> {
    yz.into_iter().map(|p| DVec3::new(0.0, p.x, p.y)).collect()
}

fn model(count: usize) -> LabModel {
    LabModel::new(&cross().sample_surface(count, 1))
}

#[derive(Deserialize)]
struct TwinCase {
    name: String,
    wrong_frame: bool,
    rmse_choice: bool,
    /// Nanometers.
    model: Vec<[i64; 3]>,
    scene: Vec<[i64; 3]>,
    starts: Vec<[f64; 3]>,
    iterations: Vec<usize>,
    /// By start, then by iteration: angle (radians), y, z (meters).
    poses: Vec<Vec<[f64; 3]>>,
    winner: usize,
}

fn meters(points: &[[i64; 3]]) -> Vec<DVec3> {
    // Divided, as the twin's decimals are read: multiplying by 1e-9 would differ in the last digit.
    points.iter().map(|p| DVec3::from_array(p.map(|v| v as f64 / 1e9))).collect()
}

fn assert_near(name: &str, found: PlanarPose, [theta, y, z]: [f64; 3]) {
    let error_deg = crate::units::angle_error(found.theta_rad, theta).to_degrees();
    assert!(error_deg < 1e-6, "{name}: {error_deg} deg");
    assert!((found.y_m - y).hypot(found.z_m - z) < 1e-9, "{name}: {found:?} for {y} {z}");
}

/// `tests/data/lab_icp_twin.py` says how the file is made.
#[test]
fn equals_the_numpy_twin_in_every_iteration_with_and_without_traps() {
    let cases: Vec<TwinCase> = serde_json::from_str(include_str!("../../../tests/data/lab_icp_twin.json")).unwrap();
    assert!(cases.len() >= 6);
    for case in &cases {
        let starts: Vec<PlanarPose> =
            case.starts.iter().map(|&[theta_rad, y_m, z_m]| PlanarPose { theta_rad, y_m, z_m }).collect();
        let mut traps = vec![PaperTrap::FixedIterations];
        traps.extend(case.wrong_frame.then_some(PaperTrap::WrongFrame));
        traps.extend(case.rmse_choice.then_some(PaperTrap::RmseChoice));
        let model = LabModel::new(&meters(&case.model));
        let config = LabIcpConfig { starts: starts.clone(), traps, record: true, ..LabIcpConfig::default() };
        let report = lab_icp(&meters(&case.scene), &model, &config).unwrap();
        for (run, poses) in case.poses.iter().enumerate() {
            assert_eq!(report.runs[run].requested, starts[run]);
            assert_near(&case.name, report.runs[run].start, poses[0]);
            for (&iteration, &pose) in case.iterations.iter().zip(poses) {
                let step = report.trace.iter().find(|s| s.run == run && s.iteration == iteration).unwrap();
                assert_near(&format!("{} start {run} iteration {iteration}", case.name), step.grasp_from_object, pose);
            }
        }
        let winner = case.poses[case.winner].last().unwrap();
        assert_near(&format!("{}: choice", case.name), report.grasp_from_object, *winner);
        assert!(report.runs.iter().all(|r| r.iterations == 200 && r.stop == Stop::IterationLimit));
        // Stopping where nothing can change any more gives the same ends.
        let config = LabIcpConfig {
            traps: config.traps.into_iter().filter(|t| *t != PaperTrap::FixedIterations).collect(),
            ..config
        };
        let stopped = lab_icp(&meters(&case.scene), &model, &config).unwrap();
        assert_eq!(stopped.grasp_from_object, report.grasp_from_object, "{}", case.name);
        assert!(stopped.converged && stopped.iterations < report.iterations);
    }
}

#[test]
fn the_wrong_frame_applies_almost_nothing_of_a_start() {
    let scene = in_space(cross_contacts(300, PlanarPose::default(), 1e-4, 3));
    for degrees in [-22.5f64, 22.5] {
        let start = PlanarPose { theta_rad: degrees.to_radians(), y_m: 0.002, z_m: 0.004 };
        let config = LabIcpConfig { starts: vec![start], record: true, ..LabIcpConfig::default() };
        let right = lab_icp(&scene, &model(2000), &config).unwrap();
        assert_eq!((right.start, right.runs[0].requested), (start, start));
        assert_eq!(right.trace[0].grasp_from_object, start);
        let config = LabIcpConfig { traps: vec![PaperTrap::WrongFrame], ..config };
        let wrong = lab_icp(&scene, &model(2000), &config).unwrap();
        assert_eq!(wrong.runs[0].requested, start);
        assert!(wrong.start.theta_rad.to_degrees().abs() < 2.0, "applied {:?}", wrong.start);
        assert!(wrong.start.z_m.abs() < 5e-4, "a shift along z goes out of the plane: {:?}", wrong.start);
        assert_eq!(wrong.trace[0].grasp_from_object, wrong.start, "the first state is what was applied");
    }
}

#[test]
fn the_labs_choice_takes_an_empty_match() {
    let truth = PlanarPose { theta_rad: 0.1, y_m: 0.001, z_m: 0.0 };
    let scene = in_space(cross_contacts(300, truth, 1e-4, 4));
    let contacts = Samples::in_space(&scene);
    let model = model(2000);
    let far = PlanarPose { y_m: 0.5, ..truth };
    assert_eq!(gated_rmse(&model, &contacts, far), 0.0);
    assert!(gated_rmse(&model, &contacts, truth) > 1e-4);
}

#[test]
fn starts_are_drawn_with_replacement_and_from_the_seed() {
    let starts = lab_starts(1);
    assert_eq!((starts.len(), lab_starts(1)), (10, starts.clone()));
    let mut angles = std::collections::BTreeSet::new();
    let mut distinct = 0;
    for seed in 0..200 {
        let starts = lab_starts(seed);
        assert!(starts.iter().all(|s| s.theta_rad.abs() <= 22.5f64.to_radians() + 1e-12 && s.z_m.abs() <= 0.01));
        let own: std::collections::BTreeSet<i64> =
            starts.iter().map(|s| (s.theta_rad.to_degrees() * 10.0).round() as i64).collect();
        distinct += own.len();
        angles.extend(own);
    }
    assert_eq!(angles.len(), 10);
    assert!((distinct as f64 / 200.0 - 6.5).abs() < 0.4, "ten draws from ten: 6.5 distinct");
}
