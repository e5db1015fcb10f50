//! Numerical stability of registration: each failure that is known from other libraries, with the result to expect.
//!
//! The numbers are those of the list of failures that the product is held to (E1 to E12).

mod chain;
mod membrane;

use std::sync::LazyLock;
use std::time::Duration;

use glam::{DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use strum::IntoEnumIterator as _;
use touch2touch_bench::known::{Case, Suite};
use touch2touch_core::align::{AlignConfig, AlignError, AlignReport, LabModel, align, lab_icp};
use touch2touch_core::cloud::{Lifted, lift};
use touch2touch_core::field::{DistanceField, FieldError};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::pose::{Registration, register};
use touch2touch_core::tool::{ToolError, ToolModel};
use touch2touch_core::units::{angle_error, scale_to_meters};

/// A box with the given half sizes about `center`, closed, facing outwards.
fn cuboid(center: DVec3, half: DVec3) -> TriMesh {
    let sign = |i: usize, bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let vertices = (0..8).map(|i| center + half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    TriMesh { vertices, triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect() }
}

fn joined(parts: &[TriMesh]) -> TriMesh {
    let mut mesh = TriMesh::default();
    for part in parts {
        let shift = mesh.vertices.len() as u32;
        mesh.vertices.extend(&part.vertices);
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + shift)));
    }
    mesh
}

/// Two legs at a right angle, 40 and 25 mm long, 5 mm wide, axis-aligned.
fn angle_mesh() -> TriMesh {
    joined(&[
        cuboid(DVec3::new(0.0, 0.0, 0.02), DVec3::new(0.003, 0.0025, 0.02)),
        cuboid(DVec3::new(0.0, 0.0125, 0.0), DVec3::new(0.003, 0.0125, 0.0025)),
    ])
}

fn tool(mesh: TriMesh) -> ToolModel {
    ToolModel::new(mesh).unwrap()
}

/// Points of the surface at the pose, with noise, grasp frame.
fn contacts(mesh: &TriMesh, count: usize, pose: PlanarPose, noise_m: f64, seed: u64) -> Vec<DVec3> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = || noise_m * (rng.random::<f64>() + rng.random::<f64>() - 1.0) * 2.4;
    let points = mesh.sample_surface(count, seed);
    points.iter().map(|p| pose.to_affine().transform_point3(*p) + DVec3::new(noise(), noise(), noise())).collect()
}

fn yz(points: &[DVec3]) -> Vec<DVec2> {
    points.iter().map(|p| DVec2::new(p.y, p.z)).collect()
}

fn pose(degrees: f64, y_mm: f64, z_mm: f64) -> PlanarPose {
    PlanarPose { theta_rad: degrees.to_radians(), y_m: 1e-3 * y_mm, z_m: 1e-3 * z_mm }
}

fn suite() -> Suite {
    Suite::new(10, 5)
}

/// One simulated grasp for the rows about depth images.
fn case() -> (&'static Case, &'static ToolModel) {
    static CASE: LazyLock<(Case, ToolModel)> = LazyLock::new(|| {
        let case = suite().case(3);
        let model = tool(suite().tools()[case.tool].mesh());
        (case, model)
    });
    (&CASE.0, &CASE.1)
}

fn lifted(case: &Case, imprints: &[DepthMap; 2], masks: &[Mask; 2]) -> [Lifted; 2] {
    [0, 1].map(|f| lift(&imprints[f], &case.cameras[f], Some(&masks[f])).unwrap())
}

fn solve(
    case: &Case,
    imprints: &[DepthMap; 2],
    masks: &[Mask; 2],
    engine: Registration,
) -> Result<AlignReport, AlignError> {
    let points = lifted(case, imprints, masks).map(|pad| pad.points).concat();
    register(&points, self::case().1, engine, false)
}

#[test]
fn e03_coincident_points_and_too_few_have_no_pose() {
    let model = tool(angle_mesh());
    let same = vec![DVec3::new(0.0, 0.001, 0.002); 50];
    for engine in Registration::iter() {
        let result = register(&same, &model, engine, false);
        assert!(matches!(result, Err(AlignError::Coincident { .. })), "{engine}: {result:?}");
        for few in 0..3 {
            let result = register(&contacts(&model.mesh, few, pose(0.0, 0.0, 0.0), 0.0, 1), &model, engine, false);
            assert!(matches!(result, Err(AlignError::TooFewPoints { got, .. }) if got == few), "{engine}: {result:?}");
        }
    }
}

