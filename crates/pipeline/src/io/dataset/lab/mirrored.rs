//! Camera frames that are no rotation: a mirrored image, squeezed into a quaternion.
//!
//! Some files hold quaternions that are far from unit length. They come from a 3 x 3 matrix with determinant -1 (the
//! camera's image is mirrored), which the usual conversion turns into four numbers without complaint. Normalizing
//! them gives a camera that looks elsewhere. The conversion loses one number; it can be undone if the direction of
//! the optical axis is known, and that is: a bubble's camera looks at the tool.

use glam::{DAffine3, DMat3, DVec3};

/// A true rotation stored with 32 bits is within 1e-6 of unit length, one typed with three digits within this.
pub(super) const UNIT_TOLERANCE: f64 = 0.01;
/// Largest error of the recovered frame's conversion. Stored with 32 bits it is met to 1e-6.
const TOLERANCE: f64 = 1e-3;
/// Directions of the image's first column that are tried before refining.
const STEPS: usize = 3600;

/// The mirrored frame whose conversion gives `quaternion` (`x y z w`) and whose optical axis points from `position`
/// to `target`; all in one frame. `None` if there is none.
pub(super) fn recover(position: DVec3, quaternion: [f64; 4], target: DVec3) -> Option<DAffine3> {
    let axis = (target - position).try_normalize()?;
    let (e1, e2) = axis.any_orthonormal_pair();
    let matrix = |angle: f64| {
        let column = e1 * angle.cos() + e2 * angle.sin();
        DMat3::from_cols(column, column.cross(axis), axis)
    };
    let error = |angle: f64| mismatch(&matrix(angle), quaternion);
    let step = std::f64::consts::TAU / STEPS as f64;
    let coarse = (0..STEPS).map(|i| i as f64 * step).min_by(|a, b| error(*a).total_cmp(&error(*b)))?;
    // The error has one minimum between the neighbors: thirds of the interval are cut off.
    let (mut lo, mut hi) = (coarse - step, coarse + step);
    for _ in 0..80 {
        let (a, b) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
        if error(a) < error(b) { hi = b } else { lo = a }
    }
    let angle = (lo + hi) / 2.0;
    (error(angle) < TOLERANCE).then(|| DAffine3 { matrix3: matrix(angle), translation: position })
}

/// Distance of `quaternion` to what the conversion makes of `m`, over its four branches.
///
/// Shepperd's method: each branch divides by four times its own component, so only one with a component of a
/// quarter or more is ever taken.
fn mismatch(m: &DMat3, quaternion: [f64; 4]) -> f64 {
    let at = |row: usize, column: usize| m.col(column)[row];
    let (xx, yy, zz) = (at(0, 0), at(1, 1), at(2, 2));
    let half_root = |v: f64| v.max(0.0).sqrt() / 2.0;
    let (sum_xy, sum_xz, sum_yz) = (at(0, 1) + at(1, 0), at(0, 2) + at(2, 0), at(1, 2) + at(2, 1));
    let (dx, dy, dz) = (at(2, 1) - at(1, 2), at(0, 2) - at(2, 0), at(1, 0) - at(0, 1));
    let branches = [
        (half_root(1.0 + xx - yy - zz), [f64::NAN, sum_xy, sum_xz, dx]),
        (half_root(1.0 - xx + yy - zz), [sum_xy, f64::NAN, sum_yz, dy]),
        (half_root(1.0 - xx - yy + zz), [sum_xz, sum_yz, f64::NAN, dz]),
        (half_root(1.0 + xx + yy + zz), [dx, dy, dz, f64::NAN]),
    ];
    let mut best = f64::INFINITY;
    for (own, others) in branches {
        if own < 0.25 {
            continue;
        }
        let made = others.map(|v| if v.is_nan() { own } else { v / (4.0 * own) });
        for sign in [1.0, -1.0] {
            let squares: f64 = made.iter().zip(quaternion).map(|(a, b)| (sign * a - b).powi(2)).sum();
            best = best.min(squares.sqrt());
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirrored_camera_is_recovered_from_its_broken_quaternion() {
        // A gripper tilted by 0.3 rad with mirrored cameras on either side, and what the conversion makes of them.
        let base_from_grasp = DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2)
            * DMat3::from_rotation_x(0.0)
            * DMat3::from_rotation_y(-0.3);
        let cases = [
            (1.0, DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::NEG_X), [0.0, 0.5f64.sqrt(), 0.0, 0.0]),
            (-1.0, DMat3::from_cols(DVec3::NEG_Y, DVec3::Z, DVec3::X), [0.0, 0.0, 0.0, 0.5f64.sqrt()]),
        ];
        let origin = DVec3::new(0.55, -0.05, 0.42);
        for (side, grasp_from_camera, quaternion) in cases {
            assert!(grasp_from_camera.determinant() < 0.0);
            let position = origin + base_from_grasp * DVec3::new(0.089 * side, 0.0, 0.0);
            let found = recover(position, quaternion, origin).unwrap();
            assert!(found.matrix3.abs_diff_eq(base_from_grasp * grasp_from_camera, 1e-9), "{side}");
            assert_eq!(found.translation, position);
        }
        assert_eq!(recover(DVec3::X, [0.9, 0.9, 0.9, 0.9], DVec3::ZERO), None);
        assert_eq!(recover(DVec3::X, [0.5; 4], DVec3::X), None);
    }
}
