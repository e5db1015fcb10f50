use glam::DVec3;
use serde::Deserialize;

use super::*;

#[derive(Deserialize)]
struct TwinCase {
    name: String,
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
fn equals_the_numpy_twin_in_every_iteration() {
    let cases: Vec<TwinCase> = serde_json::from_str(include_str!("../../../tests/data/lab_icp_twin.json")).unwrap();
    assert!(cases.len() >= 3);
    for case in &cases {
        let starts: Vec<PlanarPose> =
            case.starts.iter().map(|&[theta_rad, y_m, z_m]| PlanarPose { theta_rad, y_m, z_m }).collect();
        let report = lab_icp(&meters(&case.scene), &LabModel::new(&meters(&case.model)), &starts, true).unwrap();
        for (run, poses) in case.poses.iter().enumerate() {
            assert_eq!(report.runs[run].start, starts[run]);
            for (&iteration, &pose) in case.iterations.iter().zip(poses) {
                // The twin goes on where nothing can change any more.
                let before = report.trace.iter().rfind(|s| s.run == run && s.iteration <= iteration).unwrap();
                assert_near(
                    &format!("{} start {run} iteration {iteration}", case.name),
                    before.grasp_from_object,
                    pose,
                );
            }
        }
        let winner = case.poses[case.winner].last().unwrap();
        assert_near(&format!("{}: choice", case.name), report.grasp_from_object, *winner);
        assert!(report.converged && report.runs.iter().all(|r| r.iterations < ITERATIONS));
    }
}