/// Offsets in the plane up to a thousand kilometers.
const OFFSETS: [DVec2; 6] = [
    DVec2::ZERO,
    DVec2::new(1.0, -2.0),
    DVec2::new(-60.0, 80.0),
    DVec2::new(6e3, 8e3),
    DVec2::new(-8e4, 6e4),
    DVec2::new(6e5, -8e5),
];

#[test]
fn e04_a_large_offset_does_not_cost_the_angle() {
    let model = tool(angle_mesh());
    let truth = pose(11.0, 1.0, -2.0);
    let scene = contacts(&model.mesh, 800, truth, 1e-4, 3);
    let near = |start: PlanarPose| AlignConfig { starts: vec![start], ..AlignConfig::default() };
    let reference = align(&yz(&scene), &model.field, &near(pose(5.0, 0.0, 0.0))).unwrap().grasp_from_object;
    let lab = |offset: DVec2, scene: &[DVec3]| {
        let start = PlanarPose { y_m: offset.x, z_m: offset.y, ..pose(0.0, 0.0, 0.0) };
        lab_icp(scene, &LabModel::of(&model), &[start], false).unwrap().grasp_from_object
    };
    let lab_reference = lab(DVec2::ZERO, &scene);
    for offset in OFFSETS {
        let moved_in_space: Vec<DVec3> = scene.iter().map(|p| *p + DVec3::new(0.0, offset.x, offset.y)).collect();
        let moved = yz(&moved_in_space);
        let start = PlanarPose { y_m: offset.x, z_m: offset.y, ..pose(5.0, 0.0, 0.0) };
        let found = align(&moved, &model.field, &near(start)).unwrap().grasp_from_object;
        let error = angle_error(found.theta_rad, reference.theta_rad).to_degrees();
        assert!(error <= 1e-4, "distance field at {offset}: {error} deg");
        let error = angle_error(lab(offset, &moved_in_space).theta_rad, lab_reference.theta_rad).to_degrees();
        assert!(error <= 1e-4, "lab ICP at {offset}: {error} deg");
    }
    // Farther out the numbers themselves no longer hold millimeters: an error, not an answer.
    let far: Vec<DVec2> = yz(&scene).iter().map(|p| *p + DVec2::splat(1e9)).collect();
    assert!(matches!(align(&far, &model.field, &AlignConfig::default()), Err(AlignError::TooFewPoints { got: 0, .. })));
}

#[test]
fn e05_the_scale_does_not_change_the_angle_or_is_an_error() {
    let truth = pose(-7.0, 1.0, 0.5);
    let mesh = angle_mesh();
    let scene = contacts(&mesh, 600, truth, 1e-4, 4);
    let surface = mesh.sample_surface(3000, 9);
    let identity = [PlanarPose::default()];
    let reference = lab_icp(&scene, &LabModel::new(&surface), &identity, false).unwrap();
    for power in -6..=6 {
        let scale = 10f64.powi(power);
        // The lab's loop has no unit, except that contacts within a millimeter are one spot.
        let scaled = |v: &[DVec3]| v.iter().map(|p| *p * scale).collect::<Vec<_>>();
        match lab_icp(&scaled(&scene), &LabModel::new(&scaled(&surface)), &identity, false) {
            Ok(report) => {
                let error = angle_error(report.grasp_from_object.theta_rad, reference.grasp_from_object.theta_rad);
                assert!(error.to_degrees() < 1e-3, "scale {scale}: {} deg", error.to_degrees());
                assert_eq!(report.iterations, reference.iterations, "scale {scale}");
            }
            Err(AlignError::Coincident { extent_m }) => assert!(scale < 0.1 && extent_m < 1e-3, "scale {scale}"),
            Err(other) => panic!("scale {scale}: {other}"),
        }

        // The robust kernels are in millimeters: another unit is refused, with the factor that repairs it.
        match ToolModel::new(scaled_mesh(&mesh, scale)).map(|_| ()) {
            // A tool of 4 mm or 40 cm is unusual, not impossible.
            Ok(()) => assert!((0.1..=10.0).contains(&scale), "scale {scale}"),
            Err(ToolError::Field(FieldError::Units { size, scale: Some(offered) })) => {
                assert_eq!(scale_to_meters(size), Some(offered));
                assert!((0.004..=0.4).contains(&(size * offered)), "scale {scale}: offered {offered}");
            }
            Err(ToolError::Field(FieldError::Units { scale: None, .. })) => {}
            Err(other) => panic!("scale {scale}: {other}"),
        }
    }
}

