//! How well contact points determine a planar pose, and which motion they leave open.

use glam::DVec2;

use super::{ANGLE_SCALE_M, DistanceField};
use crate::domain::frames::PlanarPose;

/// Smallest eigenvalue below which a pose counts as not determined.
///
/// Separates straight rods (at most 0.0084) from tools with an angle or a junction (at least 0.0229).
pub const DEGENERATE_BELOW: f64 = 0.015;
/// Points this far outside the silhouette, metres, still tell about it.
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
    /// [`ANGLE_SCALE_M`], y, z; unit length, sign arbitrary. The angle turns about `centre`.
    pub weakest: [f64; 3],
    /// Mean of the telling points, `(y, z)`, metres, grasp frame.
    pub centre: DVec2,
    /// Points up to 2 mm outside the silhouette: those that tell.
    pub telling: usize,
    /// Whether the weakest motion is not determined.
    pub degenerate: bool,
}

impl Observability {
    /// The weakest motion in words, such as `slides along 92° in y-z` or `turns about its centre`.
    pub fn weakest_text(&self) -> String {
        let [turn, y, z] = self.weakest;
        if turn.abs() > y.hypot(z) {
            "turns about its centre".to_owned()
        } else {
            format!("slides along {:.0}° in y-z", z.atan2(y).to_degrees().rem_euclid(180.0))
        }
    }
}

/// Looks at the slopes of all points near the outline, at the given pose. Points are `(y, z)`, metres, grasp frame;
/// those that are not finite are ignored. Too few telling points count as degenerate with zero eigenvalues.
pub fn observability(points_yz: &[DVec2], field: &DistanceField, grasp_from_object: PlanarPose) -> Observability {
    let object_from_grasp = grasp_from_object.inverse();
    let turn = DVec2::from_angle(grasp_from_object.theta_rad);
    let mut centre = DVec2::ZERO;
    let telling: Vec<(DVec2, DVec2)> = points_yz
        .iter()
        .filter_map(|&p| {
            let sample = field.sample(object_from_grasp.transform_yz(p));
            let near = sample.on_grid && (0.0..=REACH_M).contains(&sample.distance);
            near.then(|| (p, turn.rotate(sample.gradient)))
        })
        .inspect(|(p, _)| centre += *p)
        .collect();
    if telling.len() < MIN_TELLING {
        return Observability {
            eigenvalues: [0.0; 3],
            weakest: [0.0, 1.0, 0.0],
            centre: if telling.is_empty() { DVec2::ZERO } else { centre / telling.len() as f64 },
            telling: telling.len(),
            degenerate: true,
        };
    }
    centre /= telling.len() as f64;
    let mut h = [[0.0; 3]; 3];
    for (p, gradient) in &telling {
        let j = [gradient.dot((*p - centre).perp()) / ANGLE_SCALE_M, gradient.x, gradient.y];
        for (row, a) in h.iter_mut().zip(j) {
            for (cell, b) in row.iter_mut().zip(j) {
                *cell += a * b / telling.len() as f64;
            }
        }
    }
    let (eigenvalues, vectors) = eigen_symmetric(h);
    // A mean of squares: below zero is rounding.
    let eigenvalues = eigenvalues.map(|e| e.max(0.0));
    Observability {
        eigenvalues,
        weakest: vectors[0],
        centre,
        telling: telling.len(),
        degenerate: eigenvalues[0] < DEGENERATE_BELOW,
    }
}

/// Eigenvalues (ascending) and unit eigenvectors of a symmetric 3 x 3 matrix, by Jacobi rotations: slower than a
/// closed form, but accurate for repeated and tiny eigenvalues, which are the interesting ones here.
fn eigen_symmetric(mut a: [[f64; 3]; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..30 {
        let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
        if off <= 1e-15 * (a[0][0].abs() + a[1][1].abs() + a[2][2].abs()) {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let tau = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = 1f64.copysign(tau) / (tau.abs() + (1.0 + tau * tau).sqrt());
            let c = 1.0 / (1.0 + t * t).sqrt();
            let s = t * c;
            let turn = |x: f64, y: f64| (c * x - s * y, s * x + c * y);
            for row in a.iter_mut().chain(&mut v) {
                (row[p], row[q]) = turn(row[p], row[q]);
            }
            for (k, (x, y)) in a[p].into_iter().zip(a[q]).enumerate() {
                (a[p][k], a[q][k]) = turn(x, y);
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    (order.map(|i| a[i][i]), order.map(|i| [v[0][i], v[1][i], v[2][i]]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn eigenvectors_rebuild_the_matrix(m in proptest::array::uniform6(-1.0..1.0f64)) {
            let a = [[m[0], m[1], m[2]], [m[1], m[3], m[4]], [m[2], m[4], m[5]]];
            let (values, vectors) = eigen_symmetric(a);
            prop_assert!(values[0] <= values[1] && values[1] <= values[2]);
            for i in 0..3 {
                for j in 0..3 {
                    let rebuilt: f64 = (0..3).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                    prop_assert!((rebuilt - a[i][j]).abs() < 1e-12);
                }
            }
        }
    }
}
