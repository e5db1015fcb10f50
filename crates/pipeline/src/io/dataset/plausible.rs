//! Rules that a loaded sample must satisfy to be a touch of the lab's rig. The doctor and whoever loads a pair get the
//! same verdict, in the sample's notes.

use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};

use super::{Loaded, problem};
use touch2touch_core::dataset::Problem;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::sample::{DepthCamera, Sample};

/// No bubble is pushed in further; the released data reach 26 mm.
const MAX_IMPRINT_M: f64 = 0.08;
/// Depths at which a bubble's camera can see its membrane.
const DEPTH_RANGE_M: [f64; 2] = [0.02, 0.5];
/// Focal lengths of a camera with 224 x 171 pixels: 13 to 160 degrees of view.
const FOCAL_RANGE_PX: [f64; 2] = [20.0, 1000.0];
/// Range of a camera's principal point, as a share of the image's sides: near the middle. Numbers of an image scaled by
/// a half or by two are out of it.
const CENTER_RANGE: [f64; 2] = [0.3, 0.7];
/// Pixels are square, but for the calibration's errors.
const MAX_ASPECT: f64 = 1.25;
/// Frames that are known less well than this are worth a note: the registration is good to tenths of a millimeter.
const MAX_ROUNDING_M: f64 = 2e-5;
/// The tool lies in the grasp frame's origin: what the middle of the image sees cannot be further away.
const NEAR_GRASP_M: f64 = 0.1;
/// Angles are within 22.5 degrees in the released data; beyond a right angle they are in degrees.
const MAX_THETA_RAD: f64 = std::f64::consts::FRAC_PI_2;
/// Grasps are within 5 mm in the released data.
const MAX_OFFSET_M: f64 = 0.1;
/// Pixels by which lifting and projecting again may miss.
const ROUND_TRIP_PX: f64 = 1e-6;

/// Adds to the sample's notes what cannot be right about it; `file` has its imprints, under `key`. With its cameras or, where they
/// are assumed, without.
pub(super) fn notes(loaded: &mut Loaded, file: &Path, key: &str, with_cameras: bool) {
    let mut problems = std::mem::take(&mut loaded.sample.notes);
    for (finger, touch) in loaded.sample.pads.entries() {
        let Some(bubble) = touch.depth() else { continue };
        let invalid = loaded.invalid[finger].unwrap_or_default();
        let pixels = bubble.imprint.len();
        if invalid.are_many(pixels) {
            let share = 100.0 * invalid.total() as f64 / pixels as f64;
            let (name, nan, infinite, dropped) =
                (loaded.sample.rig.pad_key(finger), invalid.nan, invalid.infinite, invalid.dropped);
            problems.push(problem(
                file,
                format!(
                    "key \"{key}\": {share:.2} % of the {name} finger's pixels have no measurement ({nan} NaN, \
                     {infinite} infinite, {dropped} at depth 0)"
                ),
                "these pixels are left out everywhere; record the grasp again if they cover the contact",
            ));
        }
    }
    sample(&loaded.sample, file, with_cameras, &mut problems);
    loaded.sample.notes = problems;
}

/// A note if the place of a frame (`x y z` and a quaternion, as in the file) was rounded to 32 bits so far from the
/// origin that it is not known well any more. `what` names the frame.
pub(super) fn rounded_place(file: &Path, what: &str, values: &[f64]) -> Option<Problem> {
    let in_32_bits = values.iter().all(|&v| f64::from(v as f32) == v);
    let far = values.iter().take(3).fold(0f64, |far, v| far.max(v.abs()));
    let rounding = far * f64::from(f32::EPSILON) / 2.0;
    (in_32_bits && rounding > MAX_ROUNDING_M).then(|| {
        problem(
            file,
            format!(
                "key \"{what}\": {far:.0} m from the origin and stored with 32 bits, so it is only known to {} mm",
                touch2touch_core::units::significant(1e3 * rounding)
            ),
            "store poses with 64 bits, or relative to a frame near the rig",
        )
    })
}

