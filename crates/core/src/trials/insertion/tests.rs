use proptest::prelude::*;

use super::*;
use crate::catalog::{pencil, tools};

fn bar(width: f64, length: f64) -> Outline {
    let h = 0.5 * width;
    let corners = [(-h, -0.03), (h, -0.03), (h, length - 0.03), (-h, length - 0.03)];
    Outline::polygon(&corners.map(|(y, z)| DVec2::new(y, z))).unwrap()
}

fn shape(depth_m: f64, clearance_m: f64) -> HoleShape {
    HoleShape { depth_m, clearance_m, chamfer_m: 0.0 }
}

/// A tool that is tilted and shifted, believed to be straight.
fn off(theta_rad: f64, y_m: f64) -> InHand {
    InHand { truth: PlanarPose { theta_rad, y_m, z_m: 0.0 }, estimate: PlanarPose::default() }
}

fn insertion(outline: &Outline, shape: HoleShape, turn_deg: f64, shift_m: f64) -> Insertion {
    let compliance = Compliance { turn_rad: turn_deg.to_radians(), shift_m };
    Insertion::new(outline.clone(), shape, compliance).unwrap()
}

/// The width that a bar of `width`, tilted by `t` with its lower corner `depth` deep, takes up below the mouth.
fn taken(width: f64, depth: f64, t: f64) -> f64 {
    if depth >= width * t.sin() { width * t.cos() + depth * t.tan() } else { depth * (t.tan() + 1.0 / t.tan()) }
}

proptest! {
    #[test]
    fn a_bar_passes_its_slot_just_where_the_closed_form_says(
        width in 0.002f64..0.02, depth in 0.002f64..0.03, t in 0.001f64..0.17, sign in prop::bool::ANY,
    ) {
        let outline = bar(width, 0.08);
        let needs = 0.5 * (taken(width, depth, t) - width);
        let tilt = if sign { t } else { -t };
        // Shifted freely, so that only the width counts.
        for (clearance, passes) in [(needs + 2e-6, true), (needs - 2e-6, false)] {
            if clearance >= 0.0 {
                let free = insertion(&outline, shape(depth, clearance), 0.0, 0.5);
                prop_assert_eq!(free.passes(off(tilt, 0.0)).unwrap(), passes, "{} {}", needs, clearance);
            }
        }
        // A turn of the gripper takes as much off the tilt.
        let give = 0.3 * t;
        let needs = 0.5 * (taken(width, depth, t - give) - width);
        if needs > 1e-5 && depth > 1.1 * width * t.sin() && width * (t - give).sin() < depth * (t - give).cos() {
            let clearance = needs + 5e-6;
            let soft = insertion(&outline, shape(depth, clearance), give.to_degrees(), 0.5);
            prop_assert!(soft.passes(off(tilt, 0.0)).unwrap());
        }
    }

    #[test]
    fn a_shift_passes_up_to_clearance_and_compliance(
        width in 0.002f64..0.02, clearance in 0.0f64..0.005, give in 0.0f64..0.003, sign in prop::bool::ANY,
    ) {
        let trial = insertion(&bar(width, 0.08), shape(0.01, clearance), 0.0, give);
        let at = |y: f64| trial.passes(off(0.0, if sign { y } else { -y })).unwrap();
        prop_assert!(at(clearance + give - 1e-6));
        prop_assert!(!at(clearance + give + 1e-6));
    }
}

