//! Poses of the sensors around the tool.
//!
//! Both depth cameras look at the tool obliquely, 44 degrees off the closing axis, from the side of the wrist. (The lab's
//! notebooks say 55 degrees about y; real imprints fit 46 better, by 0.6 dB.) Their position follows from what the two
//! sensors must agree on: the surface point of the tool at the grasp's origin is the center of the GelSlim window and the
//! center of its footprint in the bubble image ([`Rig::color_window`]), at [`RANGE_M`] from the camera.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use crate::rig::{PadId, Rig, Window, lab};
use crate::sensor::Intrinsics;

/// Distance of the touched surface from the camera along its axis, meters.
pub const RANGE_M: f64 = 0.0868;
/// Angle of the camera about +y, degrees.
const CAMERA_ANGLE_DEG: f64 = 46.03;

/// Intrinsics of the full image. Focal length from the scale (2.36 px/mm at about 90 mm).
pub(crate) const INTRINSICS: Intrinsics = Intrinsics { fx: 212.0, fy: 212.0, cx: 112.0, cy: 86.0 };

/// The sign that turns grasp x into "away from this finger": the finger's side of the tool is at negative values.
pub fn outward(finger: PadId) -> f64 {
    if finger == lab::RIGHT { -1.0 } else { 1.0 }
}

/// The camera's place for a tool whose surface is `half_thickness_m` from the middle plane.
pub fn grasp_from_camera(finger: PadId, half_thickness_m: f64) -> DAffine3 {
    let (s, c) = CAMERA_ANGLE_DEG.to_radians().sin_cos();
    let o = outward(finger);
    // columns: where the camera's right, down and forward point in the grasp frame
    let rotation = DMat3::from_cols(DVec3::new(o * c, 0.0, -s), DVec3::new(0.0, o, 0.0), DVec3::new(o * s, 0.0, c));
    let touched = DVec3::new(-o * half_thickness_m, 0.0, 0.0);
    let [u, v] = footprint(finger).center_px;
    let translation = touched - rotation * lab::BUBBLE.crop.lift(&INTRINSICS, u, v, RANGE_M);
    DAffine3 { matrix3: rotation, translation }
}

/// Window that the GelSlim sees, in the bubble's pixels.
fn footprint(finger: PadId) -> Window {
    *Rig::lab().color_window(finger).expect("the lab's rig has a window for each finger")
}

/// The (y, z) in the grasp frame, meters, of a place `flat` on the finger's gel ([`Lens::flat`](super::Lens::flat)).
pub fn gelslim_yz(finger: PadId, flat: DVec2) -> DVec2 {
    DVec2::new(-outward(finger) * flat.y, flat.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Lens;

    #[test]
    fn rotations_are_the_labs_and_the_cameras_face_each_other() {
        let left = grasp_from_camera(lab::LEFT, 0.008);
        let right = grasp_from_camera(lab::RIGHT, 0.008);
        let expected = DMat3::from_rotation_y(CAMERA_ANGLE_DEG.to_radians());
        assert!(left.matrix3.abs_diff_eq(expected, 1e-12));
        let expected = DMat3::from_cols_array(&[-0.6943, 0.0, -0.7197, 0.0, -1.0, 0.0, -0.7197, 0.0, 0.6943]);
        assert!(right.matrix3.abs_diff_eq(expected, 1e-3));
        assert!((right.matrix3.determinant() - 1.0).abs() < 1e-12);
        for (camera, side) in [(left, -1.0), (right, 1.0)] {
            let t = camera.translation;
            assert!((0.06..0.07).contains(&(side * t.x)), "{t}");
            assert!(t.y.abs() < 0.004 && (-0.07..-0.06).contains(&t.z), "{t}");
        }
    }

    #[test]
    fn the_footprint_is_what_the_gelslim_sees() {
        for finger in lab::PADS {
            let camera_from_grasp = grasp_from_camera(finger, 0.008).inverse();
            let project = |column: f64, row: f64| {
                let yz = gelslim_yz(finger, Lens::LAB[finger.index()].flat(DVec2::new(column, row)));
                let p = DVec3::new(-outward(finger) * 0.008, yz.x, yz.y);
                lab::BUBBLE
                    .crop
                    .project(&INTRINSICS, camera_from_grasp.transform_point3(p))
                    .expect("in front of the camera")
            };
            let [x, y, width, height] = footprint(finger).rectangle();
            let (cx, cy) = project(213.0, 159.5);
            assert!((cx - x).abs() < 1e-6 && (cy - y).abs() < 1e-6);
            // the bubble image rotated by 180 degrees lines up with the GelSlim image: its left edge is at the right
            let (left, right) = (project(-0.5, 159.5), project(426.5, 159.5));
            let (top, bottom) = (project(213.0, -0.5), project(213.0, 319.5));
            assert!(left.0 > right.0 && top.1 > bottom.1);
            // the published rectangle ignores the tilt and the lens, which sees more at its edges
            let off = [left.0 - (x + 0.5 * width), right.0 - (x - 0.5 * width)];
            assert!(off.iter().all(|off| off.abs() < 8.5), "{off:?}");
            let off = [top.1 - (y + 0.5 * height), bottom.1 - (y - 0.5 * height)];
            assert!(off.iter().all(|off| off.abs() < 4.0), "{off:?}");
        }
    }
}
