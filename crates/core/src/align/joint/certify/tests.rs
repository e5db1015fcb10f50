use glam::DVec2;
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::align::batch::Extent;
use crate::align::joint::cost::Patch;
use crate::align::joint::template::BandField;
use crate::align::joint::tests::Touch;
use crate::align::joint::{Basis, JointConfig};
use crate::align::search::Cost as _;
use crate::align::{AlignConfig, AlignReport, Ask, Contacts, Register, Scene};
use crate::frames::PlanarPose;
use crate::relax::Field;
use crate::tent::STEP_M;

const KERNEL_M: f64 = 0.5e-3;

/// A band with slopes like a membrane's, and as much noise as `rough`, meters.
fn band(rough: f32, rng: &mut ChaCha8Rng) -> BandField {
    let (columns, rows) = (44, 57);
    let mut field = Field::filled(columns, rows, 0.0);
    for row in 0..rows {
        for column in 0..columns {
            let (y, z) = (column as f32 * 0.31, row as f32 * 0.23);
            field.values[row * columns + column] =
                4e-4 * (y + 0.7 * z).sin() * (0.4 * z).cos() + rough * (rng.random::<f32>() - 0.5);
        }
    }
    let origin = -0.5 * STEP_M * DVec2::new(columns as f64, rows as f64);
    BandField { field, origin, pyramid: Default::default() }
}

fn cost(field: &BandField, patch: &Patch, state: State) -> f64 {
    let fingers = [(field, Patch::clone(patch))];
    Joint { fingers: &fingers, kernel_m: KERNEL_M, mask: None, lookups: 0 }.sums(state).cost * patch.len() as f64
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_pose_of_a_box_costs_less_than_its_bound(
        middle in proptest::array::uniform3(-1.0..1.0f64),
        half in proptest::array::uniform3(-4.0..0.0f64),
        inside in proptest::collection::vec(proptest::array::uniform3(-1.0..1.0f64), 24),
        rough in proptest::sample::select(vec![0.0f32, 5e-5, 4e-4]),
        // Of few places: in a sum of many, what one bound lacks another has to spare.
        count in proptest::sample::select(vec![1, 2, 5, 90]),
        seed in 0..1000u64,
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let field = band(rough, &mut rng);
        let middle = State { phi: 0.5 * middle[0], place: DVec2::new(middle[1], middle[2]) * 6e-3 };
        // Places on the band and off it, most of them where the middle fits.
        let mut places: Vec<(DVec2, f32)> = Vec::new();
        for i in 0..count {
            let place = DVec2::new(rng.random::<f64>() - 0.5, rng.random::<f64>() - 0.5) * 0.034;
            let node = (DVec2::from_angle(middle.phi).rotate(place) + middle.place - field.origin) / STEP_M;
            let fits = field.field.at(node.x, node.y) as f32 + 1e-4 * (rng.random::<f32>() - 0.5);
            places.push((place, if i % 2 == 0 { 2e-3 * (rng.random::<f32>() - 0.5) } else { fits }));
        }
        let patch = Patch::new(places.into_iter()).outermost_first();
        // Boxes of all sizes: from 4 degrees by 4 mm down to a ten-thousandth of that.
        let half = [0.07 * 10f64.powf(half[0]), 4e-3 * 10f64.powf(half[1]), 4e-3 * 10f64.powf(half[2])];
        let extent = Extent::new(half);
        let floor = field.floor(&patch, middle, KERNEL_M, extent, f64::INFINITY);
        let here = cost(&field, &patch, middle);
        prop_assert!((floor.here - here).abs() <= 1e-4 * here + 1e-9, "{} is not {here}", floor.here);
        let stopped = field.floor(&patch, middle, KERNEL_M, extent, 0.0);
        let corners = (0..8).map(|i| [0, 1, 2].map(|bit| if i >> bit & 1 == 1 { 1.0 } else { -1.0 }));
        for at in inside.into_iter().chain(corners) {
            let state = State {
                phi: middle.phi + at[0] * half[0],
                place: middle.place + DVec2::new(at[1] * half[1], at[2] * half[2]),
            };
            let cost = cost(&field, &patch, state);
            // A ten-thousandth for the sums in f32.
            let limit = cost * (1.0 + 1e-4) + 1e-6;
            prop_assert!(floor.least(extent.half) <= limit, "{} is above {cost} in {half:?}", floor.least(extent.half));
            prop_assert!(stopped.least(extent.half) <= limit, "stopped, {} is above {cost}", stopped.least(extent.half));
        }
    }
}

#[test]
fn bounds_close_in_on_the_cost_as_boxes_shrink() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let field = band(2e-5, &mut rng);
    let places = (0..160).map(|i| (DVec2::new(f64::from(i % 13) - 6.0, f64::from(i / 13) - 6.0) * 1.3e-3, 2e-4));
    let patch = Patch::new(places.collect::<Vec<_>>().into_iter()).outermost_first();
    let state = State { phi: 0.1, place: DVec2::new(1e-3, -5e-4) };
    let bound = |half_m: f64| {
        let extent = Extent::new([half_m / 0.01, half_m, half_m]);
        let floor = field.floor(&patch, state, KERNEL_M, extent, f64::INFINITY);
        floor.least(extent.half) / floor.here
    };
    let shares = [2e-3, 3e-4, 3e-5, 3e-6].map(bound);
    assert!(shares.is_sorted() && shares[1] > 0.02 && shares[2] > 0.75 && shares[3] > 0.97, "{shares:?}");
}