/// A tool of the catalog, or the pencil.
fn outline(number: usize) -> Outline {
    let spec = tools().get(number).cloned().unwrap_or_else(pencil);
    Outline::of_mesh(&spec.mesh()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn more_room_and_more_give_never_hinder(
        number in 0usize..13, theta in -0.15f64..0.15, y in -0.003f64..0.003,
        clearance in 0.0f64..0.003, more in 0.0f64..0.003, turn in 0.0f64..4.0, shift in 0.0f64..0.002,
    ) {
        let (tool, grasp) = (outline(number), off(theta, y));
        let passes = |clearance: f64, turn: f64, shift: f64, chamfer_m: f64| {
            let shape = HoleShape { chamfer_m, ..shape(0.01, clearance) };
            insertion(&tool, shape, turn, shift).passes(grasp).unwrap()
        };
        if passes(clearance, turn, shift, 0.0) {
            prop_assert!(passes(clearance + more, turn, shift, 0.0));
            prop_assert!(passes(clearance, turn + 1.0, shift, 0.0));
            prop_assert!(passes(clearance, turn, shift + more, 0.0));
            prop_assert!(passes(clearance, turn, shift, 0.002));
        }
    }

    #[test]
    fn a_perfect_pose_passes_and_thirty_degrees_jam(
        number in 0usize..13, theta in -0.4f64..0.4, y in -0.005f64..0.005, z in -0.005f64..0.005, sign in prop::bool::ANY,
    ) {
        let trial = insertion(&outline(number), shape(0.01, 0.001), 2.0, 0.001);
        let truth = PlanarPose { theta_rad: theta, y_m: y, z_m: z };
        let perfect = trial.attempt(InHand { truth, estimate: truth }).unwrap();
        prop_assert!(perfect.end.is_success() && perfect.contact.is_none(), "{:?}", perfect.end);
        prop_assert!(perfect.offset_m.abs() < 1e-12 && perfect.tilt_rad == 0.0);
        let wrong = 30f64.to_radians() * if sign { 1.0 } else { -1.0 };
        let estimate = PlanarPose { theta_rad: theta - wrong, ..truth };
        let jammed = trial.attempt(InHand { truth, estimate }).unwrap();
        prop_assert!(!jammed.end.is_success(), "{number} {:?}", jammed.end);
        let askew = matches!(jammed.end, End::Askew { .. });
        prop_assert!(jammed.contact.is_some() || askew);
    }

    #[test]
    fn an_attempt_tells_one_story(number in 0usize..13, theta in -0.12f64..0.12, y in -0.002f64..0.002) {
        let trial = insertion(&outline(number), shape(0.01, 0.001), 2.0, 0.001);
        let grasp = off(theta, y);
        let attempt = trial.attempt(grasp).unwrap();
        prop_assert_eq!(attempt.end.is_success(), trial.passes(grasp).unwrap());
        let (first, last) = (attempt.path[0], attempt.path[attempt.path.len() - 1]);
        prop_assert_eq!((first.phase, last.phase), (Phase::Approach, Phase::End));
        prop_assert!(!attempt.end.is_success() || last.world_from_object.theta_rad.abs() < UPRIGHT_RAD + 1e-9);
        prop_assert!(attempt.path.windows(2).all(|w| w[0].depth_m <= w[1].depth_m));
        let depth_m = match attempt.end {
            End::Through { depth_m } | End::Jammed { depth_m } | End::Askew { depth_m } => depth_m,
            End::Stands { .. } | End::Falls { .. } => f64::NAN,
        };
        prop_assert!((last.depth_m - depth_m).abs() < 1e-9 && (0.0..=0.01).contains(&depth_m));
        for at in &attempt.path {
            // The gripper gives way no farther than it can, and the tool stays in the hand.
            let turn = at.world_from_grasp.theta_rad - first.world_from_grasp.theta_rad;
            let shift = at.world_from_grasp.y_m - first.world_from_grasp.y_m;
            prop_assert!(turn.abs() <= 2f64.to_radians() + 1e-9 && shift.abs() <= 0.001 + 2e-9, "{turn} {shift}");
            let held = at.world_from_grasp.compose(grasp.truth);
            prop_assert!((held.y_m - at.world_from_object.y_m).abs() < 1e-12);
            // The lowest point lies as deep as it says, and free of the plates.
            let body: Vec<Segment> =
                trial.outline.segments().iter().map(|s| s.map(|p| at.world_from_object.transform_yz(p))).collect();
            let lowest = body.iter().flatten().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
            prop_assert!((lowest - at.depth_m).abs() < 1e-12);
            // What lies on a plate touches it, which is no overlap.
            let above: Vec<Segment> = body.iter().map(|s| s.map(|p| p - DVec2::new(0.0, 2e-9))).collect();
            let overlap = trial.hole.overlap(&above).map_or(0.0, |(_, amount)| amount);
            prop_assert!(overlap < 1e-8, "{:?} {overlap}", at.phase);
        }
        if let Some(contact) = attempt.contact {
            prop_assert!(contact.interference_m > 0.0 && contact.depth_m <= depth_m + 1e-12);
            prop_assert!(contact.point_m.is_finite() && contact.point_m.z <= 0.0101);
        }
    }
}

#[test]
fn what_is_no_pose_or_no_compliance_is_refused() {
    let outline = bar(0.004, 0.06);
    let trial = insertion(&outline, shape(0.01, 0.001), 2.0, 0.001);
    for bad in [off(f64::NAN, 0.0), off(0.0, f64::INFINITY)] {
        assert!(trial.passes(bad).unwrap_err().to_string().contains("pose in the hand"));
        assert!(trial.attempt(bad).is_err());
    }
    let give = Compliance { turn_rad: f64::NAN, shift_m: 0.0 };
    assert!(Insertion::new(outline, shape(0.01, 0.001), give).is_err());
}

#[test]
fn a_chamfer_lets_in_what_only_the_edge_of_the_mouth_kept_out() {
    // A bar tilted by 6°: the widest it gets is at the mouth, where the bevel gives way.
    let outline = bar(0.004, 0.06);
    let grasp = off(6f64.to_radians(), 0.0);
    let tight = 0.5 * (taken(0.004, 0.01, 6f64.to_radians()) - 0.004) - 1e-4;
    let at = |chamfer_m: f64| {
        insertion(&outline, HoleShape { chamfer_m, ..shape(0.01, tight) }, 0.0, 0.02).passes(grasp).unwrap()
    };
    assert_eq!((at(0.0), at(0.003)), (false, true));
}

#[test]
fn a_triangle_that_goes_in_corner_first_is_askew() {
    let corners = [[-12.0, 6.0], [1.0, -12.0], [9.0, 10.0]].map(|[y, z]| DVec2::new(y, z) * 1e-3);
    let triangle = Outline::polygon(&corners).unwrap();
    let trial = insertion(&triangle, shape(0.01, 0.001), 2.0, 0.001);
    let attempt = trial.attempt(off(30f64.to_radians(), 0.0)).unwrap();
    assert_eq!(attempt.end, End::Askew { depth_m: 0.01 });
    assert!(!trial.passes(off(30f64.to_radians(), 0.0)).unwrap());
}
