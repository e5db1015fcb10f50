use super::prepared::instead_of_triangles;
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::align::RefineConfig;
use crate::align::closed_form::closest_rotation;
use crate::align::testing::{cross, cross_contacts, cuboid, disc, filled};
use crate::mesh::TriMesh;
use crate::units::angle_error;

fn all() -> Vec<(&'static str, Box<dyn Register>)> {
    vec![
        ("planar point to point", Box::new(IcpConfig::planar_point_to_point())),
        ("planar point to plane", Box::new(IcpConfig::planar_point_to_plane())),
        ("planar gicp", Box::new(IcpConfig::planar_gicp())),
        ("point to point", Box::new(IcpConfig::point_to_point())),
        ("point to plane", Box::new(IcpConfig::point_to_plane())),
        ("gicp", Box::new(IcpConfig::gicp())),
        ("refined", Box::new(RefineConfig::default())),
    ]
}

/// Contacts on the two flat sides of a tool that is 6 mm thick.
fn on_both_sides(yz: &[DVec2]) -> Vec<DVec3> {
    yz.iter().enumerate().map(|(i, p)| DVec3::new(if i % 2 == 0 { 0.003 } else { -0.003 }, p.x, p.y)).collect()
}

fn run(
    registration: &dyn Register,
    points: &[DVec3],
    tool: &ToolModel,
    ask: Ask<'_>,
) -> Result<AlignReport, AlignError> {
    registration.run(&Scene::new(points), tool, ask)
}

const RECORD: Ask<'static> = Ask { starts: None, record: true, evidence: false, provisional: false };

#[test]
fn every_member_finds_the_pose_and_tells_how() {
    let tool = ToolModel::new(cross()).unwrap();
    let truth = PlanarPose { theta_rad: 0.21, y_m: 0.002, z_m: -0.003 };
    let mut points = on_both_sides(&cross_contacts(800, truth, 2e-4, 1));
    points[7] = DVec3::NAN;
    for (name, registration) in all() {
        let report = run(&*registration, &points, &tool, RECORD).unwrap();
        let pose = report.grasp_from_object;
        let error_deg = angle_error(pose.theta_rad, truth.theta_rad).to_degrees();
        assert!(error_deg < 1.5, "{name}: {error_deg} deg");
        assert!((pose.y_m - truth.y_m).hypot(pose.z_m - truth.z_m) < 8e-4, "{name}: {pose:?}");
        assert_eq!((report.offered, report.not_finite, report.fits.len()), (800, 1, 800), "{name}");
        assert_eq!(report.fits[7].fate, Fate::NotFinite, "{name}");
        assert!(report.converged && report.within_prior && !report.is_degenerate(), "{name}: {}", report.stop);
        let steps: Vec<_> = report.trace.iter().filter(|s| s.run == report.winner).collect();
        assert_eq!(steps[0].iteration, 0, "{name}");
        // Through a rotation in space and back: equal up to rounding.
        let (first, start) = (steps[0].grasp_from_object, report.start);
        assert!((first.theta_rad - start.theta_rad).abs() < 1e-12 && (first.y_m - start.y_m).abs() < 1e-12, "{name}");
        let last = steps.last().unwrap();
        assert_eq!(last.grasp_from_object, pose, "{name}");
        assert_eq!(last.grasp_from_object_6dof, report.grasp_from_object_6dof, "{name}");
        assert_eq!(report.grasp_from_object_6dof.is_some(), !name.starts_with("planar"), "{name}");
        // Looking changes nothing; the same start alone leads to the same end.
        let plain = run(&*registration, &points, &tool, Ask::default()).unwrap();
        assert_eq!((plain.grasp_from_object, plain.trace.len(), plain.fits.len()), (pose, 0, 0), "{name}");
        let alone =
            run(&*registration, &points, &tool, Ask { starts: Some(&[report.start]), ..Ask::default() }).unwrap();
        assert_eq!((alone.runs.len(), alone.runs[0].start), (1, report.start), "{name}");
        assert!(angle_error(alone.grasp_from_object.theta_rad, pose.theta_rad) < 2e-3, "{name}");
    }
}