fn scaled_mesh(mesh: &TriMesh, scale: f64) -> TriMesh {
    TriMesh { vertices: mesh.vertices.iter().map(|v| *v * scale).collect(), triangles: mesh.triangles.clone() }
}

#[test]
fn e06_a_tool_in_another_unit_is_refused_and_after_the_offer_the_same() {
    let meters = angle_mesh();
    let truth = pose(9.0, -1.0, 2.0);
    let scene = contacts(&meters, 600, truth, 1e-4, 5);
    let reference: Vec<AlignReport> =
        Registration::iter().map(|e| register(&scene, &tool(meters.clone()), e, false).unwrap()).collect();
    for unit in [1e-2, 1e-3] {
        let stored = scaled_mesh(&meters, 1.0 / unit);
        let model = match ToolModel::new(stored.clone()).map(|_| ()) {
            // 4 cm read as meters.
            Err(ToolError::Field(FieldError::Units { scale: Some(offered), .. })) => {
                // More than one unit may make a tool of a plausible size; the right one always does.
                assert!(scale_to_meters(4.0) == Some(offered) || unit == 1e-3, "{offered}");
                tool(scaled_mesh(&stored, unit))
            }
            other => panic!("{unit}: {other:?}"),
        };
        for (engine, reference) in Registration::iter().zip(&reference) {
            let report = register(&scene, &model, engine, false).unwrap();
            let (a, b) = (report.grasp_from_object, reference.grasp_from_object);
            assert!(angle_error(a.theta_rad, b.theta_rad) < 1e-6, "{engine} {unit}");
            assert!((a.y_m - b.y_m).hypot(a.z_m - b.z_m) < 1e-8, "{engine} {unit}");
        }
    }
    let config = AlignConfig::default();
    let model = tool(meters);
    assert!(matches!(align(&yz(&scene)[..31], &model.field, &config), Err(AlignError::TooFewPoints { got: 31, .. })));
    let spot: Vec<DVec2> = yz(&scene).iter().map(|p| *p * 0.01).collect();
    assert!(matches!(align(&spot, &model.field, &config), Err(AlignError::Coincident { .. })), "below four cells");
}

#[test]
fn e07_what_is_not_observable_is_flagged_and_stays_where_it_was() {
    let model = tool(cuboid(DVec3::ZERO, DVec3::new(0.0025, 0.0025, 0.03)));
    for seed in 0..12u64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let degrees = rng.random_range(-20.0..20.0);
        let truth = pose(degrees, rng.random_range(-3.0..3.0), 0.0);
        // The middle of the rod only: neither end is seen.
        let scene: Vec<DVec2> = (0..600)
            .map(|_| {
                let p = DVec2::new(rng.random_range(-0.0025..0.0025), rng.random_range(-0.02..0.02));
                let noise = DVec2::new(rng.random_range(-4.5e-4..4.5e-4), rng.random_range(-4.5e-4..4.5e-4));
                truth.transform_yz(p) + noise
            })
            .collect();
        let along = DVec2::from_angle(truth.theta_rad).rotate(DVec2::Y);
        let center = scene.iter().sum::<DVec2>() / scene.len() as f64;
        let aimed = AlignConfig { starts: vec![pose(degrees, 0.0, 0.0)], ..AlignConfig::default() };
        for (config, straight_on) in [(AlignConfig::default(), false), (aimed, true)] {
            let report = align(&scene, &model.field, &config).unwrap();
            let found = report.grasp_from_object;
            assert!(found.is_finite());
            let error = angle_error(found.theta_rad, truth.theta_rad).to_degrees();
            assert!(error < 1.0, "seed {seed}: {error} deg");
            let o = report.observability.unwrap();
            assert!(o.degenerate && report.is_degenerate(), "seed {seed}: {o:?}");
            let weak = DVec2::new(o.weakest[1], o.weakest[2]);
            let off = weak.normalize().perp_dot(along).abs().asin().to_degrees();
            assert!(weak.length() > 0.9 && off < 5.0, "seed {seed}: {weak} is {off} deg off the rod");
            // Along the rod nothing is known, so nothing may change: the spot of the rod that lies under the middle of
            // the contacts is the one that lay there at the start. (The turn about that middle moves the rod's origin.)
            let spot = |p: PlanarPose| p.inverse().transform_yz(center).y;
            let slide = spot(found) - spot(report.start);
            assert!(slide.abs() < 1e-4, "seed {seed}: slid by {} mm", 1e3 * slide);
            if straight_on {
                let slide = DVec2::new(found.y_m, found.z_m).dot(along);
                assert!(slide.abs() < 1e-4, "seed {seed}: moved by {} mm along the rod", 1e3 * slide);
            }
        }
    }
    let disc = disc_mesh(0.015, 96);
    let model = tool(disc.clone());
    for seed in 0..3 {
        let report =
            register(&contacts(&disc, 800, pose(4.0, 1.0, 2.0), 1e-4, seed), &model, Registration::default(), false);
        let report = report.unwrap();
        let o = report.observability.unwrap();
        assert!(o.degenerate && o.weakest[0].abs() > 0.95, "a disc turns freely: {o:?}");
        assert!(report.grasp_from_object.is_finite());
    }
}

