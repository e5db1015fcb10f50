//! The rigid motion that brings pairs of points closest, without iteration.
//!
//! Neither form can return a reflection, so nothing has to be repaired afterwards, and neither has a unit. Sums are
//! taken about the centroids in f64: an offset of a thousand kilometers costs a millimeter-sized cloud no angle.

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use nalgebra::{Matrix4, Vector4};

use crate::frames::PlanarPose;
use crate::linear::eigen_symmetric;

/// Points closer together than this share of their coordinates are one point: rounding is all that sets them apart.
const SPOT: f64 = 1e-13;

/// The planar motion `b_from_a` for pairs `(a, b)` of `(y, z)`, least squares.
///
/// `None` for no pair, points of either side all in one spot, or a number that is not finite: there is no angle then,
/// and 0 would look like one.
pub fn in_plane(pairs: &[(DVec2, DVec2)]) -> Option<PlanarPose> {
    let space = |p: DVec2| DVec3::new(0.0, p.x, p.y);
    let [a_mean, b_mean] = centroids(pairs.iter().map(|(a, b)| (space(*a), space(*b))))?.map(|c| DVec2::new(c.y, c.z));
    let (mut dot, mut cross) = (0.0, 0.0);
    for (a, b) in pairs {
        let (a, b) = (*a - a_mean, *b - b_mean);
        dot += a.dot(b);
        cross += a.perp_dot(b);
    }
    let theta_rad = cross.atan2(dot);
    let shift = b_mean - DVec2::from_angle(theta_rad).rotate(a_mean);
    let pose = PlanarPose { theta_rad, y_m: shift.x, z_m: shift.y };
    pose.is_finite().then_some(pose)
}

/// The motion `b_from_a` in space for pairs `(a, b)`, least squares. Directions that the pairs leave open (collinear
/// points turn freely about their line) are not turned.
///
/// `None` as for [`in_plane`].
pub fn in_space(pairs: &[(DVec3, DVec3)]) -> Option<DAffine3> {
    let [a_mean, b_mean] = centroids(pairs.iter().copied())?;
    let mut correlation = DMat3::ZERO;
    for (a, b) in pairs {
        let (a, b) = (*a - a_mean, *b - b_mean);
        correlation += DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    }
    let turn = closest_rotation(correlation)?;
    let motion = DAffine3::from_rotation_translation(turn, b_mean - turn * a_mean);
    motion.is_finite().then_some(motion)
}

/// Means of both sides about their first points; `None` if either side has no size.
fn centroids(pairs: impl Iterator<Item = (DVec3, DVec3)> + Clone) -> Option<[DVec3; 2]> {
    let (a0, b0) = pairs.clone().next()?;
    let (mut n, mut a_sum, mut b_sum) = (0.0, DVec3::ZERO, DVec3::ZERO);
    let (mut a_size, mut b_size) = (0f64, 0f64);
    for (a, b) in pairs {
        if !a.is_finite() || !b.is_finite() {
            return None;
        }
        n += 1.0;
        a_sum += a - a0;
        b_sum += b - b0;
        a_size = a_size.max((a - a0).abs().max_element());
        b_size = b_size.max((b - b0).abs().max_element());
    }
    let sized = a_size > SPOT * a0.abs().max_element() && b_size > SPOT * b0.abs().max_element();
    sized.then(|| [a0 + a_sum / n, b0 + b_sum / n])
}

/// The rotation `R` that makes `sum m . R a` largest for the correlation `sum a m^T`.
///
/// Directions that the correlation leaves open (collinear points) are not turned. A unit quaternion is a proper
/// rotation always, so no reflection has to be repaired. `None` if a number is not finite.
///
/// Source: Horn, Closed-form solution of absolute orientation using unit quaternions, 1987.
pub(super) fn closest_rotation(correlation: DMat3) -> Option<DQuat> {
    /// Eigenvalues closer than this, relative to the largest entry, count as equal.
    const EQUAL: f64 = 1e-9;
    let s = |a: usize, m: usize| correlation.col(m)[a];
    let n = Matrix4::from([
        [s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0)],
        [s(1, 2) - s(2, 1), s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2)],
        [s(2, 0) - s(0, 2), s(0, 1) + s(1, 0), s(1, 1) - s(0, 0) - s(2, 2), s(1, 2) + s(2, 1)],
        [s(0, 1) - s(1, 0), s(2, 0) + s(0, 2), s(1, 2) + s(2, 1), s(2, 2) - s(0, 0) - s(1, 1)],
    ]);
    let (values, vectors) = eigen_symmetric(n)?;
    let largest = values[3].abs().max(values[0].abs());
    // Of all best rotations the one nearest to none: the identity quaternion, projected.
    let mut q = Vector4::zeros();
    for (value, vector) in values.iter().zip(vectors.column_iter()) {
        if values[3] - value <= EQUAL * largest {
            q += vector * vector[0];
        }
    }
    let best = if q.norm_squared() > 1e-12 { q } else { vectors.column(3).into() };
    let q = DQuat::from_xyzw(best[1], best[2], best[3], best[0]);
    q.is_finite().then(|| q.normalize())
}
