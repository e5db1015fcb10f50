//! Observability of a planar pose: how well contact points determine it, and which motion they leave open.

use glam::DVec2;
use nalgebra::Matrix3;

use super::ANGLE_SCALE_M;
use super::batch::{Cloud, State};
use crate::field::DistanceField;
use crate::frames::PlanarPose;
use crate::linear::eigen_symmetric;

/// Smallest eigenvalue below which a pose counts as not determined.
///
/// Separates straight rods (at most 0.0084) from tools with an angle or a junction (at least 0.0229).
pub(crate) const DEGENERATE_BELOW: f64 = 0.015;
/// Points this far outside the silhouette, meters, still tell about it.
const REACH_M: f64 = 0.002;
/// Fewer telling points than this tell nothing.
const MIN_TELLING: usize = 8;

/// Curvature of the fit at its end, per telling point.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Observability {
    /// Eigenvalues of the mean outer product of the residuals' slopes, ascending. Angles are scaled by
    /// [`ANGLE_SCALE_M`], so all are comparable; the two shifts alone would add up to 1.
    pub eigenvalues: [f64; 3],
    /// The motion of the tool that changes the residuals least, in the grasp frame: angle times
    /// [`ANGLE_SCALE_M`], y, z; unit length, sign arbitrary. The angle turns about `center`.
    pub weakest: [f64; 3],
    /// The three motions that belong to `eigenvalues`, in the same order and form as `weakest` (which is the first).
    pub motions: [[f64; 3]; 3],
    /// Mean of the telling points, `(y, z)`, meters, grasp frame.
    pub center: DVec2,
    /// Points up to 2 mm outside the silhouette: those that tell.
    pub telling: usize,
    /// True where the weakest motion is not determined.
    pub degenerate: bool,
}

/// Looks at the slopes of all points near the outline, at the given pose. Points are `(y, z)`, meters, grasp frame;
/// those that are not finite are ignored. Too few telling points count as degenerate with zero eigenvalues.
pub fn observability(points_yz: &[DVec2], field: &DistanceField, grasp_from_object: PlanarPose) -> Observability {
    let finite: Vec<DVec2> = points_yz.iter().copied().filter(|p| p.is_finite()).collect();
    let centroid = finite.iter().sum::<DVec2>() / finite.len().max(1) as f64;
    let cloud = Cloud::new(finite.iter().map(|p| *p - centroid));
    of_cloud(&cloud, centroid, field, State::from_pose(grasp_from_object, centroid))
}

/// Observability from a cloud about its centroid (`(y, z)`, meters, grasp frame).
pub(super) fn of_cloud(cloud: &Cloud, centroid: DVec2, field: &DistanceField, state: State) -> Observability {
    let moments = field.moments(cloud, state, REACH_M);
    let count = moments.count;
    // From the object frame, where the field is, back to the hand.
    let turn = DVec2::from_angle(-state.phi);
    let arm = if count > 0 { moments.arms / count as f64 } else { DVec2::ZERO };
    let center = centroid + turn.rotate(arm);
    let unknown = Observability {
        eigenvalues: [0.0; 3],
        weakest: [0.0, 1.0, 0.0],
        motions: [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
        center,
        telling: count,
        degenerate: true,
    };
    if count < MIN_TELLING {
        return unknown;
    }
    // Slopes by the angle were taken about the centroid; about the telling points' own center they are
    // j0 - slope . perp(arm).
    let [m00, m01, m02, m11, m12, m22] = moments.products.map(|m| m / count as f64);
    let p = arm.perp();
    let h01 = m01 - (m11 * p.x + m12 * p.y);
    let h02 = m02 - (m12 * p.x + m22 * p.y);
    let h00 = m00 - 2.0 * (m01 * p.x + m02 * p.y) + m11 * p.x * p.x + 2.0 * m12 * p.x * p.y + m22 * p.y * p.y;
    let cross = turn.rotate(DVec2::new(h01, h02)) / ANGLE_SCALE_M;
    let (c, s) = (turn.x, turn.y);
    let h11 = c * c * m11 - 2.0 * c * s * m12 + s * s * m22;
    let h12 = c * s * (m11 - m22) + (c * c - s * s) * m12;
    let h22 = s * s * m11 + 2.0 * c * s * m12 + c * c * m22;
    let h = [[h00 / (ANGLE_SCALE_M * ANGLE_SCALE_M), cross.x, cross.y], [cross.x, h11, h12], [cross.y, h12, h22]];
    let Some((eigenvalues, vectors)) = eigen_symmetric(Matrix3::from(h)) else { return unknown };
    // A mean of squares: below zero is rounding.
    let eigenvalues: [f64; 3] = eigenvalues.map(|e| e.max(0.0)).into();
    let motions: [[f64; 3]; 3] = vectors.into();
    Observability {
        eigenvalues,
        weakest: motions[0],
        motions,
        center,
        telling: count,
        degenerate: eigenvalues[0] < DEGENERATE_BELOW,
    }
}