fn disc_mesh(radius: f64, sides: u32) -> TriMesh {
    let mut mesh = TriMesh { vertices: vec![-DVec3::X * 0.003, DVec3::X * 0.003], triangles: vec![] };
    for i in 0..sides {
        let p = DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / f64::from(sides)) * radius;
        mesh.vertices.extend([DVec3::new(-0.003, p.x, p.y), DVec3::new(0.003, p.x, p.y)]);
        let (a, b) = (2 + 2 * i, 2 + 2 * ((i + 1) % sides));
        mesh.triangles.extend([[0, b, a], [1, a + 1, b + 1], [a, b, a + 1], [b, b + 1, a + 1]]);
    }
    mesh
}

#[test]
fn e08_disjoint_clouds_do_not_match() {
    let model = tool(angle_mesh());
    for away in [0.1, 1.0, 1000.0] {
        let scene = contacts(&model.mesh, 400, pose(0.0, 1e3 * away, 1e3 * away), 1e-4, 1);
        for engine in Registration::iter() {
            match register(&scene, &model, engine, false) {
                Err(AlignError::NoOverlap { share }) => assert!(share < 0.05, "{engine} at {away} m: {share}"),
                // The paper's loop has no limit of distance: it carries the tool over to the points, which is a match,
                // but not one that a gripper can hold, and it says so. It must not be an empty match with error 0.
                Ok(report) if matches!(engine, Registration::LabIcp) => {
                    assert!(!report.within_prior, "{engine} at {away} m");
                    assert!(report.inlier_share > 0.05 && report.inlier_rms_m > 0.0, "{engine} at {away} m");
                }
                other => panic!("{engine} at {away} m: {:?}", other.map(|r| r.grasp_from_object)),
            }
        }
    }
}

#[test]
fn e09_pixels_without_depth_are_dropped_and_counted() {
    let (case, _) = case();
    for percent in [0, 1, 50, 100] {
        // Spoils this share of the masked pixels, and takes the same pixels out of a second mask.
        let mut rng = ChaCha8Rng::seed_from_u64(percent);
        let (mut imprints, mut thinned) = (case.imprints.clone(), case.masks_clean.clone());
        let (mut spoilt, mut masked) = (0, 0);
        let mut valid_before = 0;
        for f in 0..2 {
            let reference = &case.cameras[f].depth_reference;
            for i in 0..imprints[f].len() {
                if !case.masks_clean[f].as_slice()[i] {
                    continue;
                }
                masked += 1;
                let depth = reference.as_slice()[i] - imprints[f].as_slice()[i];
                valid_before += usize::from(depth > 0.0);
                if rng.random_range(0..100) < percent {
                    let bad = [f32::NAN, f32::INFINITY, 0.0, -0.02][spoilt % 4];
                    imprints[f].as_mut_slice()[i] = reference.as_slice()[i] - bad;
                    thinned[f].as_mut_slice()[i] = false;
                    spoilt += 1;
                }
            }
        }
        for engine in Registration::iter() {
            let with = solve(case, &imprints, &case.masks_clean, engine);
            if percent == 100 {
                let error = with.unwrap_err();
                assert!(matches!(error, AlignError::TooFewPoints { got: 0, .. }), "{engine}: {error}");
                continue;
            }
            let with = with.unwrap();
            let without = solve(case, &case.imprints, &thinned, engine).unwrap();
            assert_eq!(with.grasp_from_object, without.grasp_from_object, "{engine} {percent} %: bit for bit");
            let pads = lifted(case, &imprints, &case.masks_clean);
            let (points, invalid) = (pads[0].points.len() + pads[1].points.len(), pads[0].invalid + pads[1].invalid);
            assert_eq!(points + invalid, masked, "{engine}: all are accounted for");
            assert!(invalid >= spoilt && points <= valid_before);
        }
    }
}