/// Cost of the answer on all places, square meters.
fn won(report: &AlignReport) -> f64 {
    report.runs[report.winner].cost_m2
}

#[test]
fn the_fast_answer_is_the_proved_one() {
    for (tool, seed) in [(0, 2), (3, 5), (7, 5)] {
        let touch = Touch::new(tool, seed);
        let [fast, proved] = [JointConfig::default(), JointConfig::certified()].map(|c| touch.by(&c).unwrap());
        let certificate = proved.certificate.unwrap();
        assert_eq!((proved.rung, fast.certificate, proved.joint.unwrap().basis), (Rung::Certified, None, Basis::Both));
        assert!(certificate.certified && certificate.gap() < 0.03 && certificate.points >= 200, "{certificate:?}");
        assert!(certificate.nodes > 50 && certificate.lookups < 15_000_000, "{certificate:?}");
        assert!(won(&proved) <= won(&fast) && won(&fast) <= 1.03 * won(&proved), "{} {}", won(&fast), won(&proved));
        assert!(touch.error_deg(&proved) < 2.0, "{}", touch.error_deg(&proved));
        assert_eq!(proved, touch.by(&JointConfig::certified()).unwrap(), "bit for bit");
    }
}

#[test]
fn no_pose_of_the_prior_costs_less_than_what_is_proved() {
    let touch = Touch::new(3, 4);
    let (points, images) = (touch.points(), touch.images());
    let scene = Scene::new(Contacts { points: &points, images: &images });
    let config = JointConfig::certified();
    let problem = Problem::new(&scene, &touch.tool, &config).unwrap().unwrap();
    let mut answer = problem.solve();
    let weight = answer.fit.mask_weight;
    problem.prove(&mut answer);
    let proved = answer.certificate.unwrap().lower_bound_m2 / KERNEL_M.powi(2);
    let fingers = problem.patches_of(problem.answer_band(), config.proof_points);
    let cloud = &problem.mask().unwrap()[1];
    let mask = Some(MaskPart { field: &touch.tool.field, cloud, kernel_m: config.mask_kernels_m[1], weight });
    let mut cost = Joint { fingers: &fingers, kernel_m: KERNEL_M, mask, lookups: 0 };
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let prior = config.mask.prior;
    let mut least = f64::INFINITY;
    for i in 0..4000 {
        // Half of them near the answer.
        let mut within = || rng.random::<f64>() * 2.0 - 1.0;
        let [turn, y, z] = [within(), within(), within()];
        let state = if i % 2 == 0 {
            let pose = PlanarPose { theta_rad: turn * prior.theta_rad, y_m: y * prior.shift_m, z_m: z * prior.shift_m };
            State::from_pose(pose, problem.centroid())
        } else {
            answer.end().moved([turn, y, z].map(|step| step * 3e-4))
        };
        least = least.min(cost.sums(state).cost);
    }
    assert!(proved <= least * (1.0 + 1e-4) && proved > 0.8 * least, "{proved} {least}");
}

#[test]
fn a_small_budget_is_admitted() {
    let touch = Touch::new(7, 5);
    let mask = AlignConfig { budget: 30_000, ..AlignConfig::certified() };
    let report = touch.by(&JointConfig { mask, ..JointConfig::certified() }).unwrap();
    let certificate = report.certificate.unwrap();
    assert!(!certificate.certified && certificate.lookups < 60_000, "{certificate:?}");
    let proved = touch.by(&JointConfig::certified()).unwrap().certificate.unwrap();
    assert!(certificate.lower_bound_m2 <= proved.cost_m2 && certificate.lower_bound_m2 < proved.lower_bound_m2);
    let fast = touch.by(&JointConfig::default()).unwrap();
    assert_eq!(report.grasp_from_object, fast.grasp_from_object, "what the starts found stays the answer");
}

#[test]
fn the_proof_finds_what_the_starts_miss() {
    let touch = Touch::new(3, 4);
    // One start at the prior's edge, and descents that see no farther than a fraction of a millimeter.
    let starts = vec![PlanarPose { theta_rad: -0.38 * touch.truth.theta_rad.signum(), y_m: 5e-3, z_m: -5e-3 }];
    let blind = JointConfig {
        starts,
        kernels_m: [0.5e-3; 4],
        max_iterations: 3,
        doubtful: -1.0,
        explained: -1.0,
        ..JointConfig::default()
    };
    let missed = touch.by(&blind).unwrap();
    let found = touch.by(&JointConfig { prove: true, ..blind }).unwrap();
    assert!(touch.error_deg(&missed) > 2.0, "{}", touch.error_deg(&missed));
    assert!(touch.error_deg(&found) < 1.0, "{}", touch.error_deg(&found));
    assert!(found.certificate.unwrap().certified && won(&found) < won(&missed) && found.winner == 1);
}

#[test]
fn where_the_mask_alone_answers_its_answer_is_the_proved_one() {
    let touch = Touch::new(0, 3);
    let contacts = Contacts { points: &touch.points(), images: &[] };
    let by = |method: &dyn Register| method.run(&Scene::new(contacts), &touch.tool, Ask::default()).unwrap();
    let found = by(&JointConfig::certified());
    assert_eq!((found.joint.unwrap().basis, found.certificate.unwrap().certified), (Basis::NoImage, true));
    assert_eq!(AlignReport { joint: None, ..found }, by(&AlignConfig::certified()));
}
