//! Registration by membrane and mask under spoilt images: what it bears, and where the mask answers in its place.

use glam::DVec3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use touch2touch_bench::known::Case;
use touch2touch_core::align::{AlignReport, Basis, Contacts, PadImage};
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::pose::{Registration, register};
use touch2touch_core::rig::{PadId, lab};
use touch2touch_core::units::angle_error;

use super::{case, lifted, suite};

/// The pose of contact points by the joint registration, with the case's cameras and other imprints than its own.
fn registered(points: &[DVec3], imprints: &[DepthMap; 2], predicted: bool) -> AlignReport {
    let (case, model) = case();
    let image = |f: usize| PadImage { predicted, ..PadImage::measured(&imprints[f], &case.cameras[f]) };
    register(Contacts { points, images: &[image(0), image(1)] }, model, Registration::default(), false).unwrap()
}

fn points(imprints: &[DepthMap; 2], masks: &[Mask; 2]) -> Vec<DVec3> {
    lifted(case().0, imprints, masks).map(|pad| pad.points).concat()
}

fn joint(imprints: &[DepthMap; 2], masks: &[Mask; 2]) -> AlignReport {
    registered(&points(imprints, masks), imprints, false)
}

/// Imprints of which each pixel is changed.
fn changed(case: &Case, mut change: impl FnMut(f32, f32) -> f32) -> [DepthMap; 2] {
    [0, 1].map(|f| {
        let (from, reference) = (&case.imprints[f], &case.cameras[f].depth_reference);
        DepthMap::from_fn(from.width(), from.height(), |x, y| change(from[(x, y)], reference[(x, y)]))
    })
}

fn error_deg(report: &AlignReport) -> f64 {
    angle_error(report.grasp_from_object.theta_rad, case().0.grasp_from_object.theta_rad).to_degrees()
}

#[test]
fn m01_any_share_of_missing_pixels_is_borne() {
    let (case, _) = case();
    for percent in [0, 10, 50, 90] {
        for absent in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut rng = ChaCha8Rng::seed_from_u64(percent);
            let imprints = changed(case, |v, _| if rng.random_range(0..100) < percent { absent } else { v });
            let report = joint(&imprints, &case.masks);
            assert!(report.joint.unwrap().basis.has_membrane(), "{percent} % {absent}");
            assert!(error_deg(&report) < 3.0, "{percent} % {absent}: {}", error_deg(&report));
        }
    }
}

#[test]
fn m02_an_offset_or_a_gain_of_the_depth_costs_little() {
    let (case, _) = case();
    for (gain, offset_m) in [(1.0, 5e-4), (1.0, -5e-4), (1.03, 0.0), (0.97, 0.0)] {
        let imprints = changed(case, |v, reference| reference - (reference - v) * gain + offset_m);
        let error = error_deg(&joint(&imprints, &case.masks));
        assert!(error < 2.5, "gain {gain}, offset {offset_m} m: {error} deg");
    }
}

#[test]
fn m05_any_number_of_threads_gives_the_same_bits() {
    let (case, _) = case();
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let answers = pool.install(|| {
            use rayon::prelude::*;
            (0..8).into_par_iter().map(|_| joint(&case.imprints, &case.masks).grasp_from_object).collect::<Vec<_>>()
        });
        assert!(answers.iter().all(|answer| *answer == answers[0]));
        answers[0]
    };
    assert_eq!(by(1), by(4));
}

#[test]
fn m06_a_prediction_that_is_no_membrane_of_the_tool_is_left_to_the_mask() {
    let (case, model) = case();
    let points = points(&case.imprints, &case.masks);
    let by_mask = register(&points, model, Registration::DistanceField(None), false).unwrap().grasp_from_object;
    let basis = |imprints: &[DepthMap; 2]| {
        let report = registered(&points, imprints, true);
        (report.joint.unwrap().basis, report.grasp_from_object)
    };
    // A perfect prediction: the imprint before the camera's noise.
    let (sample, _) = suite().felt(3);
    let imprint = |f: PadId| sample.pad(f).unwrap().depth().unwrap().truth.as_ref().unwrap().imprint.clone();
    let perfect = lab::PADS.map(imprint);
    assert_eq!(basis(&perfect).0, Basis::Both);
    // As if pressed on half again as hard as the bubble was.
    let harder = perfect.map(|imprint| imprint.map(|v| 1.5 * v));
    assert_eq!(basis(&harder), (Basis::Unlike, by_mask));
}
