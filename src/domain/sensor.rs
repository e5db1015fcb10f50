//! The two sensors: sizes, scales, intrinsics, and the pinhole model of the bubble's depth camera.
//!
//! Source of the numbers: the Touch2Touch paper (px/mm, window), the lab's `point_cloud_utils.py` lines 5-10 (crop).

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Which finger of the gripper. The lab stores index 0 = right, 1 = left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Finger {
    /// Index 0 in the lab's files.
    Right,
    /// Index 1 in the lab's files.
    Left,
}

impl Finger {
    /// Both fingers in the order of the lab's files.
    pub const BOTH: [Finger; 2] = [Finger::Right, Finger::Left];

    /// The position in the lab's files.
    pub fn index(self) -> usize {
        self as usize
    }

    /// `right` or `left`.
    pub fn name(self) -> &'static str {
        ["right", "left"][self.index()]
    }
}

/// The Soft Bubble: a depth camera behind an air-filled membrane.
pub mod bubble {
    /// Columns of the cropped image.
    pub const WIDTH: usize = 175;
    /// Rows of the cropped image.
    pub const HEIGHT: usize = 140;
    /// Columns of the full camera image that the intrinsics belong to.
    pub const FULL_WIDTH: usize = 224;
    /// Rows of the full camera image.
    pub const FULL_HEIGHT: usize = 171;
    /// Column of the full image at which the crop starts.
    pub const CROP_X: usize = 25;
    /// Row of the full image at which the crop starts.
    pub const CROP_Y: usize = 20;
    /// Scale on the membrane, pixels per metre.
    pub const PX_PER_M: f64 = 2360.0;
}

/// The GelSlim: a colour camera behind a gel.
pub mod gelslim {
    /// Columns.
    pub const WIDTH: usize = 427;
    /// Rows.
    pub const HEIGHT: usize = 320;
    /// Scale on the gel, pixels per metre.
    pub const PX_PER_M: f64 = 23_720.0;
}

/// The area that the GelSlim sees, as a rectangle in *raw* (not rotated) bubble pixels:
/// `[centre x, centre y, width, height]`.
///
/// Source: the lab's CTTP repository, `utils/dataset_management.py` lines 11-50; the size is the GelSlim
/// window (18.0 x 13.5 mm) at the bubble's 2.36 px/mm.
pub fn gelslim_footprint_in_bubble(finger: Finger) -> [f64; 4] {
    let width = gelslim::WIDTH as f64 / gelslim::PX_PER_M * bubble::PX_PER_M;
    let height = gelslim::HEIGHT as f64 / gelslim::PX_PER_M * bubble::PX_PER_M;
    match finger {
        Finger::Right => [73.3, 67.0, width, height],
        Finger::Left => [62.6, 70.3, width, height],
    }
}

/// Whether the GelSlim of a finger sees a pixel of a bubble image of `size` (`[width, height]`, raw orientation; other
/// sizes than the bubble's stand for the same area). `at_px` counts from the centre of the first pixel.
pub fn seen_by_gelslim(finger: Finger, at_px: [f64; 2], size: [usize; 2]) -> bool {
    let [cx, cy, width, height] = gelslim_footprint_in_bubble(finger);
    let full = |at: f64, from: usize, to: usize| (at + 0.5) * to as f64 / from.max(1) as f64 - 0.5;
    let (x, y) = (full(at_px[0], size[0], bubble::WIDTH), full(at_px[1], size[1], bubble::HEIGHT));
    (x - cx).abs() <= width / 2.0 && (y - cy).abs() <= height / 2.0
}

/// Pinhole intrinsics of the *full* 224 x 171 depth image, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Intrinsics {
    /// Focal length along x.
    pub fx: f64,
    /// Focal length along y.
    pub fy: f64,
    /// Principal point, column.
    pub cx: f64,
    /// Principal point, row.
    pub cy: f64,
}

impl Intrinsics {
    /// Lifts crop pixel `(u, v)` at depth `z` (metres) to a point in the camera frame, metres.
    ///
    /// Source: `ICP_dataset_cal.py` lines 426-433: the crop offset is added before the pinhole model.
    pub fn lift(&self, u: f64, v: f64, z: f64) -> DVec3 {
        DVec3::new(
            (u + bubble::CROP_X as f64 - self.cx) * z / self.fx,
            (v + bubble::CROP_Y as f64 - self.cy) * z / self.fy,
            z,
        )
    }

    /// Projects a point in the camera frame to crop pixel coordinates `(u, v)`; `None` behind the camera.
    pub fn project(&self, p_in_camera: DVec3) -> Option<(f64, f64)> {
        if p_in_camera.z <= 0.0 || !p_in_camera.is_finite() {
            return None;
        }
        Some((
            p_in_camera.x * self.fx / p_in_camera.z + self.cx - bubble::CROP_X as f64,
            p_in_camera.y * self.fy / p_in_camera.z + self.cy - bubble::CROP_Y as f64,
        ))
    }

    /// Whether the numbers can be a camera's: finite, positive focal lengths.
    pub fn is_plausible(&self) -> bool {
        [self.fx, self.fy, self.cx, self.cy].iter().all(|n| n.is_finite()) && self.fx > 1.0 && self.fy > 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_survives_depth_to_cloud_to_pixel() {
        let k = Intrinsics { fx: 212.0, fy: 211.0, cx: 112.3, cy: 86.1 };
        for v in 0..bubble::HEIGHT {
            for u in 0..bubble::WIDTH {
                let z = 0.07 + 1e-4 * ((u * 7 + v * 13) % 200) as f64;
                let (u2, v2) = k.project(k.lift(u as f64, v as f64, z)).unwrap();
                assert!((u2 - u as f64).abs() < 1e-9 && (v2 - v as f64).abs() < 1e-9);
            }
        }
        assert_eq!(k.project(DVec3::new(0.0, 0.0, 0.0)), None);
        assert_eq!(k.project(DVec3::new(0.0, 0.0, f64::NAN)), None);
    }
}
