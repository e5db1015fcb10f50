//! The named frames and the planar in-hand pose.
//!
//! * **grasp**: x = closing axis of the gripper, +z = the direction the tool points (away from the wrist),
//!   y = lateral, right-handed. The tool lies in the y-z plane.
//! * **object**: the CAD model's frame; equals the grasp frame when the in-hand pose is zero.
//! * **camera**: a bubble's pinhole camera (optical frame: x right, y down, z forward).
//!
//! A transform is named `dst_from_src` and maps coordinates in `src` to coordinates in `dst`.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// The sides from which a grasp is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraPreset {
    /// From the left finger (negative x) along the closing axis.
    Left,
    /// From the right finger (positive x) along the closing axis.
    Right,
    /// Along the lateral axis, with the left finger on the left.
    Front,
    /// Along the lateral axis, with the left finger on the right.
    Back,
    /// From the wrist down the tool, with the left finger on the left.
    Top,
    /// From below up the tool, with the left finger on the left.
    Bottom,
    /// From above a corner, as a view begins: everything has a side to it.
    Oblique,
}

impl CameraPreset {
    /// Yaw about the vertical from positive x towards y, and pitch over the horizontal plane, radians.
    pub fn angles_rad(self) -> [f64; 2] {
        match self {
            Self::Left => [PI, 0.0],
            Self::Right => [0.0, 0.0],
            Self::Front => [FRAC_PI_2, 0.0],
            Self::Back => [-FRAC_PI_2, 0.0],
            Self::Top => [FRAC_PI_2, FRAC_PI_2],
            Self::Bottom => [FRAC_PI_2, -FRAC_PI_2],
            Self::Oblique => [0.9, 0.35],
        }
    }
}

/// A rigid motion in the y-z plane: rotate by `theta_rad` about +x, then move by `(0, y_m, z_m)`.
///
/// The name that holds it says which frames it joins (`grasp_from_object`, `object_from_grasp`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlanarPose {
    /// Rotation about +x, radians, right-handed (y towards z).
    pub theta_rad: f64,
    /// Translation along y, meters.
    pub y_m: f64,
    /// Translation along z, meters.
    pub z_m: f64,
}

impl PlanarPose {
    /// The truth that the lab stores with a grasp, as `object_from_grasp`: rotation `+theta`, translation
    /// `(y, z) = (-x, -y)`. Its angle is the number the lab reports.
    ///
    /// Source: `evaluation/ICP_dataset_cal.py` of the lab's touch2touch repository, lines 90-102 and 766-769.
    pub fn object_from_grasp_of_lab(theta_rad: f64, x_m: f64, y_m: f64) -> Self {
        Self { theta_rad, y_m: -x_m, z_m: -y_m }
    }

    /// The opposite motion: turns `a_from_b` into `b_from_a`.
    pub fn inverse(self) -> Self {
        let t = rotate(-self.theta_rad, DVec2::new(-self.y_m, -self.z_m));
        Self { theta_rad: -self.theta_rad, y_m: t.x, z_m: t.y }
    }

    /// The motion `inner` and then this one: `a_from_b.compose(b_from_c)` is `a_from_c`.
    #[must_use]
    pub fn compose(self, inner: Self) -> Self {
        let t = self.transform_yz(DVec2::new(inner.y_m, inner.z_m));
        Self { theta_rad: self.theta_rad + inner.theta_rad, y_m: t.x, z_m: t.y }
    }

    /// Moves a point given as `(y, z)`.
    pub fn transform_yz(self, yz: DVec2) -> DVec2 {
        rotate(self.theta_rad, yz) + DVec2::new(self.y_m, self.z_m)
    }

    /// Transform in space of the same motion, meters.
    pub fn to_affine(self) -> DAffine3 {
        DAffine3::from_rotation_translation(DQuat::from_rotation_x(self.theta_rad), DVec3::new(0.0, self.y_m, self.z_m))
    }

    /// True where every number is finite.
    pub fn is_finite(self) -> bool {
        self.theta_rad.is_finite() && self.y_m.is_finite() && self.z_m.is_finite()
    }
}

/// Rotates `(y, z)` by `theta_rad` about +x.
fn rotate(theta_rad: f64, yz: DVec2) -> DVec2 {
    let (s, c) = theta_rad.sin_cos();
    DVec2::new(c * yz.x - s * yz.y, s * yz.x + c * yz.y)
}

/// A rigid transform from the lab's 7 numbers `x y z qx qy qz qw`.
///
/// Returns `None` if a number is not finite or the quaternion is too short to have a direction.
pub fn affine_from_xyz_quat(v: [f64; 7]) -> Option<DAffine3> {
    let [x, y, z, qx, qy, qz, qw] = v;
    let q = DQuat::from_xyzw(qx, qy, qz, qw);
    if v.iter().any(|n| !n.is_finite()) || q.length() < 1e-6 {
        return None;
    }
    Some(DAffine3::from_rotation_translation(q.normalize(), DVec3::new(x, y, z)))
}

/// The inverse of [`affine_from_xyz_quat`].
pub fn xyz_quat_from_affine(a: &DAffine3) -> [f64; 7] {
    let q = DQuat::from_mat3(&DMat3::from_cols(a.matrix3.x_axis, a.matrix3.y_axis, a.matrix3.z_axis));
    [a.translation.x, a.translation.y, a.translation.z, q.x, q.y, q.z, q.w]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_undoes_and_agrees_with_the_affine() {
        let pose = PlanarPose { theta_rad: 0.3, y_m: 0.004, z_m: -0.002 };
        let p = DVec2::new(0.01, -0.02);
        let back = pose.inverse().transform_yz(pose.transform_yz(p));
        assert!((back - p).length() < 1e-15);
        let q = pose.to_affine().transform_point3(DVec3::new(0.5, p.x, p.y));
        assert!((DVec2::new(q.y, q.z) - pose.transform_yz(p)).length() < 1e-15);
        let other = PlanarPose { theta_rad: -1.1, y_m: 0.02, z_m: 0.03 };
        let both = pose.compose(other);
        assert!((both.transform_yz(p) - pose.transform_yz(other.transform_yz(p))).length() < 1e-15);
        let round = (pose.inverse().to_affine() * pose.to_affine()).to_cols_array();
        for (a, b) in round.iter().zip(DAffine3::IDENTITY.to_cols_array()) {
            assert!((a - b).abs() < 1e-15);
        }
    }

    #[test]
    fn quaternion_round_trip_and_refusal() {
        let a = affine_from_xyz_quat([0.1, -0.2, 0.3, 0.1, 0.2, 0.3, 0.9]).unwrap();
        let b = affine_from_xyz_quat(xyz_quat_from_affine(&a)).unwrap();
        assert!(a.abs_diff_eq(b, 1e-12));
        assert!(affine_from_xyz_quat([0.0; 7]).is_none());
        assert!(affine_from_xyz_quat([f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]).is_none());
    }
}