fn sample(sample: &Sample, file: &Path, with_cameras: bool, problems: &mut Vec<Problem>) {
    let mut add = |what: String, hint: &str| {
        problems.push(Problem { file: file.to_owned(), what, hint: hint.into() });
    };
    let mut sides = Vec::new();
    for finger in sample.rig.pads() {
        let Some(touch) = sample.pad(finger) else { continue };
        let name = &*sample.rig.pad_key(finger);
        if let Some(gel) = touch.color()
            && let Some(images) = &gel.images
        {
            let brightest = images.raw.as_slice().iter().flatten().copied().fold(0f32, f32::max);
            if brightest > 256.0 || brightest <= 1.0 {
                add(
                    format!("the {name} GelSlim image reaches {brightest}: not the scale 0..255"),
                    "store images as 0..255",
                );
            }
        }
        let Some(touch) = touch.depth() else { continue };
        imprint(&touch.imprint, name, &mut add);
        if let Some(camera) = touch.camera.as_ref().filter(|_| with_cameras) {
            sides.push(camera.grasp_from_camera.translation.x);
            self::camera(camera, &touch.imprint, name, &mut add);
        }
    }
    if let [right, left] = sides[..]
        && right * left > 0.0
    {
        add(
            format!("both cameras are on the same side of the grasp (x = {right:.3} and {left:.3} m)"),
            "check bubbles_tr_quat: the two fingers face each other along x",
        );
    }
    if let Some(pose) = sample.grasp_from_object.map(|p| p.inverse()) {
        if pose.theta_rad.abs() > MAX_THETA_RAD {
            add(format!("theta is {} rad: degrees?", pose.theta_rad), "store theta in radians");
        }
        let offset = pose.y_m.abs().max(pose.z_m.abs());
        if offset > MAX_OFFSET_M {
            add(format!("the grasp is {offset} m away from the tool: millimeters?"), "store x and y in meters");
        }
    }
}

fn imprint(imprint: &DepthMap, name: &str, add: &mut impl FnMut(String, &str)) {
    let finite = || imprint.as_slice().iter().copied().filter(|v| v.is_finite()).map(f64::from);
    let (lo, hi) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
    if lo > hi {
        return add(format!("the {name} imprint has no measured pixel"), "record the grasp again");
    }
    if hi.abs().max(lo.abs()) > MAX_IMPRINT_M {
        // Flying pixels are few; another unit shows in the typical value.
        let mut sizes: Vec<f64> = finite().map(f64::abs).collect();
        let at = sizes.len() * 9 / 10;
        let (_, typical, _) = sizes.select_nth_unstable_by(at, f64::total_cmp);
        let (what, hint) = if *typical > MAX_IMPRINT_M {
            ("not meters; millimeters?", "store imprints in meters")
        } else {
            ("single pixels are far off", "they are flying pixels of the depth camera; a median filter removes them")
        };
        add(format!("the {name} imprint reaches from {lo:.4} to {hi:.4}: {what}"), hint);
    } else if hi == lo {
        add(format!("the {name} imprint is {lo} everywhere"), "check that the grasp was recorded");
    }
}