/// A tilt and a shift that no planar pose has: the members with six degrees of freedom find them.
#[test]
fn six_degrees_of_freedom_are_found_where_they_are_told() {
    let tool = ToolModel::new(cross()).unwrap();
    let turn = DQuat::from_rotation_x(0.12) * DQuat::from_rotation_y(0.05) * DQuat::from_rotation_z(-0.04);
    let truth = DAffine3::from_rotation_translation(turn, DVec3::new(4e-4, 0.002, -0.001));
    let points: Vec<DVec3> = cross().sample_surface(1500, 9).iter().map(|p| truth.transform_point3(*p)).collect();
    for (name, registration) in all() {
        let report = run(&*registration, &points, &tool, Ask::default()).unwrap();
        let Some(found) = report.grasp_from_object_6dof else { continue };
        let off = DQuat::from_mat3(&(truth.matrix3.transpose() * found.matrix3)).to_scaled_axis().length().to_degrees();
        // The last one is held back to the planar pose a little, on purpose.
        assert!(off < 1.0, "{name}: {off} deg");
        assert!((found.translation - truth.translation).length() < 5e-4, "{name}: {found:?}");
        assert!((found.matrix3.determinant() - 1.0).abs() < 1e-9, "{name}");
        assert!(angle_error(report.grasp_from_object.theta_rad, 0.12).to_degrees() < 1.2, "{name}");
    }
}

/// Kabsch by singular values returns a reflection for a third to a half of such sets.
#[test]
fn planar_and_collinear_pairs_never_give_a_reflection() {
    for seed in 0..500u64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform = move || rng.random::<f64>() * 2.0 - 1.0;
        let turn = DQuat::from_scaled_axis(DVec3::new(uniform(), uniform(), uniform()));
        for line in [false, true] {
            let (mut correlation, along) = (DMat3::ZERO, DVec3::new(0.0, 0.3, 0.9));
            for _ in 0..40 {
                let a = if line { along * uniform() } else { DVec3::new(0.0, uniform(), uniform()) } * 0.02;
                let m = turn * a + DVec3::new(uniform(), uniform(), uniform()) * 1e-3;
                correlation += DMat3::from_cols(a * m.x, a * m.y, a * m.z);
            }
            let found = DMat3::from_quat(closest_rotation(correlation).unwrap());
            assert!((found.determinant() - 1.0).abs() < 1e-9, "seed {seed}");
            let error = (found * along - turn * along).length() / along.length();
            assert!(error < 0.1, "seed {seed}, line {line}: {error}");
        }
    }
    // Nothing told, nothing turned; and no decomposition of what is not finite.
    assert!(closest_rotation(DMat3::ZERO).unwrap().angle_between(DQuat::IDENTITY) < 1e-12);
    assert_eq!(closest_rotation(DMat3::from_diagonal(DVec3::new(f64::INFINITY, 1.0, f64::NAN))), None);
}

#[test]
fn too_few_coincident_and_misplaced_contacts_are_errors() {
    let tool = ToolModel::new(cross()).unwrap();
    let contacts = on_both_sides(&cross_contacts(600, PlanarPose::default(), 1e-4, 3));
    for (name, registration) in all() {
        let ask = |points: &[DVec3]| run(&*registration, points, &tool, Ask::default()).unwrap_err();
        for count in [0, 1, 2, 31] {
            let error = ask(&contacts[..count]);
            assert_eq!(error, AlignError::TooFewPoints { got: count, needed: MIN_POINTS }, "{name}");
        }
        assert_eq!(ask(&[DVec3::NAN; 500]), AlignError::TooFewPoints { got: 0, needed: MIN_POINTS }, "{name}");
        assert!(matches!(ask(&[DVec3::splat(0.01); 50]), AlignError::Coincident { .. }), "{name}");
        let far: Vec<DVec3> = contacts.iter().map(|p| *p + DVec3::new(0.0, 1.0, 0.0)).collect();
        assert!(matches!(ask(&far), AlignError::NoOverlap { .. }), "{name}");
        for scale in [1e3, 1e6] {
            let scaled: Vec<DVec3> = contacts.iter().map(|p| *p * scale + DVec3::splat(0.05 * scale)).collect();
            assert!(matches!(ask(&scaled), AlignError::NoOverlap { .. }), "{name} at {scale}");
        }
        let tiny: Vec<DVec3> = contacts.iter().map(|p| *p * 1e-6).collect();
        assert!(matches!(ask(&tiny), AlignError::Coincident { .. }), "{name}");
        for starts in [&[][..], &[PlanarPose { theta_rad: f64::NAN, ..PlanarPose::default() }]] {
            let error = run(&*registration, &contacts, &tool, Ask { starts: Some(starts), ..Ask::default() });
            assert_eq!(error, Err(AlignError::Config { what: "starts" }), "{name}");
        }
    }
    let mut mesh = cross();
    mesh.vertices.iter_mut().for_each(|v| *v *= 1e3);
    assert!(ToolModel::new(mesh).unwrap_err().to_string().contains("scale it by 0.001"));
}

