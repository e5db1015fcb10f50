//! Grasps of the tool: the lab's grid, and random ones.

use crate::frames::PlanarPose;
use crate::noise::{Noise, Stream};

/// Half the range of the grasp angle, radians.
pub(crate) const THETA_RANGE_RAD: f64 = 22.5 * std::f64::consts::PI / 180.0;
/// Half the side of the square of grasp positions, meters.
pub(crate) const POSITION_RANGE_M: f64 = 0.005;
/// Grasps on the grid; higher numbers start over.
pub(crate) const GRID_GRASPS: u64 = 1344;

/// A grasp in the lab's terms, see [`PlanarPose::object_from_grasp_of_lab`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grasp {
    /// Angle of the grasp, radians.
    pub theta_rad: f64,
    /// First offset of the grasp, meters.
    pub x_m: f64,
    /// Second offset of the grasp, meters.
    pub y_m: f64,
}

impl Grasp {
    /// The pose that the lab calls the truth.
    pub fn object_from_grasp(self) -> PlanarPose {
        PlanarPose::object_from_grasp_of_lab(self.theta_rad, self.x_m, self.y_m)
    }
}

/// Grasp number `index` of the 10 x 10 mm grid: 7 angles varying fastest, then 3 small steps along x, then an
/// 8 x 8 sweep, as the lab's files run (1344 per tool).
pub fn grid_grasp(index: u64) -> Grasp {
    let index = index % GRID_GRASPS;
    let between = |step: u64, steps: u64| 2.0 * step as f64 / (steps - 1) as f64 - 1.0;
    let (angle, small, cell) = (index % 7, index / 7 % 3, index / 21);
    Grasp {
        theta_rad: between(angle, 7) * THETA_RANGE_RAD,
        x_m: between(cell % 8 * 3 + small, 24) * POSITION_RANGE_M,
        y_m: between(cell / 8, 8) * POSITION_RANGE_M,
    }
}

/// A grasp drawn uniformly from the range of the grid.
pub fn random_grasp(seed: u64) -> Grasp {
    random_grasp_within(seed, THETA_RANGE_RAD, POSITION_RANGE_M)
}

/// A grasp drawn uniformly: up to `theta_rad` turned either way, up to `position_m` off along x and y.
pub fn random_grasp_within(seed: u64, theta_rad: f64, position_m: f64) -> Grasp {
    let mut noise = Noise::new(seed, Stream::Grasp, 0);
    Grasp {
        theta_rad: noise.uniform(-theta_rad, theta_rad),
        x_m: noise.uniform(-position_m, position_m),
        y_m: noise.uniform(-position_m, position_m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_covers_its_range_once_with_the_angle_fastest() {
        let grasps: Vec<Grasp> = (0..GRID_GRASPS).map(grid_grasp).collect();
        assert!((grasps[0].theta_rad + THETA_RANGE_RAD).abs() < 1e-12);
        assert!((grasps[6].theta_rad - THETA_RANGE_RAD).abs() < 1e-12);
        assert_eq!((grasps[0].x_m, grasps[0].y_m), (grasps[6].x_m, grasps[6].y_m));
        assert!(grasps[7].x_m > grasps[6].x_m);
        for (i, a) in grasps.iter().enumerate() {
            assert!(a.x_m.abs() <= POSITION_RANGE_M + 1e-12 && a.y_m.abs() <= POSITION_RANGE_M + 1e-12);
            assert!(grasps[..i].iter().all(|b| a != b), "grasp {i} appears twice");
        }
        assert_eq!(grid_grasp(GRID_GRASPS + 3), grasps[3]);
    }
}