fn camera(camera: &DepthCamera, imprint: &DepthMap, name: &str, add: &mut impl FnMut(String, &str)) {
    let k = camera.intrinsics;
    let focal_ok = |f: f64| (FOCAL_RANGE_PX[0]..=FOCAL_RANGE_PX[1]).contains(&f);
    let inside = |c: f64, size: usize| (CENTER_RANGE[0]..=CENTER_RANGE[1]).contains(&(c / size as f64));
    let center_ok = inside(k.cx, camera.crop.full[0]) && inside(k.cy, camera.crop.full[1]);
    let square = (k.fx / k.fy).max(k.fy / k.fx) <= MAX_ASPECT;
    if !(focal_ok(k.fx) && focal_ok(k.fy) && center_ok && square) {
        add(
            format!("the {name} camera's K is implausible: fx {} fy {} cx {} cy {}", k.fx, k.fy, k.cx, k.cy),
            "K belongs to the full 224 x 171 image, in pixels, row by row",
        );
    }
    let mut depths: Vec<f64> =
        camera.depth_reference.as_slice().iter().filter(|v| v.is_finite()).map(|&v| f64::from(v)).collect();
    if depths.is_empty() {
        return add(format!("the {name} reference depth has no measured pixel"), "record the reference again");
    }
    let middle = depths.len() / 2;
    let (_, &mut typical, _) = depths.select_nth_unstable_by(middle, f64::total_cmp);
    if !(DEPTH_RANGE_M[0]..=DEPTH_RANGE_M[1]).contains(&typical) {
        let unit = if typical > 10.0 { ": millimeters?" } else { "" };
        return add(
            format!("the {name} reference depth is typically {typical:.4} m, out of the bubble's range{unit}"),
            "store depths in meters",
        );
    }
    // What the middle of the crop sees is the membrane, and that is near the tool.
    let [width, height] = camera.depth_reference.size();
    let seen = camera.lift(width as f64 / 2.0, height as f64 / 2.0, typical);
    let distance = camera.grasp_from_camera.transform_point3(seen).length();
    if distance > NEAR_GRASP_M {
        let w_first = reordered(&camera.grasp_from_camera).transform_point3(seen).length() < NEAR_GRASP_M;
        let what = if w_first { "the quaternions may be stored as w x y z" } else { "check frames and units" };
        add(
            format!("the {name} camera looks past the grasp by {distance:.3} m: {what}"),
            "bubbles_tr_quat and grasp_frame_quat are x y z qx qy qz qw in the arm's base frame, meters",
        );
    }
    round_trip(camera, imprint, name, add);
}

/// The transform if its quaternion was written `w x y z` and read `x y z w`. Only a hint: the stored transforms were
/// composed, so this is exact only where the grasp frame's own rotation is none.
fn reordered(a: &DAffine3) -> DAffine3 {
    let q = DQuat::from_mat3(&a.matrix3);
    DAffine3::from_rotation_translation(DQuat::from_xyzw(q.y, q.z, q.w, q.x), a.translation)
}

/// Depth to cloud to pixel: every measured pixel must come back to itself.
fn round_trip(camera: &DepthCamera, imprint: &DepthMap, name: &str, add: &mut impl FnMut(String, &str)) {
    let camera_from_grasp = camera.grasp_from_camera.inverse();
    let mut lost = 0usize;
    for v in 0..imprint.height() {
        for u in 0..imprint.width() {
            let depth = f64::from(camera.depth_reference[(u, v)]) - f64::from(imprint[(u, v)]);
            if !depth.is_finite() {
                continue;
            }
            let in_grasp: DVec3 = camera.grasp_from_camera.transform_point3(camera.lift(u as f64, v as f64, depth));
            let back = camera.project(camera_from_grasp.transform_point3(in_grasp));
            let missed =
                back.is_none_or(|(x, y)| (x - u as f64).abs() > ROUND_TRIP_PX || (y - v as f64).abs() > ROUND_TRIP_PX);
            lost += usize::from(missed);
        }
    }
    if lost > 0 {
        add(
            format!("{lost} pixels of the {name} finger do not come back from the cloud: they lie behind the camera"),
            "the imprint is deeper than the reference depth there; check units and the reference",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_rounded_to_32_bits_far_from_the_origin_are_noticed() {
        let rotation = [0.5, 0.5, 0.5, 0.5];
        let place = |x: f64| [&[x, 0.25, -1.5][..], &rotation].concat();
        let file = Path::new("t.pt");
        let note = rounded_place(file, "grasp_frame_quat", &place(f64::from(4000.1f32))).unwrap();
        assert!(note.what.contains("grasp_frame_quat") && note.what.contains("32 bits"), "{}", note.what);
        // Near the origin, or with 64 bits, they are known well enough.
        assert_eq!(rounded_place(file, "k", &place(f64::from(1.1f32))), None);
        assert_eq!(rounded_place(file, "k", &place(4000.1)), None);
        assert_eq!(rounded_place(file, "k", &place(f64::NAN)), None);
    }
}