/// A rod slides along itself for free, a disc turns; what can be told must be told, and the rest must stay.
#[test]
fn open_directions_are_flagged_and_left_alone() {
    let half = DVec2::new(0.003, 0.05);
    let rod = ToolModel::new(cuboid(DVec3::ZERO, DVec3::new(0.003, half.x, half.y))).unwrap();
    let truth = PlanarPose { theta_rad: 12.3f64.to_radians(), y_m: 0.001, z_m: 0.0 };
    // Contacts on the middle of the rod only, so that its ends do not tell.
    let points = on_both_sides(&filled(&[DVec2::new(half.x, 0.02)], 0.0, 900, truth, 1.5e-4, 5));
    let start = PlanarPose { theta_rad: 10f64.to_radians(), y_m: 0.0, z_m: 0.0 };
    for (name, registration) in all() {
        let report = run(&*registration, &points, &rod, Ask { starts: Some(&[start]), ..Ask::default() }).unwrap();
        let pose = report.grasp_from_object;
        assert!(pose.is_finite(), "{name}");
        assert!(angle_error(pose.theta_rad, truth.theta_rad).to_degrees() < 1.0, "{name}: {pose:?}");
        assert!(report.is_degenerate(), "{name}");
        let [_, y, z] = report.observability.unwrap().weakest;
        let along = DVec2::from_angle(pose.theta_rad).rotate(DVec2::Y);
        assert!(along.dot(DVec2::new(y, z)).abs() > 5f64.to_radians().cos(), "{name}: {y} {z}");
        if matches!(name, "planar point to plane" | "refined") {
            let moved = DVec2::new(pose.y_m - start.y_m, pose.z_m - start.z_m).dot(along);
            // Turning about the contacts' middle moves the origin by next to nothing; sliding would show.
            assert!(moved.abs() < 3e-4, "{name}: slid by {moved} m");
        }
    }
    let disc = ToolModel::new(disc(0.012, 60)).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let points: Vec<DVec2> = (0..900)
        .map(|_| DVec2::from_angle(rng.random::<f64>() * std::f64::consts::TAU) * (0.0122 * rng.random::<f64>().sqrt()))
        .collect();
    for (name, registration) in all() {
        let report = run(&*registration, &on_both_sides(&points), &disc, Ask::default()).unwrap();
        assert!(report.grasp_from_object.is_finite() && report.is_degenerate(), "{name}");
        let [turn, ..] = report.observability.unwrap().weakest;
        assert!(turn.abs() > 0.9, "{name}: {turn}");
    }
}

#[test]
fn a_share_is_trimmed_and_says_so() {
    let tool = ToolModel::new(cross()).unwrap();
    let truth = PlanarPose { theta_rad: -0.1, y_m: 0.001, z_m: 0.002 };
    let mut points = on_both_sides(&cross_contacts(400, truth, 1e-4, 8));
    // A blob beside the tool.
    points[..80].iter_mut().enumerate().for_each(|(i, p)| *p = DVec3::new(0.0, 0.025 + 1e-5 * i as f64, 0.02));
    let config = IcpConfig { rejector: Rejector::Trimmed { keep: 0.75 }, ..IcpConfig::default() };
    let report = run(&config, &points, &tool, RECORD).unwrap();
    let trimmed = |range: std::ops::Range<usize>| report.fits[range].iter().filter(|f| f.fate == Fate::Trimmed).count();
    assert_eq!((trimmed(0..80), trimmed(0..400)), (80, 100));
    let off = |report: &AlignReport| {
        let p = report.grasp_from_object;
        (p.y_m - truth.y_m).hypot(p.z_m - truth.z_m) + 0.02 * angle_error(p.theta_rad, truth.theta_rad)
    };
    let squared = IcpConfig { rejector: Rejector::None, ..config };
    let pulled = off(&run(&squared, &points, &tool, Ask::default()).unwrap());
    assert!(off(&report) < 2e-3 && pulled > 2.0 * off(&report), "{} m, with the blob {pulled} m", off(&report));
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let tool = ToolModel::new(cross()).unwrap();
    let points = on_both_sides(&cross_contacts(100, PlanarPose::default(), 1e-4, 3));
    let base = IcpConfig::point_to_plane;
    for (what, config) in [
        ("kernels", IcpConfig { kernels: Vec::new(), ..base() }),
        ("kernels", IcpConfig { kernels: vec![Kernel::Huber { width_m: f64::NAN }], ..base() }),
        ("rejector", IcpConfig { rejector: Rejector::MaxDistance { distance_m: -1.0 }, ..base() }),
        ("rejector", IcpConfig { rejector: Rejector::Trimmed { keep: 0.0 }, ..base() }),
        ("solver", IcpConfig { solver: Solver::ClosedForm, ..base() }),
        ("dof", IcpConfig { target: Target::Silhouette, ..base() }),
        ("residual", IcpConfig { target: Target::Silhouette, ..IcpConfig::planar_gicp() }),
        ("anchor", IcpConfig { anchor: f64::INFINITY, ..base() }),
        ("points", IcpConfig { points: 3, ..base() }),
        ("max_iterations", IcpConfig { max_iterations: 0, ..base() }),
        ("step_m", IcpConfig { step_m: 0.0, ..base() }),
        ("starts", IcpConfig { starts: Vec::new(), ..base() }),
    ] {
        assert_eq!(run(&config, &points, &tool, Ask::default()), Err(AlignError::Config { what }), "{config:?}");
    }
}

