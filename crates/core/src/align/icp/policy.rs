//! The values an ICP is put together from.

use serde::{Deserialize, Serialize};

/// Model that the contacts are compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// Model points seen along the closing axis, with the normals of the outline.
    Silhouette,
    /// Model points in space, with the normals of the surface.
    Surface,
    /// The triangles themselves; where searching them takes too long, points that stand for them
    /// ([`super::prepared::instead_of_triangles`]).
    Mesh,
}

/// Residual: the distance of a contact from its model point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Residual {
    /// The distance between the two.
    PointToPoint,
    /// The distance from the plane through the model point. Model points without a normal cost nothing.
    PointToPlane,
    /// The distance under the joint spread of both surfaces, each thin along its normal.
    /// Source: Segal, Haehnel and Thrun, Generalized-ICP, 2009.
    Generalized,
}

/// Kernel: the cost of a residual.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// The square of the residual, however large.
    None,
    /// The square of the residual up to the width, then in proportion: far points still pull.
    Huber {
        /// Meters.
        width_m: f64,
    },
    /// At most the square of the width: far points let go.
    GemanMcClure {
        /// Meters.
        width_m: f64,
    },
}

impl Kernel {
    /// Width, meters; infinite without one.
    pub(crate) fn width_m(self) -> f64 {
        match self {
            Self::None => f64::INFINITY,
            Self::Huber { width_m } | Self::GemanMcClure { width_m } => width_m,
        }
    }

    /// Cost, square meters.
    pub(super) fn cost(self, r: f64) -> f64 {
        match self {
            Self::None => r * r,
            Self::Huber { width_m } if r <= width_m => r * r,
            Self::Huber { width_m } => width_m * (2.0 * r - width_m),
            Self::GemanMcClure { width_m } => {
                let k2 = width_m * width_m;
                r * r * k2 / (k2 + r * r)
            }
        }
    }

    /// Half the cost's slope over the residual: 1 at zero.
    pub(super) fn weight(self, r: f64) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Huber { width_m } => (width_m / r).min(1.0),
            Self::GemanMcClure { width_m } => {
                let k2 = width_m * width_m;
                (k2 / (k2 + r * r)).powi(2)
            }
        }
    }
}

/// Rule by which pairs are left out of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Rejector {
    /// None.
    None,
    /// Pairs farther apart than this. They pay as if they were that far, so that running away does not pay.
    MaxDistance {
        /// Meters.
        distance_m: f64,
    },
    /// The worst, so that this share stays. Source: Chetverikov et al., The Trimmed ICP algorithm, 2002.
    Trimmed {
        /// In (0, 1].
        keep: f64,
    },
}

/// Method that finds a step from the pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Solver {
    /// The motion that brings the pairs closest: `atan2` in the plane, Horn's quaternion in space. Only for
    /// point to point.
    ClosedForm,
    /// Damped Gauss-Newton steps that are taken only if they lower the cost with the new nearest points.
    LevenbergMarquardt,
}

/// Motions that are open.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Dof {
    /// Angle about the closing axis, y and z.
    Planar,
    /// All six.
    Full,
}

impl Dof {
    /// Positions of the open motions among (turn about x, y, z; shift along x, y, z).
    pub(super) fn free(self) -> &'static [usize] {
        match self {
            Self::Planar => &[0, 4, 5],
            Self::Full => &[0, 1, 2, 3, 4, 5],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weight_is_the_slope_of_the_cost() {
        for kernel in [Kernel::None, Kernel::Huber { width_m: 1e-3 }, Kernel::GemanMcClure { width_m: 1e-3 }] {
            for r in [1e-5, 3e-4, 9e-4, 2e-3, 0.03] {
                let h = r * 1e-5;
                let slope = (kernel.cost(r + h) - kernel.cost(r - h)) / (2.0 * h);
                assert!((slope - 2.0 * r * kernel.weight(r)).abs() < 1e-6 * r, "{kernel:?} at {r}");
            }
            assert_eq!(kernel.weight(0.0), 1.0);
        }
    }
}
