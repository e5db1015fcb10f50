//! The pinhole model of a depth camera. What a sensor is and where it sits: [`super::rig`].

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Pinhole intrinsics of a camera's *full* image (224 x 171 for the Soft Bubble), in pixels.
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
    /// Lifts pixel `(u, v)` of the full image at depth `z` (meters) to a point in the camera frame, meters.
    pub fn lift(&self, u: f64, v: f64, z: f64) -> DVec3 {
        DVec3::new((u - self.cx) * z / self.fx, (v - self.cy) * z / self.fy, z)
    }

    /// Projects a point in the camera frame to pixel `(u, v)` of the full image; `None` behind the camera.
    pub fn project(&self, p_in_camera: DVec3) -> Option<(f64, f64)> {
        if p_in_camera.z <= 0.0 || !p_in_camera.is_finite() {
            return None;
        }
        Some((p_in_camera.x * self.fx / p_in_camera.z + self.cx, p_in_camera.y * self.fy / p_in_camera.z + self.cy))
    }

    /// True where the numbers can be a camera's: finite, positive focal lengths.
    pub fn is_plausible(&self) -> bool {
        [self.fx, self.fy, self.cx, self.cy].iter().all(|n| n.is_finite()) && self.fx > 1.0 && self.fy > 1.0
    }
}
