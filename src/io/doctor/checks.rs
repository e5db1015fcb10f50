//! What a loaded sample must satisfy to be a touch of the lab's rig.

use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};

use crate::domain::dataset::Problem;
use crate::domain::grid::DepthMap;
use crate::domain::sample::{DepthCamera, Sample};

/// No bubble is pushed in further; the released data reach 26 mm.
const MAX_IMPRINT_M: f64 = 0.08;
/// Depths at which a bubble's camera can see its membrane.
const DEPTH_RANGE_M: [f64; 2] = [0.02, 0.5];
/// Focal lengths of a camera with 224 x 171 pixels: 13 to 160 degrees of view.
const FOCAL_RANGE_PX: [f64; 2] = [20.0, 1000.0];
/// The tool lies in the grasp frame's origin: what the middle of the image sees cannot be further away.
const NEAR_GRASP_M: f64 = 0.1;
/// Angles are within 22.5 degrees in the released data; beyond a right angle they are in degrees.
const MAX_THETA_RAD: f64 = std::f64::consts::FRAC_PI_2;
/// Grasps are within 5 mm in the released data.
const MAX_OFFSET_M: f64 = 0.1;
/// Pixels by which lifting and projecting again may miss.
const ROUND_TRIP_PX: f64 = 1e-6;

/// Lists what cannot be right about `sample`, which was read from `file`.
pub(super) fn sample(sample: &Sample, file: &Path, problems: &mut Vec<Problem>) {
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
        if let Some(camera) = &touch.camera {
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
            add(format!("the grasp is {offset} m away from the tool: millimetres?"), "store x and y in metres");
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
            ("not metres; millimetres?", "store imprints in metres")
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
    let inside = |c: f64, size: usize| (0.0..=size as f64).contains(&c);
    let centre_ok = inside(k.cx, camera.crop.full[0]) && inside(k.cy, camera.crop.full[1]);
    if !(focal_ok(k.fx) && focal_ok(k.fy) && centre_ok) {
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
        let unit = if typical > 10.0 { ": millimetres?" } else { "" };
        return add(
            format!("the {name} reference depth is typically {typical:.4} m, out of the bubble's range{unit}"),
            "store depths in metres",
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
            "bubbles_tr_quat and grasp_frame_quat are x y z qx qy qz qw in the arm's base frame, metres",
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