/// Square bars along the axes have thousands of points with one coordinate in common.
#[test]
fn an_axis_aligned_bar_is_no_trouble() {
    let tool = ToolModel::new(cuboid(DVec3::ZERO, DVec3::new(0.003, 0.003, 0.03))).unwrap();
    let points = on_both_sides(&filled(&[DVec2::new(0.003, 0.03)], 0.0, 500, PlanarPose::default(), 0.0, 1));
    for (name, registration) in all() {
        let report = run(&*registration, &points, &tool, Ask::default()).unwrap();
        assert!(report.grasp_from_object.theta_rad.to_degrees().abs() < 5.0, "{name}: {:?}", report.grasp_from_object);
    }
}

/// The cross with every side cut into thin strips from end to end: many triangles, whose boxes all overlap.
fn in_strips(mesh: &TriMesh, strips: usize) -> TriMesh {
    let mut out = TriMesh::default();
    for pair in mesh.triangles.chunks(2) {
        // Two triangles of a side: a, b, c and a, c, d.
        let [a, b, c] = pair[0].map(|v| mesh.vertices[v as usize]);
        let d = mesh.vertices[pair[1][2] as usize];
        // The cuts run along the longer way.
        let [a, b, c, d] = if a.distance(b) > a.distance(d) { [b, c, d, a] } else { [a, b, c, d] };
        for i in 0..strips {
            let at = |from: DVec3, to: DVec3, i: usize| from.lerp(to, i as f64 / strips as f64);
            let [p, q, r, s] = [at(a, b, i), at(a, b, i + 1), at(d, c, i + 1), at(d, c, i)];
            let first = out.vertices.len() as u32;
            out.vertices.extend([p, q, r, s]);
            out.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    out
}

/// 60,000 triangles of which a search looks at nearly all: points stand for them, and the answer is that of a well-made
/// mesh.
#[test]
fn thin_strips_are_matched_by_points_that_stand_for_them() {
    let plain = ToolModel::new(cross()).unwrap();
    assert!(instead_of_triangles(&plain).is_none());
    let strips = ToolModel::new(in_strips(&cross(), 2500)).unwrap();
    assert_eq!(strips.mesh.triangles.len(), 60_000);
    assert!(instead_of_triangles(&strips).is_some());
    let truth = PlanarPose { theta_rad: 0.21, y_m: 0.002, z_m: -0.003 };
    let points = on_both_sides(&cross_contacts(800, truth, 2e-4, 1));
    let pose = |tool| run(&RefineConfig::default(), &points, tool, Ask::default()).unwrap();
    let (exact, bounded) = (pose(&plain), pose(&strips));
    let (a, b) = (exact.grasp_from_object, bounded.grasp_from_object);
    assert!(angle_error(a.theta_rad, b.theta_rad).to_degrees().abs() < 0.05, "{a:?} {b:?}");
    assert!((a.y_m - b.y_m).hypot(a.z_m - b.z_m) < 5e-5, "{a:?} {b:?}");
}

/// Many triangles alone are no reason: a finely divided mesh is searched as it is.
#[test]
fn a_fine_mesh_is_matched_triangle_by_triangle() {
    let mut fine = cross();
    for _ in 0..5 {
        let mut next = TriMesh { vertices: fine.vertices.clone(), triangles: Vec::new() };
        for t in &fine.triangles {
            let [a, b, c] = t.map(|v| fine.vertices[v as usize]);
            let first = next.vertices.len() as u32;
            next.vertices.extend([a.midpoint(b), b.midpoint(c), c.midpoint(a)]);
            let [ab, bc, ca] = [first, first + 1, first + 2];
            next.triangles.extend([[t[0], ab, ca], [ab, t[1], bc], [ca, bc, t[2]], [ab, bc, ca]]);
        }
        fine = next;
    }
    let tool = ToolModel::new(fine).unwrap();
    assert_eq!(tool.mesh.triangles.len(), 24 * 4usize.pow(5));
    assert!(instead_of_triangles(&tool).is_none());
}