#[test]
fn e11_axis_aligned_and_equal_model_points_do_not_panic() {
    let square = cuboid(DVec3::ZERO, DVec3::new(0.004, 0.004, 0.03));
    let model = tool(square.clone());
    let scene = contacts(&square, 5000, pose(3.0, 0.5, 0.0), 0.0, 2);
    for engine in Registration::iter() {
        let report = register(&scene, &model, engine, false).unwrap();
        assert!(report.grasp_from_object.is_finite(), "{engine}");
    }
    let identity = [PlanarPose::default()];
    let equal = vec![DVec3::new(0.0, 0.001, 0.002); 5000];
    assert!(lab_icp(&scene, &LabModel::new(&equal), &identity, false).unwrap().grasp_from_object.is_finite());
    let same_y: Vec<DVec3> = (0..5000).map(|i| DVec3::new(0.0, 0.004, 1e-5 * f64::from(i))).collect();
    assert!(lab_icp(&scene, &LabModel::new(&same_y), &identity, false).unwrap().grasp_from_object.is_finite());
    assert_eq!(lab_icp(&scene, &LabModel::new(&[]), &identity, false), Err(AlignError::EmptyModel { got: 0 }));
    assert!(matches!(ToolModel::new(TriMesh::default()), Err(ToolError::Field(_))));
}

#[test]
fn e12_infinite_input_ends_within_a_second() {
    let model = std::sync::Arc::new(tool(angle_mesh()));
    let good = contacts(&model.mesh, 100, pose(2.0, 0.0, 0.0), 1e-4, 1);
    let bad = [f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1e300, -1e300, f64::MAX];
    let all_bad: Vec<DVec3> = bad.iter().cycle().take(600).map(|&v| DVec3::new(0.0, v, -v)).collect();
    let mixed: Vec<DVec3> = good.iter().chain(&all_bad).copied().collect();
    for engine in Registration::iter() {
        for (name, points, solvable) in [("all", &all_bad, false), ("some", &mixed, true)] {
            let (send, answer) = std::sync::mpsc::channel();
            let (points, model) = (points.clone(), model.clone());
            let worker = std::thread::spawn(move || send.send(register(&points, &model, engine, false)).is_ok());
            let result = answer
                .recv_timeout(Duration::from_secs(if solvable { 20 } else { 1 }))
                .unwrap_or_else(|_| panic!("{engine} with {name} points infinite does not end"));
            assert!(worker.join().unwrap());
            match result {
                Ok(report) => assert!(solvable && report.grasp_from_object.is_finite() && report.not_finite == 600),
                Err(error) => assert!(!solvable, "{engine}: {error}"),
            }
        }
    }
    let mut mesh = angle_mesh();
    mesh.vertices[3] = DVec3::new(f64::INFINITY, f64::NAN, 0.0);
    let begin = std::time::Instant::now();
    assert!(DistanceField::from_mesh(&mesh).is_ok(), "triangles that are not finite are left out");
    mesh.vertices.fill(DVec3::INFINITY);
    assert!(matches!(DistanceField::from_mesh(&mesh), Err(FieldError::Empty)));
    assert!(begin.elapsed() < Duration::from_secs(1));
    let start = PlanarPose { theta_rad: f64::INFINITY, ..PlanarPose::default() };
    let config = AlignConfig { starts: vec![start], ..AlignConfig::default() };
    assert!(matches!(align(&yz(&good), &model.field, &config), Err(AlignError::Config { .. })));
}
